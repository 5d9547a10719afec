// What the estimator does in the background: choose what a block can teach, learn it, keep the statistics.
#include <stddef.h>

#include "dqw_estimator_block_q15.h"
#include "dqw_estimator_random_q15.h"
#include "dqw_q15.h"

#define EXCITATION_Q15 328
#define EXCITATION_SETTLED_Q15 66
// R needs currents of so many of dead time's widths, squared.
#define STEP_MARGIN 16
// A weight whose variance fell by less than a hundredth was not learned.
#define LEARNED_PARTS 100
// Blocks over which statistics are means.
#define MEMORY 1000u
#define RECENT_BITS 6
#define FEW_BLOCKS 50u
// Blocks of stage 2 without lent memory.
#define COARSE_BLOCKS 50u
// An input whose power is not three times its noise teaches nothing; noise alone would need ten deviations.
#define NOISE_MARGIN 3
// Nor does an inductance's on one axis whose power there is not twice its noise there.
#define OWN_MARGIN 2
// From here on a loop answers all, to 0.1 %.
#define ANSWERED_MOST_Q10 1024000
// A mean over 32 blocks, in which a strong one counts as so many weak ones, so that a drive that stops is soon seen to
// have stopped.
#define EXCESS_BLOCKS 32
#define EXCESS_MAX_Q10 8192
// A weight of so many units is no machine's: 64.
#define WEIGHT_MAX_Q24 1073741824
// An inductance is handed to the interrupt where its deviation is below this part of it.
#define PUBLISHED_PARTS 5
// Currents are followed the later, the wider their noise is beside the step that dead time makes of them: by this many
// periods, 0.35, where what is lost of fast ones near that step is as much as noise would take. And no later than so.
// (E60)
#define LATE_Q15 11469
#define LATE_MOST 2
// Weights are solved at every block while they are young, then every so many.
#define YOUNG_BLOCKS 64u
#define SOLVE_BLOCKS 4u
// An axis weighs up to 8 times what the other does.
#define WEIGH_MAX_Q24 134217728
#define ONE_Q24 16777216

enum { D = 0, Q = 1, SCORES = DQW_ESTIMATOR_Q15_SCORES };

// m moves to x by a part, the difference below 2^63.
static void toward(int64_t *m, int64_t x, int32_t part_q30)
{
    *m += dqw_q_times64(x - *m, part_q30, -30);
}

static uint32_t every(const dqw_estimator_q15 *e)
{
    return e->blocks <= YOUNG_BLOCKS ? 1u : e->config->solve_blocks != 0 ? e->config->solve_blocks : SOLVE_BLOCKS;
}

// Are the weights solved at this block? A count that is full counts no further.
static bool is_due(const dqw_estimator_q15 *e)
{
    return e->gate.blocks == UINT32_MAX || e->gate.blocks % every(e) == 0;
}

static int64_t square_q56(int64_t x_q40)
{
    return dqw_q_product64(x_q40, x_q40, -24);
}

// Up to 2^60
static int64_t power_q54(int32_t x_q28)
{
    return (int64_t)x_q28 * x_q28 >> 2;
}

// A mean power above the least that teaches, over that.
static int16_t toward_excess(int16_t excess_q10, int64_t power_q54, int64_t least_q56)
{
    const int64_t ratio_q10 = dqw_q_quotient64(power_q54, least_q56, 12);
    const int32_t now_q10 = (int32_t)(ratio_q10 < EXCESS_MAX_Q10 ? ratio_q10 : EXCESS_MAX_Q10) - 1024;
    return (int16_t)(((EXCESS_BLOCKS - 1) * excess_q10 + now_q10) / EXCESS_BLOCKS);
}

// Noise alone in an inductance's slope is no slope, however much the other axis says; and that axis says it also where
// it is little, or the flux would take it.
static void choose_inductances(dqw_estimator_q15 *e, const dqw_rows_q15 *r, uint32_t mask[2])
{
    for (int axis = 0; axis < 2; axis++) {
        const int cross = dqw_estimator_cross_q15(e, axis);
        const bool flux = (mask[axis] >> (axis == Q ? DQW_PSI : DQW_PSI_Q) & 1u) != 0;
        for (int L = DQW_LD; L <= DQW_LQ; L++) {
            const int32_t x_q28 = r->x_q28[axis][L];
            int16_t *above = &e->above_q10[L - DQW_LD][axis];
            *above = toward_excess(*above, power_q54(x_q28), OWN_MARGIN * r->noise_q56[axis][L] + 1);
            if (*above <= 0)
                mask[axis] &= ~(1u << L);
            else if (L == cross && flux && x_q28 != 0)
                mask[axis] |= 1u << L;
        }
    }
}

// Inputs large enough to teach their weight, by their power above the noise: a choice by the mean and not by the block,
// which would bias. A settled row stands for itself.
static void choose(dqw_estimator_q15 *e, const dqw_rows_q15 *r, uint32_t mask[2])
{
    const dqw_estimator_q15_config *c = e->config;
    const int32_t usual_q15 = c->settled ? EXCITATION_SETTLED_Q15 : EXCITATION_Q15;
    const int32_t part_q15 = c->excitation_q15 != 0 ? c->excitation_q15 : usual_q15;
    const bool dead_time = dqw_estimator_has_dead_time_q15(e);
    const dqw_units_q15 *u = &r->unit;
    mask[D] = mask[Q] = 0;
    for (int i = 0; i < dqw_estimator_inputs_q15(e); i++) {
        const int32_t x_q28[] = {r->x_q28[D][i], r->x_q28[Q][i]};
        const int64_t least_q40 = dqw_q_times64(dqw_estimator_whole_q40(e, u, i), part_q15, -15);
        int64_t each_q28 = 1;
        if (c->settled) {
            each_q28 += dqw_q_floor64(least_q40 - 1, 12);
        } else {
            int64_t least_q56 = square_q56(least_q40);
            if (i < DQW_PARAMETERS) least_q56 += NOISE_MARGIN * (r->noise_q56[D][i] + r->noise_q56[Q][i]);
            // Among currents as small as dead time's step, its shape decides what is left for R.
            if (i == DQW_R && dead_time) {
                // Of 1.4 full voltages nobody learns R.
                const int64_t step2_q56 = square_q56(dqw_q_product64(u->R_q40, u->width_q40, -40));
                least_q56 += STEP_MARGIN * (step2_q56 < (int64_t)1 << 57 ? step2_q56 : (int64_t)1 << 57);
            }
            e->excess_q10[i] = toward_excess(e->excess_q10[i], power_q54(x_q28[D]) + power_q54(x_q28[Q]), least_q56);
            if (e->excess_q10[i] <= 0) continue;
        }
        for (int axis = 0; axis < 2; axis++)
            if (dqw_q_size64(x_q28[axis]) >= each_q28) mask[axis] |= 1u << i;
    }
    if (!c->settled) choose_inductances(e, r, mask);
    // There the other weights would take up what is wrong with dead time's shape.
    if (!c->settled && dead_time && e->excess_q10[DQW_R] <= 0) mask[D] = mask[Q] = 0;
}

static bool sound(dqw_estimator_q15 *e, const dqw_units_q15 *u)
{
    for (int i = 0; i < dqw_estimator_inputs_q15(e); i++) {
        if (e->w_q24[i] >= WEIGHT_MAX_Q24 || e->w_q24[i] <= -WEIGHT_MAX_Q24) {
            dqw_estimator_start_q15(e, NULL);
            if (e->restarts < UINT8_MAX) e->restarts++;
            return false;
        }
        if ((e->learned >> i & 1u) == 0 &&
            e->cov_q40[i] < dqw_q_quotient64(dqw_estimator_start_cov_q40(e, u, i), LEARNED_PARTS, 0))
            e->learned |= 1u << i;
    }
    return true;
}

// What the interrupt takes: the voltage's part in a step, from an L that is known, and how fast dead time's input
// follows the currents: the slower, the noisier they are.
static void publish(dqw_estimator_q15 *e, const dqw_estimator_q15_block *b, const dqw_units_q15 *u)
{
    volatile dqw_estimator_q15_given *g = &e->given;
    const bool waits = *(volatile bool *)&e->given.ready;
    *(volatile bool *)&e->given.ready = false;
    bool noise_anew = waits && g->noise_anew;
    for (int axis = 0; axis < 2; axis++) {
        const int32_t w_q24 = e->w_q24[DQW_LD + axis];
        if ((int64_t)dqw_estimator_noise_sd_q24(e, DQW_LD + axis) * PUBLISHED_PARTS >= w_q24) continue;
        const int64_t L_q40 = dqw_q_times64(u->L_q40[axis], w_q24, -24);
        const int32_t step = dqw_q15_sat(dqw_q31_sat(dqw_q_quotient64((int64_t)1 << 40, L_q40, 15)));
        const int32_t last = g->step_q15[axis];
        // By a quarter, either way: then the noise was measured with a wrong one.
        if (4 * step > 5 * last || 4 * last > 5 * step) noise_anew = true;
        g->step_q15[axis] = (int16_t)step;
    }
    if (e->wide_q28 > 0) {
        const int64_t both_q30 = b->with.noise_q30[DQW_NOISE_ID_Q15] + b->with.noise_q30[DQW_NOISE_IQ_Q15];
        const int64_t sd_q18 = dqw_q_root64((uint64_t)dqw_noise_variance_q36(both_q30, b->with.rows, -4));
        const int64_t width_q28 = dqw_q_floor64(u->width_q40, 12);
        const int64_t late_q28 = dqw_q_times64(sd_q18, LATE_Q15, -5);
        const int64_t bounded_q28 = late_q28 < LATE_MOST * width_q28 ? late_q28 : LATE_MOST * width_q28;
        g->follow_q15 = (uint16_t)dqw_q_quotient64(width_q28, width_q28 + bounded_q28, 15);
        g->lead_q12 = (uint16_t)dqw_q_quotient64(bounded_q28, width_q28, 13);
    }
    g->noise_anew = noise_anew;
    *(volatile bool *)&e->given.ready = true;
}

// Residuals, before the correction and after it: their product has the residual's variance as mean, where the weights
// were solved. And what the block taught.
static void keep(dqw_estimator_q15 *e, const dqw_rows_q15 *r, const uint32_t mask[2], const int64_t by_q24[2],
                 bool solved)
{
    const uint32_t looks = e->blocks / every(e);
    const int32_t part = dqw_mean_part_q30(e, e->blocks, 1, MEMORY);
    const int32_t part_error = dqw_mean_part_q30(e, looks != 0 ? looks : 1u, 1, MEMORY / every(e));
    int64_t e2_q54 = 0;
    int32_t after_q28[2];
    for (int axis = 0; axis < 2; axis++) {
        const int32_t before = e->e_q28[axis];
        after_q28[axis] = dqw_estimator_error_q28(e, axis, r);
        if (solved) toward(&e->error_q56[axis], (int64_t)before * after_q28[axis], part_error);
        e2_q54 += dqw_q_floor64((int64_t)before * before, 2);
    }
    e->recent_q54 += dqw_q_round64(e2_q54 - e->recent_q54, RECENT_BITS);
    for (int k = 0; k < dqw_estimator_inputs_q15(e) - DQW_PARAMETERS + 4; k++) {
        const int i = k < 4 ? k : DQW_PARAMETERS + k - 4;
        int64_t score_q34 = 0;
        for (int axis = 0; axis < 2; axis++)
            if ((mask[axis] >> i & 1u) != 0)
                score_q34 += dqw_q_product64((int64_t)r->x_q28[axis][i] * after_q28[axis], by_q24[axis], -46);
        const int32_t score = dqw_q31_sat(score_q34);
        toward(&e->score2_q68[k], (int64_t)score * score, part);
        toward(&e->score_lag_q68[k], (int64_t)score * e->score_last_q34[k], part);
        e->score_last_q34[k] = score;
    }
}

// Of noise in a slope over a block of h pairs a first-order loop of so much of a period answers a part. (E189)
static void keep_answered(dqw_estimator_q15 *e, const dqw_estimator_q15_block *b)
{
    // Three variances of the rows that look: -2/3 of what the sum of minus two of all rows is, times half over those.
    const int64_t half = e->window.half;
    const int64_t looks = dqw_noise_looks_q15((uint32_t)half);
    const int64_t noise_q30 = -b->with.noise_q30[DQW_NOISE_ID_Q15];
    if (noise_q30 <= 0 || looks == 0) return;
    const int64_t answer_q30 = dqw_q_size64(b->with.answer_q30);
    const int64_t a_q10 = dqw_q_product64(dqw_q_quotient64(2 * half * answer_q30, 3 * looks * noise_q30, 20), half,
                                          -10);
    const int64_t bounded_q10 = a_q10 < ANSWERED_MOST_Q10 ? a_q10 : ANSWERED_MOST_Q10;
    const int64_t square_q20 = bounded_q10 * bounded_q10;
    e->answered_q15 = (uint16_t)dqw_q_quotient64(square_q20, (3 << 20) + 1536 * bounded_q10 + square_q20, 15);
}

void dqw_estimator_stage_on_q15(dqw_estimator_q15 *e, bool random_converged)
{
    // What is still to be found is not judged by what it leaves.
    if (e->stage.name == DQW_STAGE_ORDINAL && dqw_estimator_seeks_legs_q15(e)) return;
    (void)dqw_stage_step(&e->stage, random_converged, dqw_estimator_recent_ppm_q15(e));
}

// Stage 2 with lent memory: the Random Learner alone. Stage 3 begins from its weights.
static bool random_stage(dqw_estimator_q15 *e, const dqw_rows_q15 *r)
{
    struct dqw_estimator_random_q15 *lent = e->config->random;
    int32_t w_q24[DQW_ESTIMATOR_Q15_INPUTS];
    for (int i = 0; i < dqw_estimator_inputs_q15(e); i++) w_q24[i] = e->w_q24[i];
    (void)lent->learn(lent, r->x_q28[D], r->y_q28[D], NULL);
    const bool done = lent->learn(lent, r->x_q28[Q], r->y_q28[Q], w_q24);
    if (done) dqw_estimator_start_q15(e, w_q24);
    dqw_estimator_stage_on_q15(e, done);
    return false;
}

// Without: the first blocks in their order. What is far from the start values had its part in all that was learned
// until now, for the noise of the inputs goes with the weights: then stage 3 begins from what was found, else it goes
// on. Settled rows have no such part, and each counts.
static void coarse_stage(dqw_estimator_q15 *e, const int32_t start_q24[])
{
    const bool done = e->blocks >= COARSE_BLOCKS;
    bool far = false;
    for (int i = 0; done && i <= DQW_PSI; i++) {
        if ((e->learned >> i & 1u) == 0) continue;
        // By a factor of 1.5, either way. |w| < 2^30, start values up to 2^29
        const int32_t w = e->w_q24[i];
        const int32_t start = start_q24[i];
        far = far || w >= start + start / 2 || start >= w + w / 2;
    }
    if (far && !e->config->settled) dqw_estimator_start_q15(e, e->w_q24);
    dqw_estimator_stage_on_q15(e, done);
}

int dqw_estimator_sixfold_q15(const int64_t advance_q30[2])
{
    const int64_t c_q15 = dqw_q_round64(advance_q30[0], 15);
    const int64_t s_q15 = dqw_q_round64(advance_q30[1], 15);
    if (c_q15 == 0 && s_q15 == 0) return 0;
    // As long as a sensor's amplitude makes them.
    const int32_t c2_q15 = dqw_q_quotient32(c_q15 * c_q15 - s_q15 * s_q15, c_q15 * c_q15 + s_q15 * s_q15, 15);
    const int32_t c6_q15 = c2_q15 * (c2_q15 * c2_q15 / 8192 - 3 * 32768) / 32768;
    return c6_q15 * c6_q15 > 536870912 ? 1 : -1;
}

bool dqw_estimator_take_q15(dqw_estimator_q15 *e, dqw_estimator_q15_block *b)
{
    if (!dqw_handover_waits(&e->window.over)) return false;
    const bool settled = e->config->settled;
    const uint8_t before = e->rise.valid;
    int32_t v_q15[2];
    const volatile dqw_window_q15_part *half = &e->window.part[dqw_handover_part(&e->window.over)];
    const int32_t w_sum_q15 = half->cell[DQW_BLOCK_Q15_SIGNALS - 1].sum;
    const uint32_t event = dqw_window_join_q15(&e->window, &e->rise, b->sums, &b->weight, v_q15);
    b->with = *(const volatile dqw_estimator_q15_handed *)&e->handed;
    dqw_handover_release(&e->window.over);
    const int16_t cosine = b->with.cosine_q15;
    const int16_t sine = b->with.sine_q15;
    if (settled) {
        // A row is a half of one pair: what rises next is the row itself.
        for (int i = 0; i < e->window.signals; i++) b->sums[i] = e->rise.rise[i];
        b->weight = 1;
    } else {
        b->with.cosine_q15 = e->rise_cosine_q15;
        b->with.sine_q15 = e->rise_sine_q15;
    }
    b->whole = before == e->window.half && e->rise.valid == e->window.half;
    const int64_t advance_q30[2] = {(int64_t)cosine * e->rise_cosine_q15 + (int64_t)sine * e->rise_sine_q15,
                                    (int64_t)sine * e->rise_cosine_q15 - (int64_t)cosine * e->rise_sine_q15};
    b->sixfold = dqw_estimator_sixfold_q15(advance_q30);
    e->rise_cosine_q15 = cosine;
    e->rise_sine_q15 = sine;
    for (int axis = 0; axis < 2; axis++) {
        b->v_step_q15[axis] = v_q15[axis] - e->rise_v_q15[axis];
        e->rise_v_q15[axis] = v_q15[axis];
    }
    if (event == DQW_EVENT_INCOMPLETE && !settled && e->gate.incomplete < UINT32_MAX) e->gate.incomplete++;
    if (event != DQW_EVENT_BLOCK && !settled) return false;
    e->elapsed = b->with.number - e->number;
    e->number = b->with.number;
    if (!dqw_estimator_keep_pace_q15(e, b, advance_q30, w_sum_q15)) return false;
    dqw_estimator_turn_block_q15(e, b);
    return true;
}

static void solve(dqw_estimator_q15 *e)
{
    int64_t before_q40[DQW_ESTIMATOR_Q15_INPUTS];
    for (int i = 0; i < dqw_estimator_inputs_q15(e); i++) before_q40[i] = e->cov_q40[i];
    dqw_estimator_solve_q15(e);
    if (!e->config->settled) dqw_estimator_keep_alone_q15(e, before_q40, 2u * every(e));
}

bool dqw_estimator_learn_q15(dqw_estimator_q15 *e, const dqw_estimator_q15_block *b)
{
    const dqw_estimator_q15_config *c = e->config;
    if (e->mixed != 0) {
        e->mixed--;
        return false;
    }

    // [EST.4] inputs of both axes
    // cppcheck-suppress uninitvar; every element is set
    dqw_rows_q15 r;
    dqw_estimator_rows_of_q15(e, b, &r);

    // [EST.5] what can be learned from this block; that its signals are bounded the gate saw to
    uint32_t mask[2];
    choose(e, &r, mask);
    const bool warm = c->settled || !c->noise_on_inputs || b->with.rows >= DQW_NOISE_ROWS;
    if ((mask[D] | mask[Q]) == 0 || !warm) return false;
    if (e->stage.name == DQW_STAGE_RANDOM && c->random != NULL) return random_stage(e, &r);
    if (e->gate.blocks < UINT32_MAX) e->gate.blocks++;
    if (e->blocks < UINT16_MAX) e->blocks++;

    // What a drive leaves that starts is not what it is; and deviations are at once as wide as that makes them.
    const bool forgets = dqw_estimator_forgets_q15(e) && e->pole_pairs != 0 && dqw_stage_forgets(e->blocks);
    if (forgets) dqw_normal_forget_q15(&e->normal);

    // Once the frame is known, which legs switch.
    if (dqw_estimator_seeks_legs_q15(e) && e->stage.name != DQW_STAGE_RANDOM &&
        e->blocks >= DQW_ESTIMATOR_SEEKS_FROM_Q15) {
        dqw_estimator_try_q15(e, b, &r, mask);
        return false;
    }

    // [EST.6] both rows, then the noise of their inputs, then what has changed
    int64_t by_q24[2];
    int64_t weigh_q24[2];
    const bool follows = dqw_estimator_follows_q15(e);
    for (int axis = 0; axis < 2; axis++) {
        const bool alike = c->settled || e->blocks <= FEW_BLOCKS;
        const int64_t by = alike ? ONE_Q24
                                 : dqw_q_quotient64(dqw_estimator_common_variance_q56(e),
                                                    dqw_estimator_variance_q56(e, axis), 24);
        const int64_t root_q24 = (int64_t)dqw_q_root64((uint64_t)dqw_q_scale64(by, 24));
        weigh_q24[axis] = root_q24 < WEIGH_MAX_Q24 ? root_q24 : WEIGH_MAX_Q24;
        by_q24[axis] = dqw_q_floor64(weigh_q24[axis] * weigh_q24[axis], 24);
        e->e_q28[axis] = dqw_estimator_error_q28(e, axis, &r);
        dqw_estimator_show_q15(e, axis, &r, mask[axis], weigh_q24[axis]);
    }
    const bool solved = forgets || is_due(e);
    if (!c->settled) dqw_estimator_keep_lasting_q15(e, &r, weigh_q24, b->sixfold, solved && every(e) > 1u);
    if (c->noise_on_inputs && !c->settled) {
        keep_answered(e, b);
        dqw_estimator_take_noise_out_q15(e, &r, by_q24, mask);
    }
    if (solved) solve(e);
    keep(e, &r, mask, by_q24, solved);
    if (!sound(e, &r.unit)) return false;
    if (solved && !c->settled) publish(e, b, &r.unit);
    dqw_estimator_turn_on_q15(e, &r.unit, solved);
    if (follows) dqw_estimator_follow_q15(e, b);
    if (e->stage.name == DQW_STAGE_RANDOM) coarse_stage(e, r.unit.w_q24);
    return true;
}

bool dqw_estimator_background_q15(dqw_estimator_q15 *e)
{
    dqw_estimator_q15_block b;
    if (!dqw_estimator_take_q15(e, &b) || e->stage.name == DQW_STAGE_DOMAIN) return false;
    const bool judged = e->stage.name != DQW_STAGE_RANDOM;
    if (!dqw_estimator_learn_q15(e, &b)) return false;
    if (is_due(e) && dqw_estimator_seeks_q15(e)) dqw_poles_find_q15(e, &b);
    if (judged) dqw_estimator_stage_on_q15(e, true);
    return true;
}
