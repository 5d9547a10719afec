// The data turned into the magnet's own frame: back by the time that the angle is late, and by the angle that the
// encoder is found to be off. (E102)
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

void dqw_estimator_turn_block_q15(const dqw_estimator_q15 *e, dqw_estimator_q15_block *b)
{
    if (has_effects(e)) return;
    // [TUR.1] the angle that the encoder is off, and what the rotor turns while the angle is late
    direction by = {e->turn_cosine_q30, e->turn_sine_q30};
    if (e->config->angle_late_ns != 0 && e->pole_pairs != 0) by = sum_of(by, late_of(e, b));
    if (by.n_q30 == 0 && by.c_q30 > 0) return;

    // [TUR.2] every vector of the block by both
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

void dqw_estimator_turn_on_q15(dqw_estimator_q15 *e, const dqw_units_q15 *u, bool solved)
{
    if (has_effects(e) || !dqw_estimator_has_psi_q_q15(e) || e->config->settled || e->blocks < KNOWN_BLOCKS) return;
    // Later it is a change, and to be told as one.
    if (e->config->follow && e->segment.segments >= FIRST_SEGMENTS) return;
    // [TUR.3] is there flux across, beyond doubt
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
    // A voltage that acts in another period than is said turns the frame too.
    const enum dqw_voltage_acts acts = dqw_estimator_voltage_acts_q15(e);
    if (acts != DQW_VOLTAGE_NOT_KNOWN && (acts == DQW_VOLTAGE_NEXT) != e->config->voltage_next) return;

    // [TUR.4] from now on all flux is along d
    const direction found = unit_of((direction){psi_q24, -across_q24});
    const direction before = {e->turn_cosine_q30, e->turn_sine_q30};
    const direction all = unit_of(sum_of(before, found));
    e->turn_cosine_q30 = all.c_q30;
    e->turn_sine_q30 = all.n_q30;
    e->w_q24[DQW_PSI] = dqw_q_length32(psi_q24, across_q24);
    e->w_q24[DQW_PSI_Q] = 0;
    dqw_segment_restart_q15(&e->segment);

    // [TUR.5] what was learned is of another frame: unlike inductances are to it a resistance and a coupling
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
