// What the estimator does in the background: learn a block, and say what was learned.
#include <math.h>
#include <stddef.h>

#include "dqw_estimator_block.h"
#include "dqw_estimator_random.h"
#include "dqw_number.h"

#define EXCITATION_PU 0.01f
#define EXCITATION_SETTLED_PU 0.002f
// A weight whose variance fell by less than this was not learned.
#define LEARNED_RATIO 0.01f
// A smaller residual is the sampling's own, and rounding.
#define VARIANCE_FLOOR_PU2 1e-8f
// Settled rows have no sampling: single precision's rounding.
#define VARIANCE_FLOOR_SETTLED_PU2 1e-13f
// Blocks over which statistics are means.
#define MEMORY 1000.0f
#define RECENT_PART (1.0f / 64.0f)
#define FEW_BLOCKS 50u
// Blocks of stage 2 without lent memory; and how far what they found may be from the start values, either way, for these to stand.
#define COARSE_BLOCKS 50u
#define COARSE_RATIO 1.5f
#define LAG_MAX 0.98f
#define LAG_MIN -0.4f
// Rows that only measure the noise: its variance is then known to an eighth.
#define WARM_UP 400u
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
// Currents are followed so fast that the noise left is about as wide as the step that dead time makes of them.
#define FOLLOW 0.7f
// An inductance is handed to the interrupt where its deviation is below this part of it; beyond this ratio to the one in use, either way, the noise
// was measured with a wrong one.
#define PUBLISHED_SD 0.2f
#define PUBLISHED_RATIO 1.25f
// A weight is known where its deviation is below this part of it; usable where three are below a tenth.
#define USABLE_SD (0.1f / 3.0f)
#define KNOWN_RATIO 0.25f
// The period by which a voltage is late counts as 0 or 1 within this, and this deviation.
#define LATE_NEAR 0.35f
#define LATE_SD 0.16f

enum { D = 0, Q = 1 };

// The flux of the other axis' current in a row, and the magnet's own: with the pole pairs not known yet, weights of their own (dqw_poles.c).
static int cross_of(const dqw_estimator *e, int axis)
{
    if (e->pole_pairs == 0 && !e->config->settled) return axis == Q ? DQW_POLES_LD : DQW_POLES_LQ;
    return axis == Q ? DQW_LD : DQW_LQ;
}

static int flux_of(int axis)
{
    return axis == Q ? DQW_PSI : DQW_PSI_Q;
}

static bool has_flux_q(const dqw_estimator *e)
{
    return e->config->encoder_offset && cross_of(e, D) == DQW_LQ;
}

static bool has_dead_time(const dqw_estimator *e)
{
    return e->dead_time_width_A > 0.0f && cross_of(e, D) == DQW_LQ;
}

float dqw_estimator_value(const dqw_estimator *e, int weight)
{
    return e->w_pu[weight] * dqw_estimator_unit(e, weight);
}

static float variance(const dqw_estimator *e, int axis)
{
    const float least = e->config->settled ? VARIANCE_FLOOR_SETTLED_PU2 : VARIANCE_FLOOR_PU2;
    return e->error_pu2[axis] > least ? e->error_pu2[axis] : least;
}

static float common_variance(const dqw_estimator *e)
{
    return 0.5f * (variance(e, D) + variance(e, Q));
}

// Weights of which something was learned.
static int learned_count(const dqw_estimator *e)
{
    int n = 0;
    for (int i = 0; i < e->inputs; i++) n += (int)(e->learned >> i & 1u);
    return n;
}

// Blocks overlap by half, so that next ones are alike, or unlike, in what they teach a weight: that widens or narrows its deviation. Dead
// time goes with the current as R does, the flux on the other axis with the speed as the flux. (E61) Settled rows do not overlap: there a
// residual that goes on is the model's, for as long as it lasts. (E20)
static float inflation(const dqw_estimator *e, int i)
{
    const int score = i >= DQW_PARAMETERS ? i - DQW_PARAMETERS + 4 : i == DQW_DEAD_TIME ? DQW_R : i == DQW_PSI_Q ? DQW_PSI : i;
    if (!(e->score2[score] > 0.0f)) return 1.0f;
    const float r = e->score_lag[score] / e->score2[score];
    const float bounded = r < LAG_MIN ? LAG_MIN : r > LAG_MAX ? LAG_MAX : r;
    if (!e->config->settled) return 1.0f + 2.0f * bounded;
    return bounded > 0.0f ? (1.0f + bounded) / (1.0f - bounded) : 1.0f;
}

float dqw_estimator_sd(const dqw_estimator *e, int weight)
{
    // Rows less weights: of few settled ones each counts.
    const float rows = 2.0f * (float)e->blocks;
    const float freedom = rows - (float)learned_count(e);
    const float least = e->config->settled ? 1.0f : 2.0f * (float)e->inputs;
    if ((e->learned >> weight & 1u) == 0 || freedom < least) return DQW_UNKNOWN;
    const float v = dqw_gain_covariance(&e->gain, weight, weight) * common_variance(e) * inflation(e, weight) * (rows / freedom);
    return sqrtf(v) * dqw_estimator_unit(e, weight);
}

float dqw_estimator_residual_pu(const dqw_estimator *e)
{
    return sqrtf(dqw_noise_variance(e->error_pu2[D]) + dqw_noise_variance(e->error_pu2[Q]));
}

float dqw_estimator_recent_pu(const dqw_estimator *e)
{
    return sqrtf(e->recent_pu2);
}

// Is it a parameter that these rows and this configuration can tell?
static bool has(const dqw_estimator *e, int parameter)
{
    if (e->pole_pairs == 0 && parameter != DQW_R && (e->config->settled || parameter > DQW_LQ)) return false;
    return true;
}

dqw_reading dqw_estimator_read(const dqw_estimator *e, enum dqw_parameter parameter)
{
    dqw_reading r = {.value = 0.0f, .sd = DQW_UNKNOWN, .sd_change = DQW_UNKNOWN, .usable = false};
    if ((unsigned)parameter >= DQW_PARAMETERS) return r;
    r.value = dqw_estimator_value(e, (int)parameter);
    if (!has(e, (int)parameter)) return r;
    r.sd = r.sd_change = dqw_estimator_sd(e, (int)parameter);
    const bool either_sign = parameter == DQW_DEAD_TIME || parameter == DQW_PSI_Q;
    const float size = either_sign ? fabsf(r.value) : r.value;
    r.usable = r.sd < USABLE_SD * size;
    return r;
}

uint16_t dqw_estimator_pole_pairs(const dqw_estimator *e)
{
    return e->pole_pairs;
}

dqw_block dqw_estimator_means(const dqw_estimator *e, const dqw_estimator_block *b)
{
    const float *m = b->sum;
    const float rate = 1.0f / e->config->dt_s;
    const dqw_block means = {m[0], m[1], 0.5f * m[2], 0.5f * m[3], rate * m[4], rate * m[5], 0.5f * m[6], 0.5f * m[7], 0.5f * m[8]};
    return means;
}

static dqw_block exact(const dqw_estimator *e, const dqw_estimator_block *b)
{
    dqw_block means = dqw_estimator_means(e, b);
    if (e->blocks <= 10 || e->config->settled) return means;
    // While the pole pairs are not known, as their weight has them.
    const float p = e->pole_pairs != 0 ? (float)e->pole_pairs : e->w_pu[DQW_POLES_LQ] / e->w_pu[DQW_LQ];
    const dqw_machine known = {dqw_estimator_value(e, DQW_R), dqw_estimator_value(e, DQW_LD), dqw_estimator_value(e, DQW_LQ), p};
    if (known.R_ohm > 0.0f && p > 0.0f) dqw_model_bow(&means, &known, e->config->dt_s);
    return means;
}

// Mean slope of dead time's input times the delay of the currents that it saw, s/A.
static float late_dead(const dqw_estimator *e, const dqw_estimator_block *b)
{
    return b->dead_slope_inv_A * e->config->dt_s * (1.0f / b->follow - 1.0f);
}

static float turns_of(const dqw_estimator *e)
{
    return e->pole_pairs != 0 ? (float)e->pole_pairs : 1.0f;
}

static void rows_of(const dqw_estimator *e, const dqw_estimator_block *b, const dqw_block *m, float x_d[], float x_q[])
{
    const float p = turns_of(e);
    for (int i = 0; i < DQW_PARAMETERS; i++) x_d[i] = x_q[i] = 0.0f;
    x_d[DQW_R] = m->i_d_A;
    x_q[DQW_R] = m->i_q_A;
    x_d[DQW_LD] = m->di_d_A_s;
    x_q[DQW_LQ] = m->di_q_A_s;
    x_d[cross_of(e, D)] += -p * m->wi_q_A_rad_s;
    x_q[cross_of(e, Q)] += p * m->wi_d_A_rad_s;
    x_q[DQW_PSI] = p * m->w_m_rad_s;
    if (has_dead_time(e)) {
        // Dead time's input saw the currents late: on average that is its mean slope times the delay times the current's.
        const float late_s_A = late_dead(e, b);
        x_d[DQW_DEAD_TIME] = 0.5f * b->sum[DQW_BLOCK_SIGNALS] + late_s_A * m->di_d_A_s;
        x_q[DQW_DEAD_TIME] = 0.5f * b->sum[DQW_BLOCK_SIGNALS + 1] + late_s_A * m->di_q_A_s;
    }
    if (has_flux_q(e)) x_d[DQW_PSI_Q] = p * m->w_m_rad_s;
#if DQW_EFFECT_WEIGHTS > 0
    for (int i = 0; i < e->effect.weights; i++) {
        x_d[DQW_PARAMETERS + i] = b->sum[DQW_PLAIN_SIGNALS + 2 * i];
        x_q[DQW_PARAMETERS + i] = b->sum[DQW_PLAIN_SIGNALS + 2 * i + 1];
    }
    if (!e->config->settled) dqw_effect_inputs(&e->effect, m, x_d + DQW_PARAMETERS, x_q + DQW_PARAMETERS);
#endif
    const float to_pu = 1.0f / e->config->v_base_V;
    for (int i = 0; i < e->inputs; i++) {
        const float unit = dqw_estimator_unit(e, i) * to_pu;
        x_d[i] *= unit;
        x_q[i] *= unit;
    }
}

// Variances of the noise of a block's inputs, per unit; the covariance of the speed's two inputs in a row, the other axis' inductance and the
// flux; and those of dead time's with R's. (E60)
typedef struct input_noise {
    float var[2][DQW_PARAMETERS];
    float speed[2];
    float dead_in_R[2], R_in_dead[2];
} input_noise;

static void noise_of_dead_time(const dqw_estimator *e, const dqw_estimator_block *b, int axis, float var_i, float mean, const float s[], input_noise *n)
{
    const float width = e->dead_time_width_A;
    const float g = mean * b->dead_slope_inv_A * s[DQW_DEAD_TIME];
    const float left = var_i * b->follow / (2.0f - b->follow);
    const float sd = sqrtf(left);
    // Where what is left of the current's noise is wide, that of a step; where narrow, tanh's own; and all of it where the currents stay
    // within the width. In the resistance's equation a wide noise also smooths the step, which takes half.
    const float wide = 0.53f / (sd + 1.2f * width);
    n->var[axis][DQW_DEAD_TIME] = g * var_i * (b->dead_slope_inv_A > wide ? b->dead_slope_inv_A : wide) * s[DQW_DEAD_TIME];
    n->R_in_dead[axis] = g * s[DQW_R] * var_i;
    n->dead_in_R[axis] = g * s[DQW_R] * (var_i - 0.5f * left * sd / (sd + width));
}

static void noise_of(const dqw_estimator *e, const dqw_estimator_block *b, const dqw_block *m, input_noise *n)
{
    const dqw_estimator_config *c = e->config;
    const float h = (float)e->window.half;
    const float p = turns_of(e);
    const float sum = h * (h + 1.0f);
    const float mean = (h * (4.0f * h * h - 1.0f) / 6.0f + h * h) / (sum * sum);
    const float slope = 2.0f * h / (c->dt_s * c->dt_s * sum * sum);
    const float var_i[2] = {dqw_noise_variance(b->noise.i_d_A2), dqw_noise_variance(b->noise.i_q_A2)};
    const float i[2] = {m->i_d_A, m->i_q_A};
    const float turn = mean * p * p;
    const float flux = turn * dqw_noise_variance(b->noise.w_rad2_s2);
    float s[DQW_PARAMETERS];
    for (int k = 0; k < DQW_PARAMETERS; k++) s[k] = dqw_estimator_unit(e, k) / c->v_base_V;
    for (int axis = 0; axis < 2; axis++) {
        // cppcheck-suppress uninitvar; every element is set below
        float *var = n->var[axis];
        const int other = 1 - axis;
        const int cross = cross_of(e, axis);
        const bool has_flux = axis == Q || has_flux_q(e);
        for (int k = 0; k < DQW_PARAMETERS; k++) var[k] = 0.0f;
        var[DQW_R] = mean * var_i[axis];
        var[DQW_LD + axis] = slope * var_i[axis];
        var[cross] = turn * m->w_m_rad_s * m->w_m_rad_s * var_i[other] + flux * (i[other] * i[other] + var_i[other]);
        if (has_flux) var[flux_of(axis)] = flux;
        for (int k = 0; k < DQW_PARAMETERS; k++) var[k] *= s[k] * s[k];
        n->speed[axis] = has_flux ? (axis == Q ? flux * m->i_d_A : -flux * m->i_q_A) * s[cross] * s[flux_of(axis)] : 0.0f;
        n->dead_in_R[axis] = n->R_in_dead[axis] = 0.0f;
        if (has_dead_time(e)) noise_of_dead_time(e, b, axis, var_i[axis], mean, s, n);
    }
}

// Noise of the inputs turns the gradient by C w: put back. Not where it is much of what was learned, there it could run away. (E60)
static void take_noise_out(dqw_estimator *e, const input_noise *n, const float ratio[2], const uint32_t mask[2])
{
    float z[DQW_ESTIMATOR_INPUTS] = {0};
    for (int axis = 0; axis < 2; axis++) {
        const float by = 1.0f / ratio[axis];
        for (int i = 0; i < DQW_PARAMETERS; i++)
            if ((mask[axis] >> i & 1u) != 0) z[i] += n->var[axis][i] * by;
    }
    for (int i = 0; i < DQW_PARAMETERS; i++) {
        if (z[i] * dqw_gain_covariance(&e->gain, i, i) > NOISE_PART_MAX) return;
        z[i] *= e->w_pu[i];
    }
    for (int axis = 0; axis < 2; axis++) {
        const float by = 1.0f / ratio[axis];
        if (has_dead_time(e)) {
            z[DQW_R] += n->dead_in_R[axis] * by * e->w_pu[DQW_DEAD_TIME];
            z[DQW_DEAD_TIME] += n->R_in_dead[axis] * by * e->w_pu[DQW_R];
        }
        const int L = cross_of(e, axis);
        const int flux = flux_of(axis);
        if ((mask[axis] >> L & mask[axis] >> flux & 1u) == 0) continue;
        z[L] += n->speed[axis] * by * e->w_pu[flux];
        z[flux] += n->speed[axis] * by * e->w_pu[L];
    }
    float move[DQW_ESTIMATOR_INPUTS];
    dqw_gain_apply(&e->gain, z, move);
    for (int i = 0; i < e->inputs; i++) e->w_pu[i] += move[i];
}

// Part of a mean that a block is: while it is young, later blocks count for more, for the first ones are about the start values.
static float part_of(const dqw_estimator *e)
{
    const float part = 2.0f / ((float)e->blocks + 1.0f);
    return part > 1.0f / MEMORY ? part : 1.0f / MEMORY;
}

// The same gain learns what of the late voltage the inputs explain; the rest, against the residual, is by how many periods it is late. (E90)
static void learn_late(dqw_estimator *e, const float x[], const float k[], float late_pu, float error_pu, float left)
{
    float rest = late_pu;
    for (int i = 0; i < DQW_PARAMETERS; i++) rest -= e->late_w[i] * x[i];
    for (int i = 0; i < DQW_PARAMETERS; i++) e->late_w[i] += k[i] * rest;
    e->late_pu2 += (rest * rest * left - e->late_pu2) * part_of(e);
    e->late_error_pu2 += (error_pu * rest * left - e->late_error_pu2) * part_of(e);
}

// One axis' row through the joint neuron: predict, compare, correct; weighed by how little of that axis is noise.
static void learn_row(dqw_estimator *e, int axis, const dqw_estimator_rows *r, uint32_t mask, float ratio, const float *late_pu, float score[])
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
        e->w_pu[i] += k[i] * (error * weigh);
        seen += k[i] * x[i];
    }
    // seen rounds to above 1 where next to nothing was known.
    const float left = seen < 1.0f ? 1.0f - seen : 0.0f;
    const float after = error * left;
    for (int i = 0; i < e->inputs; i++) {
        const int at = i >= DQW_PARAMETERS ? i - DQW_PARAMETERS + 4 : i < 4 ? i : -1;
        if (at >= 0) score[at] += x[i] * (after * weigh);
    }
    e->error_pu2[axis] += (error * after - e->error_pu2[axis]) * part_of(e);
    e->e_pu[axis] = error;
    if (late_pu != NULL) learn_late(e, x, k, late_pu[axis] * weigh, error * weigh, left);
}

static void keep_scores(dqw_estimator *e, const float score[])
{
    const float part = part_of(e);
    for (int i = 0; i < DQW_ESTIMATOR_SCORES; i++) {
        e->score2[i] += (score[i] * score[i] - e->score2[i]) * part;
        e->score_lag[i] += (score[i] * e->score_last[i] - e->score_lag[i]) * part;
        e->score_last[i] = score[i];
    }
}

// How large a parameter is, per unit: what it may wander is a part of that.
static float size_pu(const dqw_estimator *e, int i)
{
    if (i == DQW_DEAD_TIME && has_dead_time(e)) return dqw_estimator_start_sd_pu(e, DQW_DEAD_TIME) * (1.0f / 3.0f);
    return fabsf(e->w_pu[i == DQW_PSI_Q && has_flux_q(e) ? DQW_PSI : i]);
}

// A parameter may wander: its variance grows with time, here in halves of a window, up to three of its size. (E61)
static void drift(dqw_estimator *e)
{
    const float rate = e->config->drift_per_sqrt_s;
    if (!(rate > 0.0f) || e->config->settled) return;
    const float widest = 1.0f / common_variance(e);
    float unit = rate * rate * (float)e->elapsed * (float)e->window.half * e->config->dt_s;
    if (unit > 9.0f) unit = 9.0f;
    for (int i = 0; i < e->inputs; i++) {
        const float size = size_pu(e, i);
        if (dqw_gain_covariance(&e->gain, i, i) < 9.0f * widest * size * size) dqw_gain_grow(&e->gain, i, unit * widest * size * size);
    }
}

// Inputs large enough to teach their weight, by their power above the noise: a choice by the mean and not by the block, which would bias. A settled
// row stands for itself.
static void choose(dqw_estimator *e, const dqw_estimator_rows *r, const input_noise *n, uint32_t mask[2])
{
    const dqw_estimator_config *c = e->config;
    const float usual = c->settled ? EXCITATION_SETTLED_PU : EXCITATION_PU;
    const float threshold = c->excitation_pu > 0.0f ? c->excitation_pu : usual;
    const float width_pu = has_dead_time(e) ? e->dead_time_width_A / c->i_base_A : 0.0f;
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
        if (i < DQW_PARAMETERS) least += NOISE_MARGIN * (n->var[D][i] + n->var[Q][i]);
        // Among currents as small as dead time's step, its shape decides what is left for R.
        if (i == DQW_R) least += STEP_MARGIN * width_pu * width_pu;
        const float power = d * d + q * q;
        const float excess = (power < EXCESS_MAX * least ? power / least : EXCESS_MAX) - 1.0f;
        const float mean = (float)e->excess_q10[i] * (1.0f / 1024.0f);
        e->excess_q10[i] = (int16_t)((mean + (excess - mean) * EXCESS_PART) * 1024.0f);
        if (e->excess_q10[i] <= 0) continue;
        if (d != 0.0f) mask[D] |= 1u << i;
        if (q != 0.0f) mask[Q] |= 1u << i;
    }
    // There the other weights would take up what is wrong with dead time's shape.
    if (!c->settled && width_pu > 0.0f && e->excess_q10[DQW_R] <= 0) mask[D] = mask[Q] = 0;
}

// What has left all bounds begins again; what was learned for the first time is noted.
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

// What the interrupt takes: the voltage's part in a step, from an L that is known, and how fast dead time's input follows the currents.
static void publish(dqw_estimator *e, const dqw_estimator_block *b)
{
    volatile dqw_estimator_given *g = &e->given;
    const bool waits = *(volatile bool *)&e->given_ready;
    *(volatile bool *)&e->given_ready = false;
    bool noise_anew = waits && g->noise_anew;
    for (int axis = 0; axis < 2; axis++) {
        const float L_H = dqw_estimator_value(e, DQW_LD + axis);
        if (!(dqw_estimator_sd(e, DQW_LD + axis) < PUBLISHED_SD * L_H)) continue;
        const float step = e->config->dt_s / L_H;
        const float last = g->step_A_per_V[axis];
        if (step > PUBLISHED_RATIO * last || last > PUBLISHED_RATIO * step) noise_anew = true;
        g->step_A_per_V[axis] = step;
    }
    if (e->dead_time_width_A > 0.0f) {
        const float sd = sqrtf(0.5f * dqw_noise_variance(b->noise.i_d_A2 + b->noise.i_q_A2));
        g->follow = e->dead_time_width_A / (e->dead_time_width_A + FOLLOW * sd);
    }
    g->noise_anew = noise_anew;
    *(volatile bool *)&e->given_ready = true;
}

bool dqw_estimator_take(dqw_estimator *e, dqw_estimator_block *b)
{
    if (!dqw_window_waits(&e->window)) return false;
    float v_V[2];
    const uint32_t before = e->rise.valid;
    uint32_t event = dqw_window_join(&e->window, &e->rise, b->sum, v_V);
    const dqw_estimator_handed h = *(const volatile dqw_estimator_handed *)&e->handed;
    dqw_window_release(&e->window);
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
    b->follow = h.follow;
    b->noise = h.noise;
    b->whole = before == e->window.half && e->rise.valid == e->window.half;
    e->rise_cosine = h.cosine;
    e->rise_sine = h.sine;
    e->rise_v_V[0] = v_V[0];
    e->rise_v_V[1] = v_V[1];
    e->noise_rows = h.noise.rows;
    if (event == DQW_EVENT_INCOMPLETE && e->gate.incomplete < UINT32_MAX) e->gate.incomplete++;
    if (event != DQW_EVENT_BLOCK) return false;
    e->elapsed = h.number - e->number;
    e->number = h.number;
    return true;
}

// A voltage one period late differs from that in time by this much, per unit: the triangle's weight steps by one a pair. One that is held in the
// stationary frame is turned besides; one that is given in the frame of its own period is not. (E90)
static void late_of(const dqw_estimator *e, const dqw_estimator_block *b, const dqw_block *m, float late_pu[2])
{
    const float h = (float)e->window.half;
    const float scale = 1.0f / (h * (h + 1.0f));
    const float turn = e->config->voltage_held ? (float)e->pole_pairs * m->w_m_rad_s * e->config->dt_s : 0.0f;
    late_pu[D] = (b->v_step_V[D] * scale - turn * m->v_q_V) / e->config->v_base_V;
    late_pu[Q] = (b->v_step_V[Q] * scale + turn * m->v_d_V) / e->config->v_base_V;
}

static uint32_t ppm(float ratio)
{
    return ratio < 4000.0f ? (uint32_t)(ratio * 1e6f) : 4000000000u;
}

void dqw_estimator_stage_on(dqw_estimator *e, bool random_converged)
{
    const dqw_stage_input in = {
        .random_converged = random_converged,
        .residual_ppm = ppm(dqw_estimator_recent_pu(e)),
        .residual_recent_ppm = ppm(dqw_estimator_recent_pu(e)),
    };
    (void)dqw_stage_step(&e->stage, in);
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

// Without: the first blocks in their order. What is far from the start values had its part in all that was learned until now, for the noise of
// the inputs goes with the weights: then stage 3 begins from what was found, else it goes on. Settled rows have no such part, and each counts.
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

    // [EST.4] inputs of both axes
    const dqw_block m = exact(e, b);
    dqw_estimator_rows r;
    rows_of(e, b, &m, r.x[D], r.x[Q]);
    r.y[D] = m.v_d_V / c->v_base_V;
    r.y[Q] = m.v_q_V / c->v_base_V;
    input_noise noise = {.speed = {0.0f}};
    if (!c->settled) noise_of(e, b, &m, &noise);

    // [EST.5] what can be learned from this block; its signals are within ten bases, the gate saw to that
    uint32_t mask[2];
    choose(e, &r, &noise, mask);
    const bool warm = c->settled || !c->noise_on_inputs || b->noise.rows >= WARM_UP;
    if ((mask[D] | mask[Q]) == 0 || !warm) {
        drift(e);
        return false;
    }
    if (e->stage.name == DQW_STAGE_RANDOM && c->random != NULL) return random_stage(e, &r);
    if (e->gate.blocks < UINT32_MAX) e->gate.blocks++;
    if (e->blocks < UINT16_MAX) e->blocks++;

    // [EST.6] both rows, then the noise of their inputs, then what may have drifted
    const float common = common_variance(e);
    float ratio[2];
    for (int axis = 0; axis < 2; axis++) ratio[axis] = !c->settled && e->blocks > FEW_BLOCKS ? variance(e, axis) / common : 1.0f;
    float late_pu[2];
    const bool looks_late = !c->settled && e->pole_pairs != 0 && b->whole;
    if (looks_late) late_of(e, b, &m, late_pu);
    float score[DQW_ESTIMATOR_SCORES] = {0};
    learn_row(e, D, &r, mask[D], ratio[D], looks_late ? late_pu : NULL, score);
    learn_row(e, Q, &r, mask[Q], ratio[Q], looks_late ? late_pu : NULL, score);
    keep_scores(e, score);
    e->recent_pu2 += (e->e_pu[D] * e->e_pu[D] + e->e_pu[Q] * e->e_pu[Q] - e->recent_pu2) * RECENT_PART;
    if (c->noise_on_inputs && !c->settled) take_noise_out(e, &noise, ratio, mask);
    if (!sound(e)) return false;
    if (!c->settled) publish(e, b);
    drift(e);
    if (e->stage.name == DQW_STAGE_RANDOM) coarse_stage(e);
    return true;
}

enum dqw_voltage_acts dqw_estimator_voltage_acts(const dqw_estimator *e)
{
    if (!(e->late_pu2 > 0.0f) || e->blocks < FEW_BLOCKS) return DQW_VOLTAGE_NOT_KNOWN;
    const float periods = e->late_error_pu2 / e->late_pu2;
    const float sd = sqrtf(common_variance(e) * part_of(e) / e->late_pu2 * inflation(e, DQW_R));
    const bool next = e->config->voltage_next;
    if (!(sd < LATE_SD)) return DQW_VOLTAGE_NOT_KNOWN;
    if (fabsf(periods) < LATE_NEAR) return next ? DQW_VOLTAGE_NEXT : DQW_VOLTAGE_NOW;
    if (!next && fabsf(periods - 1.0f) < LATE_NEAR) return DQW_VOLTAGE_NEXT;
    if (next && fabsf(periods + 1.0f) < LATE_NEAR) return DQW_VOLTAGE_NOW;
    return DQW_VOLTAGE_NOT_KNOWN;
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

#if DQW_EFFECT_WEIGHTS > 0
int dqw_estimator_read_effect(const dqw_estimator *e, int index, float weights[], float sd[])
{
    if (index < 0 || index >= e->config->effect_count) return DQW_ERR_SIZE;
    const dqw_effect_config *list = e->config->effects;
    int first = DQW_PARAMETERS;
    for (int k = 0; k < index; k++) first += dqw_effect_weights_of(&e->effect, list[k].effect);
    if (list[index].effect == DQW_EFFECT_DEAD_TIME) first = DQW_DEAD_TIME;
    const int n = dqw_effect_weights(list[index].effect);
    for (int i = 0; i < n; i++) {
        weights[i] = dqw_estimator_value(e, first + i);
        sd[i] = dqw_estimator_sd(e, first + i);
    }
    return (int)dqw_effect_known(weights, sd, n);
}
#else
int dqw_estimator_read_effect(const dqw_estimator *e, int index, float weights[], float sd[])
{
    (void)e;
    (void)index;
    (void)weights;
    (void)sd;
    return DQW_ERR_SIZE;
}
#endif
