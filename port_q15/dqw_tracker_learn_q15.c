// What the tracker does in the background: learn a block, and say what was learned.
#include <stddef.h>

#include "dqw_q15.h"
#include "dqw_tracker_q15.h"
#include "dqw_tracker_rows_q15.h"

// A weight whose variance fell by less than a hundredth was not learned.
#define LEARNED_COV_Q40 ((int64_t)900 << 40)
// A smaller residual is the sampling's own, and rounding: 1e-8.
#define VARIANCE_FLOOR_Q56 720575940
// Blocks over which statistics are means.
#define MEMORY 1000u
#define FEW_BLOCKS 50u
#define LAG_MAX_Q20 1027604
#define LAG_MIN_Q20 (-419430)
#define ONE_Q20 1048576
// Rows that only measure the noise and its share.
#define WARM_UP 2000u
// An input whose power is not three times its noise teaches nothing; noise alone would need ten deviations.
#define NOISE_MARGIN 3
// A mean over 32 blocks, in which a strong one counts as so many weak ones, so that a drive that stops is soon seen to have stopped.
#define EXCESS_BLOCKS 32
#define EXCESS_MAX 8
// Where noise is more than this part of all that was learned of a weight, taking it out could run away: 0.05.
#define NOISE_PART_MAX_Q40 54975581389
// A weight of so many nominal values is no machine's: 64.
#define WEIGHT_MAX_Q24 1073741824
// An inductance below this part of the nominal one is not believed: 0.1.
#define LEAST_L_Q24 1677722
// Currents are followed so fast that the noise left is about as wide as the step that dead time makes of them: 0.7.
#define FOLLOW_Q15 22938
// Weights are solved at every block while they are young, then every so many; variances grow no more often.
#define YOUNG_BLOCKS 64u
#define SOLVE_BLOCKS 4u
#define REST_HALVES 16u
// An axis weighs up to 8 times what the other does.
#define WEIGH_MAX_Q24 134217728
// What the sums can hold of a variance: 2^21 of the residual's.
#define WIDEST_Q40 ((int64_t)1 << 61)
#define ONE_Q15 32768

enum { D = 0, Q = 1, N = DQW_TRACK_Q15_WEIGHTS };

int32_t dqw_tracker_value_q15(const dqw_tracker_q15 *t, enum dqw_tracker_weight_q15 weight)
{
    return (unsigned)weight < N ? t->w_q24[weight] : INT32_MAX;
}

uint32_t dqw_tracker_unit_q15(const dqw_tracker_q15_config *config, enum dqw_tracker_weight_q15 weight)
{
    switch (weight) {
    case DQW_TRACK_R_Q15: return config->R_uohm;
    case DQW_TRACK_LD_Q15: return config->Ld_nH;
    case DQW_TRACK_LQ_Q15: return config->Lq_nH;
    case DQW_TRACK_PSI_Q15:
    case DQW_TRACK_PSI_Q_Q15: return config->psi_nWb;
    case DQW_TRACK_DEAD_TIME_Q15: return config->scale.v_full_mV * 100u / DQW_TRACK_Q15_DEAD_PARTS * 10u;
    default: return 0;
    }
}

static int64_t variance_q56(const dqw_tracker_q15 *t, int axis)
{
    return t->error_q56[axis] > VARIANCE_FLOOR_Q56 ? t->error_q56[axis] : VARIANCE_FLOOR_Q56;
}

static int64_t common_variance_q56(const dqw_tracker_q15 *t)
{
    return dqw_q_floor64(variance_q56(t, D) + variance_q56(t, Q), 1);
}

// Blocks overlap by half, so that next ones are alike, or unlike, in what they teach a weight: that widens or narrows its deviation. Dead
// time goes with the current as R does, the flux on the other axis with the speed as the flux. (E61)
static int64_t inflation_q20(const dqw_tracker_q15 *t, int i)
{
    const int like = i == DQW_TRACK_DEAD_TIME_Q15 ? DQW_TRACK_R_Q15 : i == DQW_TRACK_PSI_Q_Q15 ? DQW_TRACK_PSI_Q15 : i;
    if (t->score2_q68[like] <= 0) return ONE_Q20;
    const int64_t r_q20 = dqw_q_quotient64(t->score_lag_q68[like], t->score2_q68[like], 20);
    return ONE_Q20 + 2 * (r_q20 < LAG_MIN_Q20 ? LAG_MIN_Q20 : r_q20 > LAG_MAX_Q20 ? LAG_MAX_Q20 : r_q20);
}

int32_t dqw_tracker_sd_q15(const dqw_tracker_q15 *t, enum dqw_tracker_weight_q15 weight)
{
    if ((unsigned)weight >= N) return INT32_MAX;
    const int i = (int)weight;
    if (((uint32_t)t->learned >> i & 1u) == 0 || t->blocks < 2u * N) return INT32_MAX;
    const int64_t v_q56 = dqw_q_product64(dqw_q_product64(t->cov_q40[i], common_variance_q56(t), -40), inflation_q20(t, i), -20);
    // The root of 2^62 at most, Q28
    return dqw_q_floor32((int32_t)dqw_q_root64((uint64_t)v_q56 >> 2), 3);
}

uint32_t dqw_tracker_residual_q28(const dqw_tracker_q15 *t)
{
    return dqw_q_root64((uint64_t)(t->error_q56[D] + t->error_q56[Q]));
}

// m moves to x by a part, the difference below 2^63.
static void toward(int64_t *m, int64_t x, int64_t part_q31)
{
    *m += dqw_q_product64(x - *m, part_q31, -31);
}

static int64_t part_of(const dqw_tracker_q15 *t)
{
    return (int64_t)((1u << 31) / (t->blocks < MEMORY ? t->blocks : MEMORY));
}

// One axis' row to the sums, around the weights as solved last; weighed by how little of that axis is noise.
static int32_t show(dqw_tracker_q15 *t, int axis, const dqw_tracker_rows_q15 *r, uint32_t mask, int64_t weigh_q24)
{
    int32_t x_q28[N];
    int64_t e_q28 = r->y_q28[axis];
    for (int i = 0; i < N; i++) {
        const int32_t x = r->x_q28[axis][i];
        e_q28 -= dqw_q_round64((int64_t)x * t->w_q24[i], 24);
        x_q28[i] = (mask >> i & 1u) != 0 ? dqw_q31_sat(dqw_q_round64(x * weigh_q24, 24)) : 0;
    }
    const int32_t e = dqw_q31_sat(e_q28);
    dqw_normal_add_q15(&t->normal, x_q28, dqw_q31_sat(dqw_q_round64(e * weigh_q24, 24)));
    return e;
}

// Noise of the inputs turns the gradient by C w: put back. Not where it is much of what was learned, there it could run away. (E60)
static void take_noise_out(dqw_tracker_q15 *t, const dqw_tracker_rows_q15 *r, const int64_t by_q24[2], const uint32_t mask[2])
{
    int64_t z_q56[N] = {0};
    for (int axis = 0; axis < 2; axis++)
        for (int i = 0; i < N; i++)
            if ((mask[axis] >> i & 1u) != 0) z_q56[i] += dqw_q_product64(r->var_q56[axis][i], by_q24[axis], -24);
    for (int i = 0; i < N; i++) {
        if (dqw_q_product64(z_q56[i], t->cov_q40[i], -56) > NOISE_PART_MAX_Q40) return;
        z_q56[i] = dqw_q_product64(z_q56[i], t->w_q24[i], -24);
    }
    for (int axis = 0; axis < 2; axis++) {
        const int L = DQW_TRACK_LQ_Q15 - axis;
        const int flux = axis == Q ? DQW_TRACK_PSI_Q15 : DQW_TRACK_PSI_Q_Q15;
        const int64_t by = by_q24[axis];
        z_q56[DQW_TRACK_R_Q15] += dqw_q_product64(dqw_q_product64(r->dead_in_R_q56[axis], by, -24), t->w_q24[DQW_TRACK_DEAD_TIME_Q15], -24);
        z_q56[DQW_TRACK_DEAD_TIME_Q15] += dqw_q_product64(dqw_q_product64(r->R_in_dead_q56[axis], by, -24), t->w_q24[DQW_TRACK_R_Q15], -24);
        if ((mask[axis] >> L & mask[axis] >> flux & 1u) == 0) continue;
        const int64_t shared = dqw_q_product64(r->speed_q56[axis], by, -24);
        z_q56[L] += dqw_q_product64(shared, t->w_q24[flux], -24);
        z_q56[flux] += dqw_q_product64(shared, t->w_q24[L], -24);
    }
    for (int i = 0; i < N; i++) {
        // The target's sum keeps above what the gradient explains.
        const int64_t z_q32 = dqw_q_scale64(z_q56[i], -24);
        t->normal.b_q32[i] += z_q32;
        const int64_t more_q32 = dqw_q_product64(z_q32, t->w_q24[i], -24);
        t->normal.c_q32 += more_q32 < 0 ? -more_q32 : more_q32;
    }
}

// A parameter may wander: its variance grows with time, here in halves of a window, up to where it started. (E61)
static void drift(dqw_tracker_q15 *t)
{
    const uint32_t elapsed = t->halves - t->drifted;
    t->drifted += elapsed;
    const dqw_tracker_q15_config *c = t->config;
    if (c->drift_ppm == 0) return;
    const int64_t common_q56 = common_variance_q56(t);
    // Nine nominal values squared, over the residual's variance: where it started.
    const int64_t started_q6 = dqw_q_quotient64(9, common_q56, 62);
    const int64_t cap_q40 = started_q6 < WIDEST_Q40 >> 34 ? started_q6 * ((int64_t)1 << 34) : WIDEST_Q40;
    // ns up to 2^30 by halves up to 2^7; ppm^2 up to 2^40
    const int64_t time_ns = dqw_q_product64((int64_t)c->scale.dt_ns * t->window.half, elapsed, 0);
    const int64_t wander_q40 = dqw_q_product64(dqw_q_quotient64((int64_t)c->drift_ppm * c->drift_ppm, 1000000000000, 40),
                                               dqw_q_quotient64(time_ns, 1000000000, 20), -20);
    int64_t q_q40 = dqw_q_quotient64(wander_q40, common_q56, 56);
    if (q_q40 > cap_q40) q_q40 = cap_q40;
    for (int i = 0; i < N; i++) {
        if (t->cov_q40[i] >= cap_q40) continue;
        dqw_normal_grow_q15(&t->normal, i, q_q40);
        t->cov_q40[i] += q_q40;
    }
}

// Inputs large enough to teach their weight, by their power above the noise: a choice by the mean and not by the block, which would bias.
static void choose(dqw_tracker_q15 *t, const dqw_tracker_rows_q15 *r, uint32_t mask[2])
{
    mask[D] = mask[Q] = 0;
    for (int i = 0; i < N; i++) {
        const int64_t least_q56 = NOISE_MARGIN * (r->var_q56[D][i] + r->var_q56[Q][i]) + r->least_q56[i];
        // Up to 2^61
        const int64_t power_q56 = dqw_q_round64((int64_t)r->x_q28[D][i] * r->x_q28[D][i], 2) + dqw_q_round64((int64_t)r->x_q28[Q][i] * r->x_q28[Q][i], 2);
        const int64_t ratio_q10 = dqw_q_quotient64(power_q56, least_q56, 12);
        const int32_t excess_q10 = (int32_t)(ratio_q10 < EXCESS_MAX * 1024 ? ratio_q10 : EXCESS_MAX * 1024) - 1024;
        t->excess_q10[i] = (int16_t)(((EXCESS_BLOCKS - 1) * t->excess_q10[i] + excess_q10) / EXCESS_BLOCKS);
        if (t->excess_q10[i] <= 0) continue;
        if (r->x_q28[D][i] != 0) mask[D] |= 1u << i;
        if (r->x_q28[Q][i] != 0) mask[Q] |= 1u << i;
    }
    // There the other weights would take up what is wrong with the shape.
    if (t->width3_q28 > 0 && t->excess_q10[DQW_TRACK_R_Q15] <= 0) mask[D] = mask[Q] = 0;
}

// What has left all bounds begins again; what was learned for the first time is noted.
static bool sound(dqw_tracker_q15 *t)
{
    for (int i = 0; i < N; i++) {
        if (t->w_q24[i] >= WEIGHT_MAX_Q24 || t->w_q24[i] <= -WEIGHT_MAX_Q24) {
            dqw_tracker_start_q15(t);
            if (t->restarts < UINT8_MAX) t->restarts++;
            return false;
        }
        if (t->cov_q40[i] < LEARNED_COV_Q40) t->learned |= (uint8_t)(1u << i);
    }
    return true;
}

// What the interrupt takes of the voltage's part in a step: from no L that could not be the machine's.
static void publish(dqw_tracker_q15 *t)
{
    dqw_tracker_nominal_q15 n;
    (void)dqw_tracker_nominal_of_q15(t->config, &n);
    for (int axis = 0; axis < 2; axis++) {
        const int32_t w_q24 = t->w_q24[DQW_TRACK_LD_Q15 + axis];
        if (w_q24 > LEAST_L_Q24) t->step_q15[axis] = dqw_q15_sat(dqw_q31_sat(dqw_q_quotient64(dqw_q_quotient64((int64_t)1 << 40, n.L_q40[axis], 24), w_q24, 15)));
    }
}

// Weights that explain all that was shown; the sums go on around them.
static void solve(dqw_tracker_q15 *t)
{
    static const int64_t stay_q40[N] = {0};
    dqw_solution_q15 s;
    // With noise taken out, the gradient may explain more than there was; twice is enough.
    t->normal.c_q32 = 2 * t->normal.c_q32 + 16;
    dqw_normal_solve_q15(&t->normal, stay_q40, &s);
    for (int i = 0; i < N; i++) {
        t->w_q24[i] = dqw_q31_sat(t->w_q24[i] + dqw_q_round64(s.w_q40[i], 16));
        t->cov_q40[i] = s.cov_q40[i] < WIDEST_Q40 ? s.cov_q40[i] : WIDEST_Q40;
        t->normal.b_q32[i] = 0;
    }
    t->normal.c_q32 = 0;
}

// Residuals, before the correction and after it, and what the block taught.
static void keep(dqw_tracker_q15 *t, const dqw_tracker_rows_q15 *r, const uint32_t mask[2], const int64_t by_q24[2], const int32_t before_q24[])
{
    const int64_t part_q31 = part_of(t);
    int32_t after_q28[2];
    for (int axis = 0; axis < 2; axis++) {
        int64_t after = t->e_q28[axis];
        for (int i = 0; i < N; i++)
            if ((mask[axis] >> i & 1u) != 0) after -= dqw_q_product64(r->x_q28[axis][i], (int64_t)t->w_q24[i] - before_q24[i], -24);
        after_q28[axis] = dqw_q31_sat(after);
        toward(&t->error_q56[axis], (int64_t)t->e_q28[axis] * after_q28[axis], part_q31);
    }
    for (int i = 0; i < DQW_TRACK_Q15_SCORES; i++) {
        int64_t score_q34 = 0;
        for (int axis = 0; axis < 2; axis++)
            if ((mask[axis] >> i & 1u) != 0)
                score_q34 += dqw_q_product64((int64_t)r->x_q28[axis][i] * after_q28[axis], by_q24[axis], -46);
        const int32_t score = dqw_q31_sat(score_q34);
        toward(&t->score2_q68[i], (int64_t)score * score, part_q31);
        toward(&t->score_lag_q68[i], (int64_t)score * t->score_last_q34[i], part_q31);
        t->score_last_q34[i] = score;
    }
}

bool dqw_tracker_waits_q15(const dqw_tracker_q15 *t)
{
    return *(const volatile bool *)&t->pending;
}

void dqw_tracker_release_q15(dqw_tracker_q15 *t)
{
    *(volatile bool *)&t->pending = false;
}

bool dqw_tracker_learn_q15(dqw_tracker_q15 *t)
{
    if (!dqw_tracker_waits_q15(t)) return false;
    const bool learned = dqw_tracker_learn_held_q15(t);
    dqw_tracker_release_q15(t);
    return learned;
}

// How fast dead time's input follows the currents: the slower, the noisier they are.
static void set_follow(dqw_tracker_q15 *t)
{
    if (t->width3_q28 == 0) return;
    const uint16_t rows = *(const volatile uint16_t *)&t->noise.rows;
    const int64_t both_q36 = dqw_q_floor64((int64_t)t->means.i_d_q36 + t->means.i_q_q36, 1);
    const int64_t sd_q18 = dqw_q_root64((uint64_t)dqw_noise_variance_q36(dqw_q31_sat(both_q36), rows, -2));
    const int64_t width_q28 = t->width3_q28 / 3;
    t->follow_q15 = (uint16_t)dqw_q_quotient64(width_q28, width_q28 + dqw_q_floor64(sd_q18 * 1024 * FOLLOW_Q15, 15), 15);
}

bool dqw_tracker_learn_held_q15(dqw_tracker_q15 *t)
{
    t->at = *(const volatile uint32_t *)&t->halves;

    // [TRK.4] inputs of both axes
    dqw_tracker_rows_q15 r;
    dqw_tracker_rows_of_q15(t, &r);
    set_follow(t);

    // [TRK.5] what can be learned from this block; its signals are within ten bases, the gate saw to that
    uint32_t mask[2];
    choose(t, &r, mask);
    if ((mask[D] | mask[Q]) == 0 || *(const volatile uint16_t *)&t->noise.rows < WARM_UP) {
        if (t->at - t->drifted >= REST_HALVES) drift(t);
        return false;
    }
    if (t->gate.blocks < UINT32_MAX) t->gate.blocks++;
    if (t->blocks < UINT16_MAX) t->blocks++;

    // [TRK.6] both rows, then the noise of their inputs, then what may have drifted
    int64_t by_q24[2];
    for (int axis = 0; axis < 2; axis++) {
        const int64_t by = t->blocks > FEW_BLOCKS ? dqw_q_quotient64(common_variance_q56(t), variance_q56(t, axis), 24) : 1 << 24;
        const int64_t weigh_q24 = (int64_t)dqw_q_root64((uint64_t)dqw_q_scale64(by, 24));
        const int64_t bounded_q24 = weigh_q24 < WEIGH_MAX_Q24 ? weigh_q24 : WEIGH_MAX_Q24;
        by_q24[axis] = dqw_q_floor64(bounded_q24 * bounded_q24, 24);
        t->e_q28[axis] = show(t, axis, &r, mask[axis], bounded_q24);
    }
    if (t->config->noise_on_inputs) take_noise_out(t, &r, by_q24, mask);
    int32_t before_q24[N];
    for (int i = 0; i < N; i++) before_q24[i] = t->w_q24[i];
    const bool time = t->blocks <= YOUNG_BLOCKS || t->gate.blocks % SOLVE_BLOCKS == 0;
    if (time) solve(t);
    keep(t, &r, mask, by_q24, before_q24);
    if (!sound(t)) return false;
    if (!time) return true;
    publish(t);
    drift(t);
    return true;
}
