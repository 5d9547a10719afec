// What the estimator does in the background: take a block, learn it.
#include <math.h>
#include <stddef.h>

#include "dqw_estimator_block.h"
#include "dqw_estimator_random.h"
#include "dqw_number.h"

#define EXCITATION_PU 0.01f
#define EXCITATION_SETTLED_PU 0.002f
// A weight whose variance fell by less than this was not learned.
#define LEARNED_RATIO 0.01f
// The recent residual's variance is known to 18 %, and soon. Before so few blocks none is known to 20 %.
#define RECENT_PART (1.0f / 64.0f)
#define FEW_BLOCKS 50u
// Blocks of stage 2 without lent memory; and how far what they found may be from the start values, either way, for
// these to stand.
#define COARSE_BLOCKS 50u
#define COARSE_RATIO 1.5f
// An input whose power is not three times its noise teaches nothing; noise alone would need ten deviations.
#define NOISE_MARGIN 3.0f
// Nor does an inductance's on one axis whose power there is not twice its noise there.
#define OWN_MARGIN 2.0f
// From here on a loop answers all, to 0.1 %.
#define ANSWERED_MOST 1000.0f
// R needs currents of so many of dead time's widths, squared.
#define STEP_MARGIN 16.0f
#define EXCESS_PART (1.0f / 32.0f)
// A strong block counts as so many weak ones, so that a drive that stops is seen to have stopped within 32 ln 8 = 67
// blocks, however strong it was.
#define EXCESS_MAX 8.0f
// Where noise is more than this part of all that was learned of a weight, taking it out could run away.
#define NOISE_PART_MAX 0.05f
// A per-unit weight beyond this is no machine's.
#define WEIGHT_MAX_PU 1e4f
// Currents are followed the later, the wider their noise is beside the step that dead time makes of them: by this many
// half periods, where what is lost of fast ones near that step is as much as noise would take. And no later than so. (E60)
#define LEAD 0.7f
#define LEAD_MOST 4.0f
// An inductance is handed to the interrupt where its deviation is below this part of it; beyond this ratio to the one
// in use, either way, the noise was measured with a wrong one.
#define PUBLISHED_SD 0.2f
#define PUBLISHED_RATIO 1.25f

enum { D = DQW_AXIS_D, Q = DQW_AXIS_Q };

// Noise of the inputs turns the gradient by C w: put back. Not where it is much of what was learned, there it could run
// away. (E60)
static void take_noise_out(dqw_estimator *e, const dqw_estimator_rows *n, const float ratio[2], const uint32_t mask[2])
{
    float z[DQW_ESTIMATOR_INPUTS] = {0};
    for (int axis = 0; axis < 2; axis++) {
        const float by = 1.0f / ratio[axis];
        for (int i = 0; i < DQW_PARAMETERS; i++)
            if ((mask[axis] >> i & 1u) != 0) z[i] += n->var[axis][i] * by;
        // Row by row, as the inputs' power is.
        for (int L = DQW_LD; L <= DQW_LQ && e->blocks > DQW_LASTING_FROM; L++) {
            const float noisy = (mask[axis] >> L & 1u) != 0 ? n->var[axis][L] * by : 0.0f;
            e->noisy_pu2[L - DQW_LD] += (noisy - e->noisy_pu2[L - DQW_LD]) * dqw_lasting_part(e, 1.0f);
        }
    }
    for (int i = 0; i < DQW_PARAMETERS; i++) {
        if (z[i] * dqw_gain_covariance(&e->gain, i, i) > NOISE_PART_MAX) return;
        z[i] *= e->w_pu[i];
    }
    for (int axis = 0; axis < 2; axis++) {
        const float by = 1.0f / ratio[axis];
        if (dqw_estimator_has_dead_time(e)) {
            z[DQW_R] += n->dead_in_R[axis] * by * e->w_pu[DQW_DEAD_TIME];
            z[DQW_DEAD_TIME] += n->R_in_dead[axis] * by * e->w_pu[DQW_R];
        }
        const int L = dqw_estimator_cross(e, axis);
        const int flux = dqw_estimator_flux(axis);
        if ((mask[axis] >> L & mask[axis] >> flux & 1u) == 0) continue;
        z[L] += n->speed[axis] * by * e->w_pu[flux];
        z[flux] += n->speed[axis] * by * e->w_pu[L];
    }
    float move[DQW_ESTIMATOR_INPUTS];
    dqw_gain_apply(&e->gain, z, move);
    for (int i = 0; i < e->inputs; i++) e->w_pu[i] += move[i];
}

// Of noise in a slope over a block of h pairs a first-order loop of so much of a period answers a part. (E189)
static void keep_answered(dqw_estimator *e, const dqw_noise_variances *noise)
{
    const float var_A2 = dqw_noise_variance(noise->i_d_A2);
    if (!(var_A2 > 0.0f)) return;
    const float a = fabsf(noise->answer_A2) / (3.0f * var_A2) * (float)e->window.half;
    e->answered = a < ANSWERED_MOST ? a * a / (3.0f + 1.5f * a + a * a) : 1.0f;
}

// The same gain learns what of the late voltage the inputs explain; the rest, against the residual, is by how many
// periods it is late. (E90)
static void learn_late(dqw_estimator *e, const float x[], const float k[], float late_pu, float error_pu, float left)
{
    float rest = late_pu;
    // All of them: by a part of its inputs a gain may lead away from what they say.
    for (int i = 0; i < e->inputs; i++)
        rest -= e->late_w[i] * x[i];  // NOLINT(clang-analyzer-core.UndefinedBinaryOperatorResult)
    for (int i = 0; i < e->inputs; i++) e->late_w[i] += k[i] * rest;
    e->late_pu2 += (rest * rest * left - e->late_pu2) * dqw_estimator_part(e);
    e->late_error_pu2 += (error_pu * rest * left - e->late_error_pu2) * dqw_estimator_part(e);
}

// One axis' row through the joint neuron: predict, compare, correct; weighed by how little of that axis is noise.
static void learn_row(dqw_estimator *e, int axis, const dqw_estimator_rows *r, uint32_t mask, float ratio,
                      const float *late_pu, float score[])
{
    const float weigh = 1.0f / sqrtf(ratio);
    float x[DQW_ESTIMATOR_INPUTS];
    float k[DQW_ESTIMATOR_INPUTS];
    float error = r->y[axis];
    for (int i = 0; i < e->inputs; i++) {
        error -= e->w_pu[i] * r->x[axis][i];
        x[i] = (mask >> i & 1u) != 0 ? r->x[axis][i] * weigh : 0.0f;
    }
    dqw_gain_step(&e->gain, x, k);
    float seen = 0.0f;
    for (int i = 0; i < e->inputs; i++) {
        e->w_pu[i] +=
            k[i] *
            (error * weigh);  // NOLINT(clang-analyzer-core.UndefinedBinaryOperatorResult): the gain has as many inputs
        seen += k[i] * x[i];  // NOLINT(clang-analyzer-core.UndefinedBinaryOperatorResult): the same
    }
    dqw_estimator_keep_alone(e, k, seen);
    // seen rounds to above 1 where next to nothing was known.
    const float left = seen < 1.0f ? 1.0f - seen : 0.0f;
    const float after = error * left;
    for (int i = 0; i < e->inputs; i++) {
        const int at = i >= DQW_PARAMETERS ? i - DQW_PARAMETERS + 4 : i < 4 ? i : -1;
        if (at >= 0)
            score[at] += x[i] * (after * weigh);  // NOLINT(clang-analyzer-core.UndefinedBinaryOperatorResult): the same
    }
    e->error_pu2[axis] += (error * after - e->error_pu2[axis]) * dqw_estimator_part(e);
    e->e_pu[axis] = error;
    if (late_pu != NULL) learn_late(e, x, k, late_pu[axis] * weigh, error * weigh, left);
}

static void keep_scores(dqw_estimator *e, const float score[])
{
    const float part = dqw_estimator_part(e);
    for (int i = 0; i < DQW_ESTIMATOR_SCORES; i++) {
        e->score2[i] += (score[i] * score[i] - e->score2[i]) * part;
        e->score_lag[i] += (score[i] * e->score_last[i] - e->score_lag[i]) * part;
        e->score_last[i] = score[i];
    }
}

float dqw_estimator_size_pu(const dqw_estimator *e, int i)
{
    if (i == DQW_DEAD_TIME && dqw_estimator_has_dead_time(e))
        return dqw_estimator_start_sd_pu(e, DQW_DEAD_TIME) * (1.0f / 3.0f);
    return fabsf(e->w_pu[i == DQW_PSI_Q && dqw_estimator_has_flux_q(e) ? DQW_PSI : i]);
}

// A mean power above the least that teaches, over that.
static int16_t toward_excess(int16_t excess_q10, float power, float least)
{
    const float excess = (power < EXCESS_MAX * least ? power / least : EXCESS_MAX) - 1.0f;
    const float mean = (float)excess_q10 * (1.0f / 1024.0f);
    return (int16_t)((mean + (excess - mean) * EXCESS_PART) * 1024.0f);
}

// Noise alone in an inductance's slope is no slope, however much the other axis says; and that axis says it also where
// it is little, or the flux would take it.
static void choose_inductances(dqw_estimator *e, const dqw_estimator_rows *r, uint32_t mask[2])
{
    for (int axis = 0; axis < 2; axis++) {
        const int cross = dqw_estimator_cross(e, axis);
        const bool flux = (mask[axis] >> dqw_estimator_flux(axis) & 1u) != 0;
        for (int L = DQW_LD; L <= DQW_LQ; L++) {
            const float x = r->x[axis][L];
            int16_t *above = &e->above_q10[L - DQW_LD][axis];
            *above = toward_excess(*above, x * x, OWN_MARGIN * r->var[axis][L]);
            if (*above <= 0)
                mask[axis] &= ~(1u << L);
            else if (L == cross && flux && x != 0.0f)
                mask[axis] |= 1u << L;
        }
    }
}

// Inputs large enough to teach their weight, by their power above the noise: a choice by the mean and not by the block,
// which would bias. A settled row stands for itself.
static void choose(dqw_estimator *e, const dqw_estimator_rows *r, uint32_t mask[2])
{
    const dqw_estimator_config *c = e->config;
    const float usual = c->settled ? EXCITATION_SETTLED_PU : EXCITATION_PU;
    const float threshold = c->excitation_pu > 0.0f ? c->excitation_pu : usual;
    const float width_pu = dqw_estimator_has_dead_time(e) ? e->dead_time_width_A / c->i_base_A : 0.0f;
    mask[D] = mask[Q] = 0;
    for (int i = 0; i < e->inputs; i++) {
        const float d = r->x[D][i];
        const float q = r->x[Q][i];
        if (c->settled) {
            if (fabsf(d) >= threshold) mask[D] |= 1u << i;
            if (fabsf(q) >= threshold) mask[Q] |= 1u << i;
            continue;
        }
        float least = threshold * threshold;
        if (i < DQW_PARAMETERS) least += NOISE_MARGIN * (r->var[D][i] + r->var[Q][i]);
        // Among currents as small as dead time's step, its shape decides what is left for R.
        if (i == DQW_R) least += STEP_MARGIN * width_pu * width_pu;
        const float power = d * d + q * q;
        e->excess_q10[i] = toward_excess(e->excess_q10[i], power, least);
        if (e->excess_q10[i] <= 0) continue;
        if (d != 0.0f) mask[D] |= 1u << i;
        if (q != 0.0f) mask[Q] |= 1u << i;
    }
    if (!c->settled) choose_inductances(e, r, mask);
    // There the other weights would take up what is wrong with dead time's shape.
    if (!c->settled && width_pu > 0.0f && e->excess_q10[DQW_R] <= 0) mask[D] = mask[Q] = 0;
}

static bool sound(dqw_estimator *e)
{
    for (int i = 0; i < e->inputs; i++) {
        if (!dqw_within(e->w_pu[i], WEIGHT_MAX_PU)) {
            dqw_estimator_start(e, NULL);
            if (e->restarts < UINT8_MAX) e->restarts++;
            return false;
        }
        const float sd = dqw_estimator_start_sd_pu(e, i);
        const float start = sd * sd / (DQW_ESTIMATOR_START_RESIDUAL_PU * DQW_ESTIMATOR_START_RESIDUAL_PU);
        if (dqw_gain_covariance(&e->gain, i, i) < LEARNED_RATIO * start) e->learned |= 1u << i;
    }
    return true;
}

// What the interrupt takes: the voltage's part in a step, from an L that is known, and how fast dead time's input
// follows the currents.
static void publish(dqw_estimator *e, const dqw_estimator_block *b)
{
    volatile dqw_estimator_given *g = &e->given;
    const bool waits = *(volatile bool *)&e->given_ready;
    *(volatile bool *)&e->given_ready = false;
    bool noise_anew = waits && g->noise_anew;
    for (int axis = 0; axis < 2; axis++) {
        const float L_H = dqw_estimator_value(e, DQW_LD + axis);
        if (!(dqw_estimator_noise_sd(e, DQW_LD + axis) < PUBLISHED_SD * L_H)) continue;
        const float step = e->config->dt_s / L_H;
        const float last = g->step_A_per_V[axis];
        if (step > PUBLISHED_RATIO * last || last > PUBLISHED_RATIO * step) noise_anew = true;
        g->step_A_per_V[axis] = step;
    }
    if (e->dead_time_width_A > 0.0f) {
        const float sd = sqrtf(0.5f * dqw_noise_variance(b->noise.i_d_A2 + b->noise.i_q_A2));
        const float lead = LEAD * sd / e->dead_time_width_A;
        g->lead = lead < LEAD_MOST ? lead : LEAD_MOST;
    }
    g->noise_anew = noise_anew;
    *(volatile bool *)&e->given_ready = true;
}

int dqw_estimator_sixfold(const float advance[2])
{
    const float c = advance[0] * advance[0];
    const float s = advance[1] * advance[1];
    if (!(c + s > 0.0f)) return 0;
    // As long as a sensor's amplitude makes them.
    const float c2 = (c - s) / (c + s);
    const float c6 = c2 * (4.0f * c2 * c2 - 3.0f);
    return 2.0f * c6 * c6 > 1.0f ? 1 : -1;
}

bool dqw_estimator_take(dqw_estimator *e, dqw_estimator_block *b)
{
    if (!dqw_handover_waits(&e->window.over)) return false;
    float v_V[2];
    const uint32_t before = e->rise.valid;
    const volatile dqw_window_part *half = &e->window.part[dqw_handover_part(&e->window.over)];
    // Of sums of two.
    const float w_m = half->valid > 0 ? 0.5f * half->cell[DQW_BLOCK_SIGNALS - 1].sum / (float)half->valid : 0.0f;
    uint32_t event = dqw_window_join(&e->window, &e->rise, b->sum, v_V);
    const dqw_estimator_handed h = *(const volatile dqw_estimator_handed *)&e->handed;
    dqw_handover_release(&e->window.over);
    if (e->config->settled) {
        // A row is a half of one pair: what rises next is the row itself.
        for (int i = 0; i < e->window.signals; i++) b->sum[i] = e->rise.rise[i];
        event = DQW_EVENT_BLOCK;
        b->cosine = h.cosine;
        b->sine = h.sine;
    } else {
        b->cosine = e->rise_cosine;
        b->sine = e->rise_sine;
    }
    b->v_step_V[0] = v_V[0] - e->rise_v_V[0];
    b->v_step_V[1] = v_V[1] - e->rise_v_V[1];
    b->dead_slope_inv_A = h.dead_slope_inv_A;
    b->noise = h.noise;
    b->whole = before == e->window.half && e->rise.valid == e->window.half;
    const float advance[2] = {h.cosine * e->rise_cosine + h.sine * e->rise_sine,
                              h.sine * e->rise_cosine - h.cosine * e->rise_sine};
    b->sixfold = dqw_estimator_sixfold(advance);
    e->rise_cosine = h.cosine;
    e->rise_sine = h.sine;
    e->rise_v_V[0] = v_V[0];
    e->rise_v_V[1] = v_V[1];
    e->noise_rows = h.noise.rows;
    if (event == DQW_EVENT_INCOMPLETE && e->gate.incomplete < UINT32_MAX) e->gate.incomplete++;
    if (event != DQW_EVENT_BLOCK) return false;
    e->elapsed = h.number - e->number;
    e->number = h.number;
    if (!dqw_estimator_keep_pace(e, b, advance, w_m)) return false;
    dqw_estimator_turn_block(e, b);
    return true;
}

void dqw_estimator_stage_on(dqw_estimator *e, bool random_converged)
{
    // What is still to be found is not judged by what it leaves.
    if (e->stage.name == DQW_STAGE_ORDINAL && dqw_estimator_seeks_legs(e)) return;
    const float ratio = dqw_estimator_recent_pu(e);
    (void)dqw_stage_step(&e->stage, random_converged, ratio < 4000.0f ? (uint32_t)(ratio * 1e6f) : 4000000000u);
}

// Stage 2 with lent memory: the Random Learner alone. Stage 3 begins from its weights.
static bool random_stage(dqw_estimator *e, const dqw_estimator_rows *r)
{
    dqw_estimator_random *lent = e->config->random;
    const bool done = lent->learn(lent, r->x[D], r->x[Q], r->y, e->inputs);
    if (done) dqw_estimator_start(e, lent->coarse.w_pu);
    dqw_estimator_stage_on(e, done);
    return false;
}

// Without: the first blocks in their order. What is far from the start values had its part in all that was learned
// until now, for the noise of the inputs goes with the weights: then stage 3 begins from what was found, else it goes
// on. (E93) Settled rows have no such part, and each counts.
static void coarse_stage(dqw_estimator *e)
{
    const bool done = e->blocks >= COARSE_BLOCKS;
    float w[DQW_ESTIMATOR_INPUTS];
    bool far = false;
    for (int i = 0; done && i < e->inputs; i++) {
        w[i] = e->w_pu[i];
        if (i > DQW_PSI || (e->learned >> i & 1u) == 0) continue;
        const float start = dqw_estimator_nominal_pu(e, i);
        far = far || !(w[i] < COARSE_RATIO * start) || !(start < COARSE_RATIO * w[i]);
    }
    if (far && !e->config->settled) dqw_estimator_start(e, w);
    dqw_estimator_stage_on(e, done);
}

bool dqw_estimator_learn(dqw_estimator *e, const dqw_estimator_block *b)
{
    const dqw_estimator_config *c = e->config;
    if (e->mixed != 0) {
        e->mixed--;
        return false;
    }

    // [EST.4] inputs of both axes
    dqw_estimator_rows r;
    dqw_estimator_rows_of(e, b, &r);

    // [EST.5] what can be learned from this block; that its signals are bounded the gate saw to
    uint32_t mask[2];
    choose(e, &r, mask);
    const bool warm = c->settled || !c->noise_on_inputs || b->noise.rows >= DQW_NOISE_ROWS;
    if ((mask[D] | mask[Q]) == 0 || !warm) return false;
    if (e->stage.name == DQW_STAGE_RANDOM && c->random != NULL) return random_stage(e, &r);
    if (e->gate.blocks < UINT32_MAX) e->gate.blocks++;
    if (e->blocks < UINT16_MAX) e->blocks++;

    // What a drive leaves that starts is not what it is.
    if (dqw_estimator_forgets(e) && e->pole_pairs != 0 && dqw_stage_forgets(e->blocks)) dqw_gain_forget(&e->gain);

    // Once the frame is known, which legs switch.
    const bool seeks = dqw_estimator_seeks_legs(e) && e->stage.name != DQW_STAGE_RANDOM;
    if (seeks && e->blocks >= DQW_ESTIMATOR_SEEKS_FROM) {
        dqw_estimator_try(e, b, &r, mask);
        return false;
    }

    // [EST.6] both rows, then the noise of their inputs, then what has changed
    float ratio[2];
    for (int axis = 0; axis < 2; axis++)
        ratio[axis] = !c->settled && e->blocks > FEW_BLOCKS ? dqw_estimator_axis_part(e, axis) : 1.0f;
    const float *late_pu = !c->settled && e->pole_pairs != 0 && b->whole ? r.late : NULL;
    float score[DQW_ESTIMATOR_SCORES] = {0};
    const bool follows = dqw_estimator_forgets(e) && e->pole_pairs != 0 && e->stage.name != DQW_STAGE_RANDOM && !seeks;
    if (follows)
        for (int axis = 0; axis < 2; axis++) dqw_estimator_show_segment(e, axis, &r, mask[axis], ratio[axis]);
    learn_row(e, D, &r, mask[D], ratio[D], late_pu, score);
    learn_row(e, Q, &r, mask[Q], ratio[Q], late_pu, score);
    keep_scores(e, score);
    dqw_estimator_keep_lasting(e, &r, ratio, b->sixfold);
    e->recent_pu2 += (e->e_pu[D] * e->e_pu[D] + e->e_pu[Q] * e->e_pu[Q] - e->recent_pu2) * RECENT_PART;
    if (c->noise_on_inputs && !c->settled) {
        keep_answered(e, &b->noise);
        take_noise_out(e, &r, ratio, mask);
    }
    if (!sound(e)) return false;
    if (!c->settled) publish(e, b);
    dqw_estimator_turn_on(e);
    if (follows) dqw_estimator_follow(e, b);
    if (e->stage.name == DQW_STAGE_RANDOM) coarse_stage(e);
    return true;
}

bool dqw_estimator_background(dqw_estimator *e)
{
    dqw_estimator_block b;
    if (!dqw_estimator_take(e, &b) || e->stage.name == DQW_STAGE_DOMAIN) return false;
    const bool judged = e->stage.name != DQW_STAGE_RANDOM;
    if (!dqw_estimator_learn(e, &b)) return false;
    if (e->pole_pairs == 0 && !e->config->settled) dqw_poles_find(e);
    if (judged) dqw_estimator_stage_on(e, true);
    return true;
}
