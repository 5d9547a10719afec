// What the tracker does in the background: learn a block, and say what was learned.
#include <math.h>
#include <stddef.h>

#include "dqw_tracker.h"

#define EXCITATION_PU 0.01f
// A weight whose variance fell by less than this was not learned.
#define LEARNED_RATIO 0.01f
// A smaller residual is the sampling's own, and rounding.
#define VARIANCE_FLOOR_PU2 1e-8f
// Blocks over which statistics are means.
#define MEMORY 1000u
#define FEW_BLOCKS 50u
#define LAG_MAX 0.98f
#define LAG_MIN -0.4f
// Rows that only measure the noise and its share.
#define WARM_UP 2000u
// An input whose power is not three times its noise teaches nothing; noise alone would need ten deviations.
#define NOISE_MARGIN 3.0f
// R needs currents of so many of dead time's widths, squared.
#define STEP_MARGIN 16.0f
#define EXCESS_PART (1.0f / 32.0f)
// A strong block counts as so many weak ones, so that a drive that stops is soon seen to have stopped.
#define EXCESS_MAX 8.0f
// Where noise is more than this part of all that was learned of a weight, taking it out could run away.
#define NOISE_PART_MAX 0.05f
// A per-unit weight beyond this is no machine's.
#define WEIGHT_MAX_PU 1e4f
// An inductance below this part of the nominal one is not believed.
#define LEAST_L 0.1f
// Currents are followed so fast that the noise left is about as wide as the step that dead time makes of them.
#define FOLLOW 0.7f

enum { D = 0, Q = 1, N = DQW_TRACK_WEIGHTS };

float dqw_tracker_value(const dqw_tracker *t, enum dqw_tracker_weight weight)
{
    return (unsigned)weight < N ? t->w_pu[weight] * dqw_tracker_unit(t->config, weight) : NAN;
}

static float variance(const dqw_tracker *t, int axis)
{
    return t->error_pu2[axis] > VARIANCE_FLOOR_PU2 ? t->error_pu2[axis] : VARIANCE_FLOOR_PU2;
}

static float common_variance(const dqw_tracker *t)
{
    return 0.5f * (variance(t, D) + variance(t, Q));
}

// Blocks overlap by half, so that next ones are alike, or unlike, in what they teach a weight: that widens or narrows its deviation. Dead
// time goes with the current as R does, the flux on the other axis with the speed as the flux. (E61)
static float inflation(const dqw_tracker *t, int i)
{
    const int like = i == DQW_TRACK_DEAD_TIME ? DQW_TRACK_R : i == DQW_TRACK_PSI_Q ? DQW_TRACK_PSI : i;
    if (!(t->score2[like] > 0.0f)) return 1.0f;
    const float r = t->score_lag[like] / t->score2[like];
    return 1.0f + 2.0f * (r < LAG_MIN ? LAG_MIN : r > LAG_MAX ? LAG_MAX : r);
}

float dqw_tracker_sd(const dqw_tracker *t, enum dqw_tracker_weight weight)
{
    if ((unsigned)weight >= N) return INFINITY;
    const int i = (int)weight;
    if (((uint32_t)t->learned >> i & 1u) == 0 || t->blocks < 2u * N) return INFINITY;
    return sqrtf(dqw_gain_covariance(&t->gain, i, i) * common_variance(t) * inflation(t, i)) * dqw_tracker_unit(t->config, weight);
}

float dqw_tracker_residual_pu(const dqw_tracker *t)
{
    return sqrtf(t->error_pu2[D] + t->error_pu2[Q]);
}

// Mean slope of dead time's input times the delay of the currents that it sees, s/A.
static float late(const dqw_tracker *t)
{
    return t->dead_slope_inv_A * t->config->dt_s * (1.0f / t->follow - 1.0f);
}

dqw_block dqw_tracker_block(const dqw_tracker *t)
{
    // Volatile, as the flag that guards them: read after dqw_tracker_waits() and before dqw_tracker_release().
    const volatile float *m = t->block;
    const float rate = 1.0f / t->config->dt_s;
    const dqw_block b = {m[0], m[1], 0.5f * m[2], 0.5f * m[3], rate * m[4], rate * m[5], 0.5f * m[6], 0.5f * m[7], 0.5f * m[8]};
    return b;
}

static dqw_block exact_block(const dqw_tracker *t)
{
    dqw_block b = dqw_tracker_block(t);
    const dqw_machine known = {dqw_tracker_value(t, DQW_TRACK_R), dqw_tracker_value(t, DQW_TRACK_LD), dqw_tracker_value(t, DQW_TRACK_LQ),
                               (float)t->config->pole_pairs};
    if (t->blocks > 10 && known.R_ohm > 0.0f) dqw_model_bow(&b, &known, t->config->dt_s);
    return b;
}

static void rows_of(const dqw_tracker *t, const dqw_block *b, float x_d[], float x_q[])
{
    const dqw_tracker_config *c = t->config;
    const float p = (float)c->pole_pairs;
    const volatile float *dead = &t->block[DQW_BLOCK_SIGNALS];
    // Dead time's input saw the currents late: on average that is its mean slope times the delay times the current's.
    const float late_s_A = late(t);
    const float d[N] = {b->i_d_A, b->di_d_A_s, -p * b->wi_q_A_rad_s, 0.0f, 0.5f * dead[0] + late_s_A * b->di_d_A_s, c->angle ? p * b->w_m_rad_s : 0.0f};
    const float q[N] = {b->i_q_A, p * b->wi_d_A_rad_s, b->di_q_A_s, p * b->w_m_rad_s, 0.5f * dead[1] + late_s_A * b->di_q_A_s, 0.0f};
    const float to_pu = 1.0f / c->v_base_V;
    for (int i = 0; i < N; i++) {
        const float unit = dqw_tracker_unit(c, (enum dqw_tracker_weight)i) * to_pu;
        x_d[i] = d[i] * unit;
        x_q[i] = q[i] * unit;
    }
}

void dqw_tracker_rows(const dqw_tracker *t, float x_d[], float x_q[], float y[])
{
    const dqw_block b = exact_block(t);
    rows_of(t, &b, x_d, x_q);
    y[D] = b.v_d_V / t->config->v_base_V;
    y[Q] = b.v_q_V / t->config->v_base_V;
}

// Variances of the noise of a block's inputs, per unit; the covariance of the speed's two inputs in a row, the other axis' inductance and the
// flux; and those of dead time's with R's. (E60)
typedef struct input_noise {
    float var[2][N];
    float speed[2];
    float dead_in_R[2], R_in_dead[2];
} input_noise;

static void noise_of_dead_time(const dqw_tracker *t, int axis, float var_i, float mean, const float s[], input_noise *n)
{
    const float width = t->config->dead_time_width_A;
    const float g = mean * t->dead_slope_inv_A * s[DQW_TRACK_DEAD_TIME];
    const float left = var_i * t->follow / (2.0f - t->follow);
    const float sd = sqrtf(left);
    // Where what is left of the current's noise is wide, that of a step; where narrow, tanh's own; and all of it where the currents stay
    // within the width. In the resistance's equation a wide noise also smooths the step, which takes half.
    const float wide = 0.53f / (sd + 1.2f * width);
    n->var[axis][DQW_TRACK_DEAD_TIME] = g * var_i * (t->dead_slope_inv_A > wide ? t->dead_slope_inv_A : wide) * s[DQW_TRACK_DEAD_TIME];
    n->R_in_dead[axis] = g * s[DQW_TRACK_R] * var_i;
    n->dead_in_R[axis] = g * s[DQW_TRACK_R] * (var_i - 0.5f * left * sd / (sd + width));
}

static void noise_of(const dqw_tracker *t, const dqw_block *b, input_noise *n)
{
    const dqw_tracker_config *c = t->config;
    const float h = (float)t->window.half;
    const float p = (float)c->pole_pairs;
    const float sum = h * (h + 1.0f);
    const float mean = (h * (4.0f * h * h - 1.0f) / 6.0f + h * h) / (sum * sum);
    const float slope = 2.0f * h / (c->dt_s * c->dt_s * sum * sum);
    const float var_i[2] = {dqw_noise_variance(t->noise.i_d_A2), dqw_noise_variance(t->noise.i_q_A2)};
    const float i[2] = {b->i_d_A, b->i_q_A};
    const float turn = mean * p * p;
    const float flux = turn * dqw_noise_variance(t->noise.w_rad2_s2);
    float s[N];
    for (int k = 0; k < N; k++) s[k] = dqw_tracker_unit(c, (enum dqw_tracker_weight)k) / c->v_base_V;
    for (int axis = 0; axis < 2; axis++) {
        // cppcheck-suppress uninitvar; every element is set below
        float *var = n->var[axis];
        const int other = 1 - axis;
        var[DQW_TRACK_R] = mean * var_i[axis];
        var[DQW_TRACK_LD + axis] = slope * var_i[axis];
        var[DQW_TRACK_LQ - axis] = turn * b->w_m_rad_s * b->w_m_rad_s * var_i[other] + flux * (i[other] * i[other] + var_i[other]);
        var[DQW_TRACK_PSI] = axis == Q ? flux : 0.0f;
        var[DQW_TRACK_PSI_Q] = axis == D && c->angle ? flux : 0.0f;
        var[DQW_TRACK_DEAD_TIME] = 0.0f;
        for (int k = 0; k < N; k++) var[k] *= s[k] * s[k];
        n->speed[axis] = (axis == Q ? flux * b->i_d_A : c->angle ? -flux * b->i_q_A : 0.0f) * s[DQW_TRACK_LQ - axis] * s[DQW_TRACK_PSI];
        n->dead_in_R[axis] = n->R_in_dead[axis] = 0.0f;
        if (c->dead_time_width_A > 0.0f) noise_of_dead_time(t, axis, var_i[axis], mean, s, n);
    }
}

// Noise of the inputs turns the gradient by C w: put back. Not where it is much of what was learned, there it could run away. (E60)
static void take_noise_out(dqw_tracker *t, const input_noise *n, const float ratio[2], const uint32_t mask[2])
{
    float z[N] = {0};
    for (int axis = 0; axis < 2; axis++) {
        const float by = 1.0f / ratio[axis];
        for (int i = 0; i < N; i++)
            if ((mask[axis] >> i & 1u) != 0) z[i] += n->var[axis][i] * by;
    }
    for (int i = 0; i < N; i++) {
        if (z[i] * dqw_gain_covariance(&t->gain, i, i) > NOISE_PART_MAX) return;
        z[i] *= t->w_pu[i];
    }
    for (int axis = 0; axis < 2; axis++) {
        const float by = 1.0f / ratio[axis];
        z[DQW_TRACK_R] += n->dead_in_R[axis] * by * t->w_pu[DQW_TRACK_DEAD_TIME];
        z[DQW_TRACK_DEAD_TIME] += n->R_in_dead[axis] * by * t->w_pu[DQW_TRACK_R];
        const int L = DQW_TRACK_LQ - axis;
        const int flux = axis == Q ? DQW_TRACK_PSI : DQW_TRACK_PSI_Q;
        if ((mask[axis] >> L & mask[axis] >> flux & 1u) == 0) continue;
        z[L] += n->speed[axis] * by * t->w_pu[flux];
        z[flux] += n->speed[axis] * by * t->w_pu[L];
    }
    float move[N];
    dqw_gain_apply(&t->gain, z, move);
    for (int i = 0; i < N; i++) t->w_pu[i] += move[i];
}

static float memory_of(const dqw_tracker *t)
{
    return (float)(t->blocks < MEMORY ? t->blocks : MEMORY);
}

// One axis' row through the joint neuron: predict, compare, correct; weighed by how little of that axis is noise.
static void learn_row(dqw_tracker *t, int axis, const float x_pu[], uint32_t mask, float y_pu, float ratio, float score[])
{
    const float weigh = 1.0f / sqrtf(ratio);
    float x[N];
    float k[N];
    float e = y_pu;
    for (int i = 0; i < N; i++) {
        e -= t->w_pu[i] * x_pu[i];
        x[i] = (mask >> i & 1u) != 0 ? x_pu[i] * weigh : 0.0f;
    }
    dqw_gain_step(&t->gain, x, k);
    float seen = 0.0f;
    for (int i = 0; i < N; i++) {
        t->w_pu[i] += k[i] * (e * weigh);
        seen += k[i] * x[i];
    }
    const float after = e * (1.0f - seen);
    for (int i = 0; i < DQW_TRACK_SCORES; i++) score[i] += x[i] * (after * weigh);
    t->error_pu2[axis] += (e * after - t->error_pu2[axis]) / memory_of(t);
    t->e_pu[axis] = e;
}

static void keep_scores(dqw_tracker *t, const float score[])
{
    const float part = 1.0f / memory_of(t);
    for (int i = 0; i < DQW_TRACK_SCORES; i++) {
        t->score2[i] += (score[i] * score[i] - t->score2[i]) * part;
        t->score_lag[i] += (score[i] * t->score_last[i] - t->score_lag[i]) * part;
        t->score_last[i] = score[i];
    }
}

// A parameter may wander: its variance grows with time, here in halves of a window, up to where it started. (E61)
static void drift(dqw_tracker *t, uint32_t elapsed)
{
    const float rate = t->config->drift_per_sqrt_s * (1.0f / DQW_TRACK_START_SD);
    if (!(rate > 0.0f)) return;
    const float common = common_variance(t);
    const float widest = 1.0f / common;
    float unit = rate * rate * (float)elapsed * (float)t->window.half * t->config->dt_s * widest;
    if (unit > widest) unit = widest;
    for (int i = 0; i < N; i++) {
        const float sd = dqw_tracker_start_sd_pu(t, i);
        if (dqw_gain_covariance(&t->gain, i, i) < widest * sd * sd) dqw_gain_grow(&t->gain, i, unit * sd * sd);
    }
}

// Inputs large enough to teach their weight, by their power above the noise: a choice by the mean and not by the block, which would bias.
static void choose(dqw_tracker *t, const float x_d[], const float x_q[], const input_noise *n, uint32_t mask[2])
{
    const float threshold = t->config->excitation_pu > 0.0f ? t->config->excitation_pu : EXCITATION_PU;
    const float width_pu = t->config->angle ? t->config->dead_time_width_A / t->config->i_base_A : 0.0f;
    mask[D] = mask[Q] = 0;
    for (int i = 0; i < N; i++) {
        float least = NOISE_MARGIN * (n->var[D][i] + n->var[Q][i]) + threshold * threshold;
        // Among currents as small as dead time's step, its shape decides what is left for R.
        if (i == DQW_TRACK_R) least += STEP_MARGIN * width_pu * width_pu;
        const float power = x_d[i] * x_d[i] + x_q[i] * x_q[i];
        const float excess = (power < EXCESS_MAX * least ? power / least : EXCESS_MAX) - 1.0f;
        const float mean = (float)t->excess_q10[i] * (1.0f / 1024.0f);
        t->excess_q10[i] = (int16_t)((mean + (excess - mean) * EXCESS_PART) * 1024.0f);
        if (t->excess_q10[i] <= 0) continue;
        if (x_d[i] != 0.0f) mask[D] |= 1u << i;
        if (x_q[i] != 0.0f) mask[Q] |= 1u << i;
    }
    // There the other weights would take up what is wrong with the shape.
    if (width_pu > 0.0f && t->excess_q10[DQW_TRACK_R] <= 0) mask[D] = mask[Q] = 0;
}

// What has left all bounds begins again; what was learned for the first time is noted.
static bool sound(dqw_tracker *t)
{
    for (int i = 0; i < N; i++) {
        if (!(fabsf(t->w_pu[i]) < WEIGHT_MAX_PU)) {
            dqw_tracker_start(t);
            if (t->restarts < UINT8_MAX) t->restarts++;
            return false;
        }
        const float sd = dqw_tracker_start_sd_pu(t, i);
        if (((uint32_t)t->learned >> i & 1u) == 0 &&
            dqw_gain_covariance(&t->gain, i, i) < LEARNED_RATIO / (DQW_TRACK_START_RESIDUAL_PU * DQW_TRACK_START_RESIDUAL_PU) * sd * sd)
            t->learned |= (uint8_t)(1u << i);
    }
    return true;
}

// What the interrupt takes of the voltage's part in a step: from no L that could not be the machine's.
static void publish(dqw_tracker *t)
{
    const dqw_tracker_config *c = t->config;
    const float nominal_H[2] = {c->Ld_H, c->Lq_H};
    for (int axis = 0; axis < 2; axis++) {
        const float L_H = dqw_tracker_value(t, (enum dqw_tracker_weight)(DQW_TRACK_LD + axis));
        if (L_H > LEAST_L * nominal_H[axis]) t->step_A_per_V[axis] = c->dt_s / L_H;
    }
}

bool dqw_tracker_waits(const dqw_tracker *t)
{
    return *(const volatile bool *)&t->pending;
}

void dqw_tracker_release(dqw_tracker *t)
{
    *(volatile bool *)&t->pending = false;
}

bool dqw_tracker_learn(dqw_tracker *t)
{
    if (!dqw_tracker_waits(t)) return false;
    const bool learned = dqw_tracker_learn_held(t);
    dqw_tracker_release(t);
    return learned;
}

bool dqw_tracker_learn_held(dqw_tracker *t)
{
    const dqw_tracker_config *c = t->config;
    const uint32_t elapsed = t->halves - t->at;
    t->at += elapsed;

    // [TRK.4] inputs of both axes
    const dqw_block b = exact_block(t);
    float x_d[N];
    float x_q[N];
    rows_of(t, &b, x_d, x_q);
    input_noise noise;
    noise_of(t, &b, &noise);

    if (c->dead_time_width_A > 0.0f) {
        const float sd = sqrtf(0.5f * dqw_noise_variance(t->noise.i_d_A2 + t->noise.i_q_A2));
        t->follow = c->dead_time_width_A / (c->dead_time_width_A + FOLLOW * sd);
    }

    // [TRK.5] what can be learned from this block; its signals are within ten bases, the gate saw to that
    uint32_t mask[2];
    choose(t, x_d, x_q, &noise, mask);
    if ((mask[D] | mask[Q]) == 0 || t->noise.rows < WARM_UP) {
        drift(t, elapsed);
        return false;
    }
    if (t->gate.blocks < UINT32_MAX) t->gate.blocks++;
    if (t->blocks < UINT16_MAX) t->blocks++;

    // [TRK.6] both rows, then the noise of their inputs, then what may have drifted
    const float common = common_variance(t);
    float ratio[2];
    for (int axis = 0; axis < 2; axis++) ratio[axis] = t->blocks > FEW_BLOCKS ? variance(t, axis) / common : 1.0f;
    float score[DQW_TRACK_SCORES] = {0};
    learn_row(t, D, x_d, mask[D], b.v_d_V / c->v_base_V, ratio[D], score);
    learn_row(t, Q, x_q, mask[Q], b.v_q_V / c->v_base_V, ratio[Q], score);
    keep_scores(t, score);
    if (c->noise_on_inputs) take_noise_out(t, &noise, ratio, mask);
    if (!sound(t)) return false;
    publish(t);
    drift(t, elapsed);
    return true;
}
