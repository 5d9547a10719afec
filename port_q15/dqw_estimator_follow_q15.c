// What lasts of the residual, and what follows when a weight has changed.
#include "dqw_estimator_block_q15.h"
#include "dqw_q15.h"

// A stretch of about 30 ms: shorter than an operating point, longer than what turns with the rotor. In blocks of so
// many ns.
#define STRETCH_NS 30000000
#define STRETCH_LEAST 4
#define STRETCH_MOST 200
// Not in a block whose weights are solved, where one of the next is none.
#define LATE_MOST 2
// A segment takes 0.35 s of learned blocks at least and 20 s at most.
#define SEGMENT_LEAST_NS 350000000
#define SEGMENT_MOST_NS 20000000000
// Bands to begin with, and the narrowest: 0.002 of R and L, 0.00035 of the flux, which is known best. How far a weight
// may have jumped at once: 0.3 and 0.1 of it; what changed by more is found once more. Dead time's are of a thirtieth
// of the full voltage: 0.009 and 0.9.
#define LEAST_Q30 2147484
#define LEAST_PSI_Q30 375810
#define LEAST_DEAD_Q28 2415919
#define WIDE_Q30 322122547
#define WIDE_PSI_Q30 107374182
#define WIDE_DEAD_Q28 241591910
// What a weight may wander in a second without being found changed, squared: 0.001 of R, 0.0003 of the others. A
// winding that warms by 1 K/s is four times faster, which segments that agree make up for.
#define WANDER_R_PARTS 1000000
#define WANDER_PARTS 11111111
// What the sums can hold of a variance: 2^21 of the residual's.
#define WIDEST_Q40 ((int64_t)1 << 61)
#define ONE_Q30 1073741824
// Blocks over which means of what lasts are.
#define LASTING_MEMORY 4096
#define GOLDEN 2654435769u

enum { D = 0, Q = 1, N = DQW_FOLLOWED };

static int64_t block_ns(const dqw_estimator_q15 *e)
{
    return (int64_t)e->config->scale.dt_ns * e->window.half;
}

// Means over thousands of blocks move by less than their last places: what is rounded off comes in turn, by the golden
// ratio's multiples, which are spread evenly.
static uint32_t turn_of(const dqw_estimator_q15 *e)
{
    return e->number * GOLDEN;
}

// |x - m| < 2^32 + 2^31, and by part and turn below 2^63.
static int64_t toward(int64_t m, int64_t x, int32_t part_q30, uint32_t turn)
{
    return m + dqw_q_floor64((x - m) * part_q30 + (turn >> 2), 30);
}

static void toward_power(uint32_t *m, int64_t x, int32_t part_q30, uint32_t turn)
{
    const int64_t most = UINT32_MAX;
    const int64_t to = toward(*m, x > most ? most : x < INT32_MIN ? INT32_MIN : x, part_q30, turn);
    *m = (uint32_t)(to < 0 ? 0 : to < most ? to : most);
}

static void toward_product(int32_t *m, int64_t x, int32_t part_q30, uint32_t turn)
{
    *m = dqw_q31_sat(toward(*m, dqw_q31_sat(x), part_q30, turn));
}

// By so many halvings, 1 .. 31.
static int16_t halved(int32_t x, unsigned halvings, uint32_t turn)
{
    const uint32_t below = ((uint32_t)x & ((1u << halvings) - 1u)) + (turn >> (32u - halvings));
    return dqw_q15_sat(dqw_q_floor32(x, halvings) + (int32_t)(below >> halvings));
}

static int16_t more(int16_t sum, int16_t x)
{
    return dqw_q15_sat(sum + x);
}

// Of what a weight is now.
static int32_t part_of(const dqw_estimator_q15 *e, int i, int32_t of_any_q30, int32_t of_flux_q30, int32_t dead_q28)
{
    const bool flux = i == DQW_PSI || i == DQW_PSI_Q;
    if (dqw_estimator_is_apart_q15(e, i)) return 0;
    if (i > DQW_PSI && !flux && i < DQW_PARAMETERS) return dead_q28;
    // Of a weight of 27, 8 at most.
    const int64_t size_q24 = dqw_estimator_counted_q15(e, i, dqw_estimator_size_q24(e, i), -1);
    return dqw_q_times32(size_q24, flux ? of_flux_q30 : of_any_q30, -26);
}

static int32_t least_q28(const dqw_estimator_q15 *e, int i)
{
    return part_of(e, i, LEAST_Q30, LEAST_PSI_Q30, LEAST_DEAD_Q28);
}

static int32_t wide_q28(const dqw_estimator_q15 *e, int i)
{
    return part_of(e, i, WIDE_Q30, WIDE_PSI_Q30, WIDE_DEAD_Q28);
}

void dqw_estimator_follow_start_q15(dqw_estimator_q15 *e)
{
    const dqw_residual_q15 nothing = {
        .opened = e->residual.opened, .opened_at = e->residual.opened_at, .opened_since = e->residual.opened_since};
    e->residual = nothing;
    int32_t band_q28[N];
    for (int i = 0; i < N; i++) band_q28[i] = least_q28(e, i);
    dqw_segment_init_q15(&e->segment, band_q28);
}

int32_t dqw_mean_part_q30(const dqw_estimator_q15 *e, uint32_t blocks, uint32_t stretch, uint32_t memory)
{
    const int64_t power = dqw_estimator_forgets_q15(e) ? 3 : 1;
    const uint32_t part = (uint32_t)dqw_q_quotient32((power + 1) * stretch, blocks + power * stretch, 30);
    const uint32_t least = stretch * (ONE_Q30 / memory);
    return (int32_t)(part > least ? part : least);
}

int32_t dqw_lasting_part_q30(const dqw_estimator_q15 *e, uint32_t stretch)
{
    return dqw_mean_part_q30(e, e->blocks - DQW_LASTING_FROM_Q15, stretch, LASTING_MEMORY);
}

uint32_t dqw_estimator_stretch_q15(const dqw_estimator_q15 *e)
{
    const int32_t n = dqw_q_quotient32(STRETCH_NS, block_ns(e), 0);
    return n < STRETCH_LEAST ? STRETCH_LEAST : n > STRETCH_MOST ? STRETCH_MOST : (uint32_t)n;
}

static int32_t lighter(int32_t x_q28, int64_t weigh_q24)
{
    return dqw_q31_sat(dqw_q_round64(x_q28 * weigh_q24, 24));
}

// The sums of a stretch's inputs are of a weight's largest one, 2^13, over as many blocks as a power of two above the
// stretch's: so many halvings of Q28.
static unsigned halvings_of(const dqw_estimator_q15 *e, const dqw_units_q15 *u, int i, unsigned bits)
{
    const int n = (int)dqw_q_bits64(dqw_estimator_whole_q40(e, u, i)) - 25 + (int)bits;
    return n < 1 ? 1u : n > 31 ? 31u : (unsigned)n;
}

static void forget_neighbours(dqw_residual_q15 *k)
{
    for (int axis = 0; axis < 2; axis++) {
        for (int n = 0; n < 3; n++) k->before_q17[n][axis] = 0;
        k->slow_before_q18[axis] = 0;
    }
    k->slow_at = 0;
}

// One stretch is complete: its means, and what the others leave of them.
static void end_stretch(dqw_estimator_q15 *e, const dqw_units_q15 *u, uint32_t n, unsigned bits)
{
    dqw_residual_q15 *k = &e->residual;
    const int32_t part_q30 = dqw_lasting_part_q30(e, n);
    const uint32_t turn = turn_of(e);
    int64_t slow_q36 = 0;
    for (int axis = 0; axis < 2; axis++) {
        const int16_t mean_q18 = dqw_q15_sat(k->slow_sum[axis] * (1 << bits) / (int32_t)n);
        slow_q36 += (int64_t)mean_q18 * k->slow_before_q18[axis];
        k->slow_before_q18[axis] = mean_q18;
    }
    // Half of both axes'.
    toward_product(&k->slow_q38, 2 * slow_q36, part_q30, turn);

    int32_t x_q28[2][DQW_NORMAL_INPUTS];
    const int inputs = dqw_estimator_inputs_q15(e);
    for (int i = 0; i < inputs; i++)
        for (int axis = 0; axis < 2; axis++)
            x_q28[axis][i] = dqw_q31_sat(dqw_q_quotient64(k->slow_x[axis][i], n, (int)halvings_of(e, u, i, bits)));
    // The late voltage only watches.
    e->normal.inputs = (uint8_t)inputs;
    dqw_normal_alone_q15(&e->normal, x_q28);
    e->normal.inputs = (uint8_t)(inputs + 1);
    for (int i = 0; i < inputs; i++) {
        // Each 2^62 at most, and half of both
        const uint64_t power_q56 = ((uint64_t)((int64_t)x_q28[D][i] * x_q28[D][i]) +
                                    (uint64_t)((int64_t)x_q28[Q][i] * x_q28[Q][i])) >>
                                   1;
        toward_power(&k->slow_alone_q31[i], (int64_t)(power_q56 >> 25), part_q30, turn + (uint32_t)i * GOLDEN);
    }
}

void dqw_estimator_keep_lasting_q15(dqw_estimator_q15 *e, const dqw_rows_q15 *r, const int64_t weigh_q24[], int sixfold,
                                    bool busy)
{
    dqw_residual_q15 *k = &e->residual;
    if (e->elapsed != 1) forget_neighbours(k);
    const uint32_t turn = turn_of(e);
    const uint32_t n = dqw_estimator_stretch_q15(e);
    const unsigned bits = dqw_q_bits64(n - 1u);
    const int inputs = dqw_estimator_inputs_q15(e);
    // [FOL.1] what of the residual is still there two and three blocks later, where blocks overlap no more
    int64_t product_q34[3] = {0, 0, 0};
    for (int axis = 0; axis < 2; axis++) {
        int16_t *sum = &k->slow_sum[axis];
        int16_t *x = k->slow_x[axis];
        if (k->slow_at == 0) {
            *sum = 0;
            for (int i = 0; i < inputs; i++) x[i] = 0;
        }
        const int32_t e_q28 = lighter(e->e_q28[axis], weigh_q24[axis]);
        const int16_t now_q17 = dqw_q15_sat(dqw_q31_sat(dqw_q_round64(e_q28, 11)));
        for (int m = 0; m < 2; m++) product_q34[m] += (int64_t)now_q17 * k->before_q17[m + 1][axis];
        for (int m = 2; m > 0; m--) k->before_q17[m][axis] = k->before_q17[m - 1][axis];
        k->before_q17[0][axis] = now_q17;
        *sum = more(*sum, halved(e_q28, 10u + bits, turn));
        for (int i = 0; i < inputs; i++)
            x[i] = more(x[i], halved(lighter(r->x_q28[axis][i], weigh_q24[axis]), halvings_of(e, &r->unit, i, bits),
                                     turn + (uint32_t)i * GOLDEN));
    }
    if (e->blocks <= DQW_LASTING_FROM_Q15) {
        k->slow_at = 0;
        return;
    }
    const int32_t part_q30 = dqw_lasting_part_q30(e, 1);
    // Half of both axes'; of the third what goes with the sign, whatever lasts anyway.
    product_q34[2] = sixfold * (product_q34[0] - dqw_q_round64(k->lasting_q38[0], 3));
    for (int m = 0; m < 3; m++) toward_product(&k->lasting_q38[m], 8 * product_q34[m], part_q30, turn);
    // [FOL.2] and from one stretch to the next
    if (++k->slow_at < n || (busy && k->slow_at < n + LATE_MOST)) return;
    end_stretch(e, &r->unit, k->slow_at, bits);
    k->slow_at = 0;
}

// One over a variance.
static int64_t information_q31(int64_t cov_q40)
{
    return dqw_q_quotient64(1, cov_q40, 71);
}

void dqw_estimator_keep_alone_q15(dqw_estimator_q15 *e, const int64_t before_q40[], uint32_t rows)
{
    if (e->blocks <= DQW_LASTING_FROM_Q15) return;
    // What so many rows leave of a mean: (1 - part)^rows
    int64_t keeps_q30 = ONE_Q30;
    int64_t power_q30 = ONE_Q30 - dqw_lasting_part_q30(e, 1);
    for (uint32_t left = rows; left != 0; left >>= 1) {
        if ((left & 1u) != 0) keeps_q30 = dqw_q_round64(keeps_q30 * power_q30, 30);
        power_q30 = dqw_q_round64(power_q30 * power_q30, 30);
    }
    const uint32_t turn = turn_of(e);
    for (int i = 0; i < dqw_estimator_inputs_q15(e); i++) {
        const int64_t before = information_q31(before_q40[i]);
        const int64_t more = information_q31(e->cov_q40[i]) - before;
        // Full sums were halved, or it proved to be tied to others: that tells nothing. What one solution has too much
        // by rounding the next has too little, so that both count.
        if (more < -dqw_q_floor64(before, 12)) continue;
        toward_power(&e->residual.alone_q31[i], dqw_q_quotient64(more, rows, 0), (int32_t)(ONE_Q30 - keeps_q30),
                     turn + (uint32_t)i * GOLDEN);
    }
}

void dqw_estimator_keep_noisy_q15(dqw_estimator_q15 *e, int L, int64_t noisy_q48)
{
    if (e->blocks > DQW_LASTING_FROM_Q15)
        toward_power(&e->residual.noisy_q35[L - DQW_LD], dqw_q_floor64(noisy_q48, 13), dqw_lasting_part_q30(e, 1),
                     turn_of(e) + (uint32_t)L * GOLDEN);
}

// Down at once, up slowly: by 0.15 of itself; from nothing to what noise would hide, some per cent of all, in about as
// many segments as bands are young.
static int64_t calmer(int64_t calm_q56, int64_t now_q56, int64_t all_q56, bool first)
{
    const int64_t most = calm_q56 + dqw_q_product64(calm_q56 + dqw_q_floor64(all_q56, 10), 644245094, -32);
    return first || now_q56 < most ? now_q56 : most;
}

// What has changed must not seem to be what the model always lacked.
static dqw_lasting_q15 keep_calm(dqw_estimator_q15 *e)
{
    const dqw_lasting_q15 now = dqw_estimator_lasting_q15(e);
    const bool first = !dqw_estimator_knows_calm_q15(e);
    dqw_lasting_q15 calm = dqw_estimator_calm_q15(e);
    calm.fast_q56 = calmer(calm.fast_q56, now.fast_q56, calm.all_q56, first);
    calm.slow_q56 = calmer(calm.slow_q56, now.slow_q56, calm.all_q56, first);
    calm.turning_q56 = calmer(calm.turning_q56, now.turning_q56, calm.all_q56, first);
    calm.all_q56 = calmer(calm.all_q56, now.all_q56, 0, first);
    e->residual.calm_q28[0] = dqw_q_root64((uint64_t)calm.fast_q56);
    e->residual.calm_q28[1] = dqw_q_root64((uint64_t)calm.slow_q56);
    e->residual.calm_q28[2] = dqw_q_root64((uint64_t)calm.all_q56);
    e->residual.calm_q28[3] = dqw_q_root64((uint64_t)calm.turning_q56);
    return calm;
}

static void grow(dqw_estimator_q15 *e, int i, int64_t q_q40)
{
    const int64_t room = WIDEST_Q40 - e->cov_q40[i];
    const int64_t q = q_q40 < room ? q_q40 : room;
    if (q <= 0) return;
    dqw_normal_grow_q15(&e->normal, i, q);
    e->cov_q40[i] += q;
}

// What the weight may wander in a segment, what one says of it, and so what part it is to be moved by: as sure as that,
// and no surer.
static void stay_awake(dqw_estimator_q15 *e, int i, int64_t seconds_q20, int64_t rows, int64_t variance_q56)
{
    const int64_t alone_q31 = dqw_estimator_counted_q15(e, i, e->residual.alone_q31[i], 2);
    const bool wanders = i <= DQW_PSI || i == DQW_PSI_Q || (i >= DQW_PARAMETERS && !dqw_estimator_is_apart_q15(e, i));
    if (!wanders || alone_q31 == 0 || (e->learned >> i & 1u) == 0) return;
    const int64_t size_q24 = dqw_estimator_counted_q15(e, i, dqw_estimator_size_q24(e, i), -1);
    const int64_t a_second_q56 = dqw_q_quotient64(dqw_q_product64(size_q24, size_q24, 0),
                                                  i == DQW_R ? WANDER_R_PARTS : WANDER_PARTS, 8);
    // The more, the more segments agree.
    const int16_t up = e->segment.up_q11[i];
    const int16_t down = e->segment.down_q11[i];
    const int64_t agrees_q11 = 2048 + (up > down ? up : down);
    const int64_t walk_q56 = dqw_q_product64(dqw_q_product64(a_second_q56, seconds_q20, -20), agrees_q11 * agrees_q11,
                                             -22);
    const int64_t one_q56 = dqw_q_within64(dqw_q_quotient64(variance_q56, rows * alone_q31, 31), (int64_t)1 << 61);
    const int64_t band_q28 = e->segment.band_q28[i];
    // 2^62 and 2^61
    const int64_t y_q24 = dqw_q_within64(dqw_q_quotient64(walk_q56, band_q28 * band_q28 + one_q56, 24),
                                         (int64_t)64 << 24);
    // (y + sqrt(y^2 + 4 y)) / 2: 2^60 and 2^56
    const int64_t root_q24 = dqw_q_root64((uint64_t)(y_q24 * y_q24) + ((uint64_t)y_q24 << 26));
    const int64_t want_q40 = dqw_q_quotient64(y_q24 + root_q24, rows * alone_q31, 46);
    grow(e, i, dqw_estimator_counted_q15(e, i, want_q40, 2) - e->cov_q40[i]);
}

// A weight has changed: all move as the segment says, and its past weighs little from now on.
static void open(dqw_estimator_q15 *e, int changed, const dqw_lasting_q15 *calm, const int32_t wide[],
                 const int32_t move_q24[])
{
    dqw_residual_q15 *k = &e->residual;
    e->segment.since = 1;
    for (int m = 0; m < 3; m++)
        k->lasting_q38[m] = dqw_q31_sat(dqw_q_floor64(m < 2 ? calm->fast_q56 : calm->turning_q56, 18));
    k->slow_q38 = dqw_q31_sat(dqw_q_floor64(calm->slow_q56, 18));
    for (int axis = 0; axis < 2; axis++)
        if (e->error_q56[axis] > calm->all_q56) e->error_q56[axis] = calm->all_q56;
    if (k->opened < UINT8_MAX) k->opened++;
    k->opened_at = e->number;
    k->opened_since = e->segment.agreed ? k->began_before : k->began;
    const int followed = dqw_estimator_has_map_q15(e) ? N : DQW_PARAMETERS;
    for (int i = 0; i < followed; i++) {
        // The sums say how far the weights are off: from now on, from where they are moved to.
        e->w_q24[i] = dqw_q31_sat((int64_t)e->w_q24[i] + move_q24[i]);
        // The others took up a part of it while it was not known.
        const int64_t took_q28 = i == changed ? wide[i]
                                              : dqw_q31_sat((int64_t)DQW_TOOK_BANDS_Q15 * e->segment.band_q28[i]);
        const int64_t grown_q40 = dqw_q_quotient64(took_q28 * took_q28, calm->all_q56, 40);
        grow(e, i, dqw_estimator_counted_q15(e, i, grown_q40, 2));
    }
}

bool dqw_estimator_segment_ends_q15(dqw_estimator_q15 *e, const dqw_estimator_q15_block *b)
{
    const dqw_block_q15 m = dqw_estimator_means_q15(b);
    const uint32_t least = (uint32_t)dqw_q_quotient32(SEGMENT_LEAST_NS, block_ns(e), 0);
    const uint32_t most = (uint32_t)dqw_q_quotient32(SEGMENT_MOST_NS, block_ns(e), 0);
    return dqw_segment_block_q15(&e->segment, m.w_m, m.i_q, least, most);
}

void dqw_estimator_follow_q15(dqw_estimator_q15 *e, const dqw_estimator_q15_block *b)
{
    dqw_segment_q15 *s = &e->segment;
    if (s->blocks == 0) {
        e->residual.began_before = e->residual.began;
        e->residual.began = e->number;
    }
    if (!dqw_estimator_segment_ends_q15(e, b)) return;
    // Up to 2^37 by 2^16
    const int64_t seconds_q20 = dqw_q_quotient64(block_ns(e) * s->blocks, 1000000000, 20);
    const int64_t rows = 2 * (int64_t)s->blocks;
    // [FOL.3] what lasts while nothing seems to change
    const dqw_lasting_q15 calm = keep_calm(e);
    // [FOL.4] what the segment says, of bands that are no narrower than this and may be as wide as that
    dqw_segment_q15_known known;
    int32_t move_q24[N];
    for (int i = 0; i < N; i++) {
        int32_t hidden = dqw_estimator_is_apart_q15(e, i) ? 0 : dqw_estimator_model_q28(e, i, &calm);
        if (hidden != INT32_MAX) hidden = dqw_q_floor32(hidden, dqw_estimator_shift_q15(e, i));
        known.least_q28[i] = least_q28(e, i);
        const int32_t wide = wide_q28(e, i);
        known.wide_q28[i] = dqw_estimator_observer_hides_q15(e, i) ? 0 : wide;
        known.model_q28[i] = hidden < wide ? hidden : wide;
    }
    // [FOL.5] who is moved by how much later on; and what has changed now
    const int changed = dqw_segment_end_q15(s, calm.all_q56, &known, move_q24);
    for (int i = 0; i < N; i++) stay_awake(e, i, seconds_q20, rows, calm.all_q56);
    if (s->since < UINT16_MAX) s->since++;
    if (changed >= 0) open(e, changed, &calm, known.wide_q28, move_q24);
}
