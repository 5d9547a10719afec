// The data turned into the magnet's own frame: back by the time that the angle is late, and by the angle that the
// encoder is found to be off. (E102) The speed as the angle has it. (E107)
#include "dqw_estimator_block_q15.h"
#include "dqw_q15.h"

// An angle below this, in thousandths, or below so many of its deviations, is not worth turning by; of so many blocks
// it is known.
#define LEAST_MRAD 10
#define KNOWN_SD 4
#define KNOWN_BLOCKS 500u
#define FIRST_SEGMENTS 3u
// What a fault's onset makes of the flux does not stay: an encoder that is off does.
#define LASTING_BLOCKS 100u
// A speed that a loop takes from the angle is late. Blocks over which that is a mean, as a power of two, that it needs,
// and deviations beyond which it is so, squared; an angle that is further ahead than acos 0.9 is another sensor's
// fault.
#define LAG_BITS 12u
#define LAG_FEW 100u
#define LAG_SD2 25
// Of half a window: a tenth.
#define LAG_LEAST_Q20 104858
#define AHEAD_COSINE_Q60 1037629354146162304
// An angle counts up to 4 rad: that squared is 2^60 in Q56.
#define MOST_Q28 1073741824
#define FULL_Q28 268435456
#define TWO_PI_Q44 110534964875444
#define TURNS_A_RADIAN_Q31 341782638
#define GOLDEN 2654435769u
// What the sums can hold of a variance: 2^21 of the residual's.
#define WIDEST_Q40 ((int64_t)1 << 61)
#define ONE_Q30 1073741824

// A direction, or the cosine and sine of an angle.
typedef struct {
    int32_t c_q30, n_q30;
} direction;

// |x| < 2^31, and no direction is longer than 1 but for its last places: products below 2^61 and a bit.
static void turn(int32_t x[2], direction by)
{
    const int64_t d = (int64_t)by.c_q30 * x[0] + (int64_t)by.n_q30 * x[1];
    const int64_t q = (int64_t)by.c_q30 * x[1] - (int64_t)by.n_q30 * x[0];
    x[0] = dqw_q31_sat(dqw_q_round64(d, 30));
    x[1] = dqw_q31_sat(dqw_q_round64(q, 30));
}

// One angle on top of another.
static direction sum_of(direction a, direction b)
{
    const direction both = {
        (int32_t)dqw_q_round64((int64_t)a.c_q30 * b.c_q30 - (int64_t)a.n_q30 * b.n_q30, 30),
        (int32_t)dqw_q_round64((int64_t)a.n_q30 * b.c_q30 + (int64_t)a.c_q30 * b.n_q30, 30),
    };
    return both;
}

// Of twice an angle of one radian at most: the series to its tenth power, wrong by 3e-8.
static direction direction_of(int32_t half_q30)
{
    const int64_t square_q30 = dqw_q_round64((int64_t)half_q30 * half_q30, 30);
    int32_t c_q30 = ONE_Q30;
    int32_t s_q30 = ONE_Q30;  // over the angle
    for (int32_t k = 10; k > 0; k -= 2) {
        c_q30 = ONE_Q30 - (int32_t)dqw_q_round64(c_q30 * square_q30, 30) / (k * (k - 1));
        s_q30 = ONE_Q30 - (int32_t)dqw_q_round64(s_q30 * square_q30, 30) / (k * (k + 1));
    }
    const direction half = {c_q30, (int32_t)dqw_q_round64((int64_t)s_q30 * half_q30, 30)};
    return sum_of(half, half);
}

// What the rotor turns while the angle is late: two periods at most of less than a radian.
static direction late_of(const dqw_estimator_q15 *e, const dqw_estimator_q15_block *b)
{
    const dqw_estimator_q15_config *c = e->config;
    const int64_t periods_q28 = dqw_q_quotient64(c->angle_late_ns, c->scale.dt_ns, 28);
    // Of a sum of two speeds.
    const int64_t w_q28 = dqw_q_quotient64(b->sums[DQW_BLOCK_Q15_SIGNALS - 1], b->weight, 12);
    const int64_t half_q30 = dqw_q_product64(dqw_q_times64(w_q28, e->turn_q28, -28), periods_q28, -27);
    return direction_of((int32_t)dqw_q_within64(half_q30, ONE_Q30));
}

static bool has_effects(const dqw_estimator_q15 *e)
{
#if DQW_EFFECT_WEIGHTS > 0
    return e->effect.count > 0;
#else
    (void)e;
    return false;
#endif
}

// Of an angle of any size below 2^52: what is left of its whole turns, of twice a half that is twice a quarter.
static direction direction_of_any(int64_t angle_q44)
{
    // 2^28 by 2^29
    const int64_t turns = dqw_q_round64(dqw_q_floor64(angle_q44, 24) * TURNS_A_RADIAN_Q31, 51);
    // 3.2 at most, for what was rounded off
    const int64_t left_q44 = angle_q44 - turns * TWO_PI_Q44;
    const direction half = direction_of((int32_t)dqw_q_round64(left_q44, 16));
    return sum_of(half, half);
}

// How late the speed is, in halves of a window, where that is beyond doubt, and the speed's changes are more motion than
// noise, which does not last: that many times those would bring more of the noise than it mends, and what is over next
// to nothing may be anything.
static int32_t lag_of(const dqw_estimator_q15 *e)
{
    const int64_t blocks = e->blocks < 1u << LAG_BITS ? e->blocks : 1 << LAG_BITS;
    // 2^60 by 2^12, and 2^60 by 25: of halves
    const bool sure = e->blocks >= LAG_FEW && (((int64_t)e->lag_num * e->lag_num) >> 17) * blocks >
                                                  (((int64_t)e->lag_rest * e->lag_by) >> 17) * LAG_SD2;
    // Half of it.
    const bool moves = e->lag_den > e->lag_by >> 1;
    const int32_t lag_q20 = sure && moves ? dqw_q_quotient32(e->lag_num, e->lag_den, 20) : 0;
    // Not what the angle itself may be late by.
    return lag_q20 > LAG_LEAST_Q20 ? lag_q20 : 0;
}

// |x| and what m stands for are 2^60 at most, the turn's part 2^44: what is rounded off comes in turn, as a mean over
// thousands of blocks moves by less than its last places.
static int64_t toward(int64_t m, int64_t x_q56, unsigned halvings, uint32_t turn)
{
    const int64_t part = (int64_t)(((uint64_t)turn << 31) >> (63u - LAG_BITS - halvings));
    return m + dqw_q_floor64(x_q56 - m * ((int64_t)1 << halvings) + part, LAG_BITS + halvings);
}

// The four means move to a block's: as many halvings of Q56 as keep the largest in 30 bits.
static void keep_lag(dqw_estimator_q15 *e, int64_t ahead_q28, int64_t faster_q28, int64_t earlier_q28, int64_t rest_q28)
{
    unsigned n = e->lag_halvings;
    const uint32_t turn = e->number * GOLDEN;
    int64_t num = toward(e->lag_num, ahead_q28 * earlier_q28, n, turn);
    int64_t den = toward(e->lag_den, faster_q28 * earlier_q28, n, turn + GOLDEN);
    int64_t rest = toward(e->lag_rest, rest_q28 * rest_q28, n, turn + 2u * GOLDEN);
    int64_t by = toward(e->lag_by, earlier_q28 * earlier_q28, n, turn + 3u * GOLDEN);
    unsigned bits = dqw_q_bits64(num);
    if (dqw_q_bits64(den) > bits) bits = dqw_q_bits64(den);
    if (dqw_q_bits64(rest) > bits) bits = dqw_q_bits64(rest);
    if (dqw_q_bits64(by) > bits) bits = dqw_q_bits64(by);
    // Two bits less than full before there is one more.
    const unsigned less = bits > 30u ? bits - 30u : 0u;
    const unsigned more = bits >= 28u ? 0u : n < 28u - bits ? n : 28u - bits;
    const int64_t scale = (int64_t)1 << more;
    num = dqw_q_floor64(num, less) * scale;
    den = dqw_q_floor64(den, less) * scale;
    rest = dqw_q_floor64(rest, less) * scale;
    by = dqw_q_floor64(by, less) * scale;
    e->lag_num = (int32_t)num;
    e->lag_den = (int32_t)den;
    e->lag_rest = (int32_t)rest;
    e->lag_by = (int32_t)by;
    e->lag_halvings = (uint8_t)(n + less - more);
}

bool dqw_estimator_keep_pace_q15(dqw_estimator_q15 *e, dqw_estimator_q15_block *b, const int64_t advance_q30[2],
                                 int32_t w_sum_q15)
{
    int32_t *before_q15 = e->w_before_q15;
    // 2^25
    const int32_t faster_q15 = w_sum_q15 - before_q15[0];
    const int32_t earlier_q15 = before_q15[1] - before_q15[2];
    before_q15[2] = before_q15[1];
    before_q15[1] = before_q15[0];
    before_q15[0] = w_sum_q15;
    e->paced = (uint8_t)(e->elapsed != 1 || !b->whole ? 0 : e->paced < 3 ? e->paced + 1 : 3);
    // Without an angle there is no advance.
    const bool known = dqw_q_size64(advance_q30[0]) + dqw_q_size64(advance_q30[1]) > ONE_Q30 / 2;
    if (e->paced == 3 && known && e->pole_pairs != 0 && !e->config->settled) {
        // [TUR.1] by how much the angle is ahead of the speed; judged by the change two halves before, whose noise is
        // another
        // The sum is one of two speeds: 2^28 by 2^24, in Q43 over 2. A direction is 1.05 at most, an advance 1.11:
        // 2^61.2
        const direction w = direction_of_any((int64_t)e->turn_q28 * w_sum_q15);
        if (advance_q30[0] * w.c_q30 + advance_q30[1] * w.n_q30 > AHEAD_COSINE_Q60) {
            const int64_t ahead_q28 = dqw_q_round64(advance_q30[1] * w.c_q30 - advance_q30[0] * w.n_q30, 32);
            // 2^28 by 2^25
            const int64_t faster_q28 = dqw_q_within64(dqw_q_round64((int64_t)e->turn_q28 * faster_q15, 16), MOST_Q28);
            const int64_t earlier_q28 = dqw_q_within64(dqw_q_round64((int64_t)e->turn_q28 * earlier_q15, 16), MOST_Q28);
            // 2^31 by 2^30
            const int64_t rest_q28 = ahead_q28 - dqw_q_round64(lag_of(e) * faster_q28, 20);
            keep_lag(e, ahead_q28, faster_q28, earlier_q28, dqw_q_within64(rest_q28, MOST_Q28));
        }
    }

    // [TUR.2] the block's speeds as of so much later; where pairs are missing nobody knows how they change
    // The half's change as a mean of one speed: 2^29. By more than the full speed none is wrong.
    const int32_t change_q28 = dqw_q_quotient32(faster_q15, e->window.half, 12);
    const int64_t more_q28 = dqw_q_within64(dqw_q_times64(lag_of(e), change_q28, -20), FULL_Q28);
    if (more_q28 == 0) return true;
    // As far as a window's sums go: 2^14 by 2^17. Products 2^42, and 2^28 by 2^31.
    const int64_t most = (int64_t)b->weight << 17;
    b->sums[8] = (int32_t)dqw_q_within64(b->sums[8] + dqw_q_round64(more_q28 * b->weight, 12), most);
    b->sums[6] = (int32_t)dqw_q_within64(b->sums[6] + dqw_q_round64(more_q28 * b->sums[2], 27), most);
    b->sums[7] = (int32_t)dqw_q_within64(b->sums[7] + dqw_q_round64(more_q28 * b->sums[3], 27), most);
    return e->paced != 0;
}

void dqw_estimator_turn_block_q15(const dqw_estimator_q15 *e, dqw_estimator_q15_block *b)
{
    if (has_effects(e)) return;
    // [TUR.3] the angle that the encoder is off, and what the rotor turns while the angle is late
    direction by = {e->turn_cosine_q30, e->turn_sine_q30};
    if (e->config->angle_late_ns != 0 && e->pole_pairs != 0) by = sum_of(by, late_of(e, b));
    if (by.n_q30 == 0 && by.c_q30 > 0) return;

    // [TUR.4] every vector of the block by both
    // v, i, di, w i; behind the speed dead time's two.
    for (int i = 0; i < DQW_BLOCK_Q15_SIGNALS - 1; i += 2) turn(&b->sums[i], by);
    for (int i = DQW_BLOCK_Q15_SIGNALS; i < DQW_PLAIN_Q15_SIGNALS; i += 2) turn(&b->sums[i], by);
    turn(b->v_step_q15, by);
    // An angle goes the other way.
    const direction back = {by.c_q30, -by.n_q30};
    int32_t angle_q15[2] = {b->with.cosine_q15, b->with.sine_q15};
    turn(angle_q15, back);
    b->with.cosine_q15 = dqw_q15_sat(angle_q15[0]);
    b->with.sine_q15 = dqw_q15_sat(angle_q15[1]);
}

// The same direction, of length 1.
static direction unit_of(direction x)
{
    const int32_t length_q30 = dqw_q_length32(x.c_q30, x.n_q30);
    const direction unit = {dqw_q_quotient32(x.c_q30, length_q30, 30), dqw_q_quotient32(x.n_q30, length_q30, 30)};
    return unit;
}

// A voltage that acts in another period than is said turns the frame too: does that leave less than half of the flux
// across? What an encoder's angle leaves of unlike inductances reads as late as well. (E90)
static bool by_the_voltage(const dqw_estimator_q15 *e)
{
    const enum dqw_voltage_acts acts = dqw_estimator_voltage_acts_q15(e);
    const bool next = e->config->voltage_next;
    if (acts == DQW_VOLTAGE_NOT_KNOWN || (acts == DQW_VOLTAGE_NEXT) == next) return false;
    const int64_t left_q24 = e->w_q24[DQW_PSI_Q] + dqw_estimator_beside_late_q24(e, DQW_PSI_Q);
    return 2 * dqw_q_size64(left_q24) < dqw_q_size64(e->w_q24[DQW_PSI_Q]);
}

void dqw_estimator_turn_on_q15(dqw_estimator_q15 *e, const dqw_units_q15 *u, bool solved)
{
    if (has_effects(e) || !dqw_estimator_has_psi_q_q15(e) || e->config->settled || e->blocks < KNOWN_BLOCKS) return;
    // Later it is a change, and to be told as one.
    if (e->config->follow && e->segment.segments >= FIRST_SEGMENTS && e->across == 0) return;
    // [TUR.5] is there flux across, beyond doubt
    const int32_t psi_q24 = e->w_q24[DQW_PSI];
    const int32_t across_q24 = e->w_q24[DQW_PSI_Q];
    const int64_t size_q24 = dqw_q_size64(across_q24);
    const int64_t sd_q40 = dqw_estimator_read_q15(e, DQW_PSI_Q).sd_q40;
    if (1000 * size_q24 <= (int64_t)LEAST_MRAD * psi_q24 || sd_q40 >= size_q24 * 65536 / KNOWN_SD) {
        e->across = 0;
        return;
    }
    if (e->across < LASTING_BLOCKS) e->across++;
    if (e->across < LASTING_BLOCKS || !solved) return;
    e->across = 0;
    if (by_the_voltage(e)) return;

    // [TUR.6] from now on all flux is along d
    const direction found = unit_of((direction){psi_q24, -across_q24});
    const direction before = {e->turn_cosine_q30, e->turn_sine_q30};
    const direction all = unit_of(sum_of(before, found));
    e->turn_cosine_q30 = all.c_q30;
    e->turn_sine_q30 = all.n_q30;
    e->w_q24[DQW_PSI] = dqw_q_length32(psi_q24, across_q24);
    e->w_q24[DQW_PSI_Q] = 0;
    dqw_segment_restart_q15(&e->segment);

    // [TUR.7] what was learned is of another frame: unlike inductances are to it a resistance and a coupling
    const int64_t Xd_q40 = dqw_q_times64(u->X_q40[0], e->w_q24[DQW_LD], -24);
    const int64_t Xq_q40 = dqw_q_times64(u->X_q40[1], e->w_q24[DQW_LQ], -24);
    const int64_t across_q40 = dqw_q_times64(Xd_q40 > Xq_q40 ? Xd_q40 : Xq_q40, found.n_q30, -30);
    for (int i = DQW_R; i <= DQW_LQ; i++) {
        const int64_t sd_of_unit_q24 = dqw_q_quotient64(across_q40, dqw_estimator_whole_q40(e, u, i), 24);
        const int64_t q_q40 = dqw_q_quotient64(dqw_q_product64(sd_of_unit_q24, sd_of_unit_q24, 0),
                                               dqw_estimator_common_variance_q56(e), 48);
        const int64_t bounded_q40 = q_q40 < WIDEST_Q40 ? q_q40 : WIDEST_Q40;
        dqw_normal_grow_q15(&e->normal, i, bounded_q40);
        e->cov_q40[i] = dqw_q_within64(e->cov_q40[i] + bounded_q40, 2 * WIDEST_Q40);
    }
}
