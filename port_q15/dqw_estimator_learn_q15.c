// What the tracker does in the background: choose what a block can teach, learn it, keep the statistics.
#include <stddef.h>

#include "dqw_q15.h"
#include "dqw_tracker_q15.h"
#include "dqw_tracker_rows_q15.h"

// A weight whose variance fell by less than a hundredth was not learned.
#define LEARNED_COV_Q40 ((int64_t)900 << 40)
// Blocks over which statistics are means.
#define MEMORY 1000u
#define FEW_BLOCKS 50u
// Rows that only measure the noise and its share.
#define WARM_UP 2000u
// An input whose power is not three times its noise teaches nothing; noise alone would need ten deviations.
#define NOISE_MARGIN 3
// A mean over 32 blocks, in which a strong one counts as so many weak ones, so that a drive that stops is soon seen to have stopped.
#define EXCESS_BLOCKS 32
#define EXCESS_MAX_Q10 8192
// A weight of so many nominal values is no machine's: 64.
#define WEIGHT_MAX_Q24 1073741824
// An inductance below this part of the nominal one is not believed: 0.1.
#define LEAST_L_Q24 1677722
// Currents are followed so fast that the noise left is about as wide as the step that dead time makes of them: 0.7.
#define FOLLOW_Q15 22938
// Weights are solved at every block while they are young, then every so many.
#define YOUNG_BLOCKS 64u
#define SOLVE_BLOCKS 4u
// An axis weighs up to 8 times what the other does.
#define WEIGH_MAX_Q24 134217728
#define ONE_Q15 32768

enum { D = 0, Q = 1, N = DQW_TRACK_Q15_WEIGHTS };

// m moves to x by a part, the difference below 2^63.
static void toward(int64_t *m, int64_t x, int64_t part_q31)
{
    *m += dqw_q_product64(x - *m, part_q31, -31);
}

static uint32_t memory_of(const dqw_tracker_q15 *t)
{
    return t->blocks < MEMORY ? t->blocks : MEMORY;
}

static uint32_t every(const dqw_tracker_q15 *t)
{
    return t->blocks <= YOUNG_BLOCKS ? 1u : t->config->solve_blocks != 0 ? t->config->solve_blocks : SOLVE_BLOCKS;
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
        const int32_t excess_q10 = (int32_t)(ratio_q10 < EXCESS_MAX_Q10 ? ratio_q10 : EXCESS_MAX_Q10) - 1024;
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
        if (w_q24 > LEAST_L_Q24)
            t->step_q15[axis] = dqw_q15_sat(dqw_q31_sat(dqw_q_quotient64(dqw_q_quotient64((int64_t)1 << 40, n.L_q40[axis], 24), w_q24, 15)));
    }
}

// Residuals, before the correction and after it: their product has the residual's variance as mean, where the weights were solved. And what the
// block taught.
static void keep(dqw_tracker_q15 *t, const dqw_tracker_rows_q15 *r, const uint32_t mask[2], const int64_t by_q24[2], const int32_t before_q24[], bool solved)
{
    const int64_t part_q31 = (int64_t)((1u << 31) / memory_of(t));
    const uint32_t looks = memory_of(t) / every(t);
    const int64_t part_error_q31 = (int64_t)((1u << 31) / (looks != 0 ? looks : 1u));
    int32_t after_q28[2];
    for (int axis = 0; axis < 2; axis++) {
        int64_t after = t->e_q28[axis];
        for (int i = 0; i < N; i++)
            if ((mask[axis] >> i & 1u) != 0) after -= dqw_q_product64(r->x_q28[axis][i], (int64_t)t->w_q24[i] - before_q24[i], -24);
        after_q28[axis] = dqw_q31_sat(after);
        if (solved) toward(&t->error_q56[axis], (int64_t)t->e_q28[axis] * after_q28[axis], part_error_q31);
    }
    for (int i = 0; i < DQW_TRACK_Q15_SCORES; i++) {
        int64_t score_q34 = 0;
        for (int axis = 0; axis < 2; axis++)
            if ((mask[axis] >> i & 1u) != 0) score_q34 += dqw_q_product64((int64_t)r->x_q28[axis][i] * after_q28[axis], by_q24[axis], -46);
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
    // cppcheck-suppress uninitvar; every element is set
    dqw_tracker_rows_q15 r;
    dqw_tracker_rows_of_q15(t, &r);
    set_follow(t);

    // [TRK.5] what can be learned from this block; its signals are within ten bases, the gate saw to that
    uint32_t mask[2];
    choose(t, &r, mask);
    if ((mask[D] | mask[Q]) == 0 || *(const volatile uint16_t *)&t->noise.rows < WARM_UP) {
        dqw_tracker_drift_q15(t);
        return false;
    }
    if (t->gate.blocks < UINT32_MAX) t->gate.blocks++;
    if (t->blocks < UINT16_MAX) t->blocks++;

    // [TRK.6] both rows, then the noise of their inputs, then what may have drifted
    int64_t by_q24[2];
    for (int axis = 0; axis < 2; axis++) {
        const int64_t by = t->blocks > FEW_BLOCKS ? dqw_q_quotient64(dqw_tracker_common_variance_q56(t), dqw_tracker_variance_q56(t, axis), 24) : 1 << 24;
        const int64_t weigh_q24 = (int64_t)dqw_q_root64((uint64_t)dqw_q_scale64(by, 24));
        const int64_t bounded_q24 = weigh_q24 < WEIGH_MAX_Q24 ? weigh_q24 : WEIGH_MAX_Q24;
        by_q24[axis] = dqw_q_floor64(bounded_q24 * bounded_q24, 24);
        t->e_q28[axis] = dqw_tracker_show_q15(t, axis, &r, mask[axis], bounded_q24);
    }
    if (t->config->noise_on_inputs) dqw_tracker_take_noise_out_q15(t, &r, by_q24, mask);
    int32_t before_q24[N];
    for (int i = 0; i < N; i++) before_q24[i] = t->w_q24[i];
    const bool solved = t->gate.blocks % every(t) == 0;
    if (solved) dqw_tracker_solve_q15(t);
    keep(t, &r, mask, by_q24, before_q24, solved);
    if (!sound(t)) return false;
    if (solved) publish(t);
    dqw_tracker_drift_q15(t);
    return true;
}
