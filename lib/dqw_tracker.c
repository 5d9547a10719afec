#include "dqw_tracker.h"

#include <math.h>
#include <stddef.h>

#include "dqw_transform.h"

#define HALF_WINDOW 20
#define EXCITATION_PU 0.002f
#define WILD 10.0f
// Start variance of a per-unit weight, per unit of residual variance: a start value is no prior.
#define P0 1e6f
// A weight whose variance fell by less than this was not learned.
#define LEARNED_RATIO 0.01f
#define VARIANCE_FLOOR_PU2 1e-13f
#define MEMORY 1000u
#define LAG_MAX 0.98f
#define LAG_MIN -0.4f
// How much more one axis may count than the other.
#define RATIO_MAX 1e4f
#define BLOCK_MAX_PU 1e5f
// Angles beyond this have lost their fraction of a turn in single precision.
#define THETA_MAX_RAD 1e5f

// Currents are followed so fast that the noise left is about as wide as the step that dead time makes of them.
#define FOLLOW 0.7f
// Mean over about 4096 samples.
#define SLOPE_PART (1.0f / 4096.0f)

enum { D = 0, Q = 1 };

static bool positive(float x)
{
    return isfinite(x) && x > 0.0f;
}

static bool zero_or_positive(float x)
{
    return isfinite(x) && x >= 0.0f;
}

static int half_of(const dqw_tracker_config *c)
{
    return c->half_window != 0 ? c->half_window : HALF_WINDOW;
}

enum dqw_status dqw_tracker_init(dqw_tracker *t, const dqw_tracker_config *config)
{
    if (t == NULL || config == NULL) return DQW_ERR_NULL;
    const dqw_tracker_config *c = config;
    const float must[] = {c->dt_s, c->v_base_V, c->i_base_A, c->w_base_rad_s, c->R_ohm, c->Ld_H, c->Lq_H, c->psi_Wb};
    for (unsigned i = 0; i < sizeof must / sizeof must[0]; i++)
        if (!positive(must[i])) return DQW_ERR_RANGE;
    const float may[] = {c->v_limit_V, c->i_limit_A, c->excitation_pu, c->dead_time_width_A, c->drift_per_sqrt_s};
    for (unsigned i = 0; i < sizeof may / sizeof may[0]; i++)
        if (!zero_or_positive(may[i])) return DQW_ERR_RANGE;
    if (c->pole_pairs == 0) return DQW_ERR_RANGE;

    const float p = (float)c->pole_pairs;
    const float turning = p * c->w_base_rad_s;
    const dqw_learner_config neuron = {
        .inputs = DQW_TRACK_WEIGHTS,
        .step_size = 0.5f,
        .x_base = {c->i_base_A, c->i_base_A * turning, c->i_base_A * turning, turning, 1.0f, turning},
        .y_base = c->v_base_V,
    };
    dqw_tracker n = {.config = config};
    enum dqw_status status = dqw_learner_init(&n.neuron, &neuron);
    if (status == DQW_OK) status = dqw_gain_init(&n.gain, DQW_TRACK_WEIGHTS, P0);
    if (status == DQW_OK) status = dqw_window_init(&n.window, half_of(c), DQW_TRACK_SIGNALS);
    const float start[] = {c->R_ohm, c->Ld_H, c->Lq_H, c->psi_Wb};
    for (int i = 0; status == DQW_OK && i < 4; i++) status = dqw_learner_set_weight(&n.neuron, i, start[i]);
    if (status != DQW_OK) return status;
    dqw_gate_init(&n.gate, c->stale_limit);
    dqw_noise_init(&n.noise);
    n.follow = 1.0f;
    n.inverse_Ld = 1.0f / c->Ld_H;
    n.inverse_Lq = 1.0f / c->Lq_H;
    *t = n;
    return DQW_OK;
}

static bool beyond(float x, float limit)
{
    return fabsf(x) > limit;
}

static uint32_t admit(dqw_tracker *t, const dqw_sample *s, bool saturated)
{
    const dqw_tracker_config *c = t->config;
    const float v_limit = c->v_limit_V > 0.0f ? c->v_limit_V : WILD * c->v_base_V;
    const float i_limit = c->i_limit_A > 0.0f ? c->i_limit_A : WILD * c->i_base_A;
    const dqw_gate_sample g = {
        .finite = isfinite(s->v_d_V) && isfinite(s->v_q_V) && isfinite(s->i_d_A) && isfinite(s->i_q_A) && isfinite(s->w_m_rad_s) &&
                  (!c->angle || fabsf(s->theta_e_rad) < THETA_MAX_RAD),
        .saturated = saturated || beyond(s->v_d_V, v_limit) || beyond(s->v_q_V, v_limit) || beyond(s->i_d_A, i_limit) || beyond(s->i_q_A, i_limit) ||
                     beyond(s->w_m_rad_s, WILD * c->w_base_rad_s),
        .repeated = t->has_last && s->i_d_A == t->last.i_d_A && s->i_q_A == t->last.i_q_A && s->w_m_rad_s == t->last.w_m_rad_s,
    };
    return dqw_gate_check(&t->gate, g);
}

// tanh to 2.4 %, bounded by 1.
static float soft_sign(float x)
{
    const float a = x > 3.0f ? 3.0f : x < -3.0f ? -3.0f : x;
    return a * (27.0f + a * a) / (27.0f + 9.0f * a * a);
}

// What an inverter with dead time takes from each phase per volt of it, as dq.
static void dead_time(dqw_tracker *t, const dqw_sample *s, float *d, float *q)
{
    if (!t->config->angle || !(t->config->dead_time_width_A > 0.0f)) {
        *d = *q = 0.0f;
        return;
    }
    float cosine;
    float sine;
    dqw_cosine_sine(s->theta_e_rad, &cosine, &sine);
    // Noise wider than the step would smooth it: so the noisier the currents, the slower they are followed here.
    if (!t->last_good) {
        t->slow_d_A = s->i_d_A;
        t->slow_q_A = s->i_q_A;
    }
    t->slow_d_A += t->follow * (s->i_d_A - t->slow_d_A);
    t->slow_q_A += t->follow * (s->i_q_A - t->slow_q_A);
    const dqw_dq i = {t->slow_d_A, t->slow_q_A};
    const dqw_abc phase = dqw_clarke_inverse(dqw_park_inverse(i, cosine, sine));
    const float k = 1.0f / t->config->dead_time_width_A;
    const dqw_abc lost = {soft_sign(k * phase.a), soft_sign(k * phase.b), soft_sign(k * phase.c)};
    const dqw_dq seen = dqw_park(dqw_clarke(lost), cosine, sine);
    *d = seen.d;
    *q = seen.q;
    // How much of it the current's noise moves, on average: what tanh gains at this current, (1 - tanh^2)/width.
    const float slope = k * (1.0f - (lost.a * lost.a + lost.b * lost.b + lost.c * lost.c) * (1.0f / 3.0f));
    t->dead_slope_inv_A += (slope - t->dead_slope_inv_A) * SLOPE_PART;
}

static void watch_noise(dqw_tracker *t, const dqw_sample *s)
{
    const float dt = t->config->dt_s;
    dqw_noise_step(&t->noise, s->i_d_A - t->last.i_d_A - dt * t->inverse_Ld * t->last.v_d_V, s->i_q_A - t->last.i_q_A - dt * t->inverse_Lq * t->last.v_q_V,
                   s->w_m_rad_s);
}

uint32_t dqw_tracker_sample(dqw_tracker *t, const dqw_sample *s, bool saturated)
{
    // [TRK.1] may this sample be learned
    uint32_t event = admit(t, s, saturated);
    const bool good = event == 0;
    float dead_d = 0.0f;
    float dead_q = 0.0f;
    if (good) dead_time(t, s, &dead_d, &dead_q);

    // [TRK.2] the pair that it ends, into the window
    const bool paired = good && t->last_good;
    float pair[DQW_TRACK_SIGNALS];
    if (paired) {
        const dqw_block b = dqw_model_pair(&t->last, s, t->config->dt_s);
        pair[0] = b.v_d_V;
        pair[1] = b.v_q_V;
        pair[2] = b.i_d_A;
        pair[3] = b.i_q_A;
        pair[4] = b.di_d_A_s;
        pair[5] = b.di_q_A_s;
        pair[6] = b.wi_d_A_rad_s;
        pair[7] = b.wi_q_A_rad_s;
        pair[8] = b.w_m_rad_s;
        pair[9] = 0.5f * (t->dead_d + dead_d);
        pair[10] = 0.5f * (t->dead_q + dead_q);
        watch_noise(t, s);
    } else {
        dqw_noise_gap(&t->noise);
    }
    float block[DQW_TRACK_SIGNALS];
    const uint32_t window = dqw_window_step(&t->window, paired ? pair : NULL, block);

    // [TRK.3] a block for the background
    if (window == DQW_EVENT_LEARNED) {
        if (t->pending) {
            if (t->missed < UINT32_MAX) t->missed++;
        } else {
            for (int i = 0; i < DQW_TRACK_SIGNALS; i++) t->block[i] = block[i];
            t->block_theta_rad = t->half_theta_rad;
            t->pending = true;
        }
    } else if (window == DQW_EVENT_INCOMPLETE && t->gate.incomplete < UINT32_MAX) {
        t->gate.incomplete++;
    }
    event |= window;
    if (t->window.at == 0) t->half_theta_rad = good ? s->theta_e_rad : NAN;
    t->has_last = true;
    t->last_good = good;
    t->last = *s;
    t->dead_d = dead_d;
    t->dead_q = dead_q;
    t->events |= event;
    return event;
}

void dqw_tracker_gap(dqw_tracker *t)
{
    t->has_last = t->last_good = false;
    dqw_noise_gap(&t->noise);
    dqw_window_restart(&t->window);
}

float dqw_tracker_value(const dqw_tracker *t, enum dqw_tracker_weight weight)
{
    return dqw_learner_weight(&t->neuron, (int)weight);
}

static float variance(const dqw_tracker *t, int axis)
{
    return t->error_pu2[axis] > VARIANCE_FLOOR_PU2 ? t->error_pu2[axis] : VARIANCE_FLOOR_PU2;
}

static float common_variance(const dqw_tracker *t)
{
    return 0.5f * (variance(t, D) + variance(t, Q));
}

// Blocks overlap by half, so that next ones are alike, or unlike, in what they teach a weight: that widens or narrows its deviation. (E61)
static float inflation(const dqw_tracker *t, int i)
{
    if (!(t->score2[i] > 0.0f)) return 1.0f;
    const float r = t->score_lag[i] / t->score2[i];
    return 1.0f + 2.0f * (r < LAG_MIN ? LAG_MIN : r > LAG_MAX ? LAG_MAX : r);
}

float dqw_tracker_sd(const dqw_tracker *t, enum dqw_tracker_weight weight)
{
    if ((unsigned)weight >= DQW_TRACK_WEIGHTS) return INFINITY;
    const int i = (int)weight;
    const float p = dqw_gain_covariance(&t->gain, i, i);
    if (!(p < LEARNED_RATIO * P0) || t->blocks < 2u * DQW_TRACK_WEIGHTS) return INFINITY;
    return sqrtf(p * common_variance(t) * inflation(t, i)) * t->neuron.y_base * t->neuron.x_scale[i];
}

float dqw_tracker_residual_pu(const dqw_tracker *t)
{
    return sqrtf(t->error_pu2[D] + t->error_pu2[Q]);
}

static float memory_of(const dqw_tracker *t)
{
    return (float)(t->blocks < MEMORY ? t->blocks : MEMORY);
}

// One axis' row through the joint neuron, weighed by how little of that axis is noise.
static void learn_row(dqw_tracker *t, int axis, const float x_pu[], float y_pu, float ratio, float score[])
{
    const float weigh = 1.0f / sqrtf(ratio);
    float x[DQW_TRACK_WEIGHTS];
    float k[DQW_TRACK_WEIGHTS];
    float e = y_pu;
    for (int i = 0; i < DQW_TRACK_WEIGHTS; i++) {
        e -= t->neuron.w_pu[i] * x_pu[i];
        x[i] = x_pu[i] * weigh;
    }
    dqw_gain_step(&t->gain, x, k);
    float seen = 0.0f;
    for (int i = 0; i < DQW_TRACK_WEIGHTS; i++) {
        t->neuron.w_pu[i] += k[i] * (e * weigh);
        seen += k[i] * x[i];
    }
    const float after = e * (1.0f - seen);
    for (int i = 0; i < DQW_TRACK_WEIGHTS; i++) score[i] += x[i] * (after * weigh);
    t->error_pu2[axis] += (e * after - t->error_pu2[axis]) / memory_of(t);
    t->e_pu[axis] = e;
}

// Noise of dead time's input, A per unit of its mean slope: where what is left of the noise is wide, that of a step; where narrow, tanh's own.
static float dead_noise(const dqw_tracker *t, float var_i)
{
    const float sd = sqrtf(var_i * t->follow / (2.0f - t->follow));
    return 0.53f * var_i / (sd + 1.2f * t->config->dead_time_width_A);
}

// How much of that is alike with the current's noise, in the resistance's equation: a wide noise also smooths the step, which takes half.
static float dead_alike(const dqw_tracker *t, float var_i)
{
    const float left = var_i * t->follow / (2.0f - t->follow);
    const float sd = sqrtf(left);
    return var_i - 0.5f * left * sd / (sd + t->config->dead_time_width_A);
}

// Mean slope of dead time's input times the delay of the currents that it sees, s/A.
static float late(const dqw_tracker *t)
{
    return t->dead_slope_inv_A * t->config->dt_s * (1.0f / t->follow - 1.0f);
}

static void follow_currents(dqw_tracker *t)
{
    const float width = t->config->dead_time_width_A;
    const float var_i = dqw_noise_variance(0.5f * (t->noise.i_d_A2 + t->noise.i_q_A2));
    t->follow = width / (width + FOLLOW * sqrtf(var_i));
}

// The noise of a block's inputs, as variances and the two covariances that do not vanish, turns the gradient by C w. (E60)
static void take_noise_out(dqw_tracker *t, const dqw_block *b, const float ratio[2], uint32_t mask_d, uint32_t mask_q)
{
    const dqw_tracker_config *c = t->config;
    const float h = (float)half_of(c);
    const float p = (float)c->pole_pairs;
    const float sum = h * (h + 1.0f);
    const float mean = (h * (4.0f * h * h - 1.0f) / 6.0f + h * h) / (sum * sum);
    const float slope = 2.0f * h / (c->dt_s * c->dt_s * sum * sum);
    const float var_d = dqw_noise_variance(t->noise.i_d_A2);
    const float var_q = dqw_noise_variance(t->noise.i_q_A2);
    const float var_w = dqw_noise_variance(t->noise.w_rad2_s2);
    const float w2 = b->w_m_rad_s * b->w_m_rad_s;
    const float cross_d = mean * p * p * (w2 * var_q + b->i_q_A * b->i_q_A * var_w + var_q * var_w);
    const float cross_q = mean * p * p * (w2 * var_d + b->i_d_A * b->i_d_A * var_w + var_d * var_w);
    const float turn = mean * p * p * var_w;
    const bool has_dead = c->dead_time_width_A > 0.0f;
    const float g = mean * t->dead_slope_inv_A;
    const float dead[2] = {has_dead ? g * dead_noise(t, var_d) : 0.0f, has_dead ? g * dead_noise(t, var_q) : 0.0f};
    const float noise_d[DQW_TRACK_WEIGHTS] = {mean * var_d, slope * var_d, cross_d, 0.0f, dead[D], c->angle ? turn : 0.0f};
    const float noise_q[DQW_TRACK_WEIGHTS] = {mean * var_q, cross_q, slope * var_q, turn, dead[Q], 0.0f};
    const float *s = t->neuron.x_scale;
    const float *w = t->neuron.w_pu;
    float z[DQW_TRACK_WEIGHTS];
    for (int i = 0; i < DQW_TRACK_WEIGHTS; i++) {
        z[i] = 0.0f;
        if (mask_d >> i & 1u) z[i] += noise_d[i] * s[i] * s[i] * w[i] / ratio[D];
        if (mask_q >> i & 1u) z[i] += noise_q[i] * s[i] * s[i] * w[i] / ratio[Q];
    }
    const float pair_d = -noise_d[DQW_TRACK_PSI_Q] * b->i_q_A * s[DQW_TRACK_LQ] * s[DQW_TRACK_PSI_Q] / ratio[D];
    const float pair_q = turn * b->i_d_A * s[DQW_TRACK_LD] * s[DQW_TRACK_PSI] / ratio[Q];
    if (has_dead) {
        const float pair_dead = g * s[DQW_TRACK_R] * s[DQW_TRACK_DEAD_TIME];
        z[DQW_TRACK_R] += pair_dead * w[DQW_TRACK_DEAD_TIME] * (dead_alike(t, var_d) / ratio[D] + dead_alike(t, var_q) / ratio[Q]);
        z[DQW_TRACK_DEAD_TIME] += pair_dead * w[DQW_TRACK_R] * (var_d / ratio[D] + var_q / ratio[Q]);
        const float late_d = late(t) * slope * var_d * s[DQW_TRACK_LD] * s[DQW_TRACK_DEAD_TIME] / ratio[D];
        const float late_q = late(t) * slope * var_q * s[DQW_TRACK_LQ] * s[DQW_TRACK_DEAD_TIME] / ratio[Q];
        z[DQW_TRACK_LD] += late_d * w[DQW_TRACK_DEAD_TIME];
        z[DQW_TRACK_LQ] += late_q * w[DQW_TRACK_DEAD_TIME];
        z[DQW_TRACK_DEAD_TIME] += late_d * w[DQW_TRACK_LD] + late_q * w[DQW_TRACK_LQ];
    }
    z[DQW_TRACK_LQ] += pair_d * w[DQW_TRACK_PSI_Q];
    z[DQW_TRACK_PSI_Q] += pair_d * w[DQW_TRACK_LQ];
    z[DQW_TRACK_LD] += pair_q * w[DQW_TRACK_PSI];
    z[DQW_TRACK_PSI] += pair_q * w[DQW_TRACK_LD];
    float move[DQW_TRACK_WEIGHTS];
    dqw_gain_apply(&t->gain, z, move);
    for (int i = 0; i < DQW_TRACK_WEIGHTS; i++) t->neuron.w_pu[i] += move[i];
}

static void drift(dqw_tracker *t)
{
    const float rate = t->config->drift_per_sqrt_s;
    if (!(rate > 0.0f)) return;
    const float unit = rate * rate * (float)half_of(t->config) * t->config->dt_s / (common_variance(t));
    // Inputs whose healthy weight is about zero drift as part of the flux' and the resistance's voltage at the bases.
    const float *w = t->neuron.w_pu;
    const float size[DQW_TRACK_WEIGHTS] = {w[DQW_TRACK_R],   w[DQW_TRACK_LD], w[DQW_TRACK_LQ],
                                           w[DQW_TRACK_PSI], w[DQW_TRACK_R],  w[DQW_TRACK_PSI]};
    for (int i = 0; i < DQW_TRACK_WEIGHTS; i++)
        if (dqw_gain_covariance(&t->gain, i, i) < P0) dqw_gain_grow(&t->gain, i, unit * size[i] * size[i]);
}

bool dqw_tracker_learn(dqw_tracker *t)
{
    if (!t->pending) return false;
    const dqw_tracker_config *c = t->config;
    const float *m = t->block;
    dqw_block b = {m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8]};
    // Dead time's input saw the currents late: on average that is its mean slope times the delay times the current's.
    const float late_s_A = late(t);
    const float dead[2] = {m[9] + late_s_A * b.di_d_A_s, m[10] + late_s_A * b.di_q_A_s};
    t->pending = false;

    // [TRK.4] inputs of both axes
    const dqw_parameters known = {.R_ohm = dqw_tracker_value(t, DQW_TRACK_R),
                                  .Ld_H = dqw_tracker_value(t, DQW_TRACK_LD),
                                  .Lq_H = dqw_tracker_value(t, DQW_TRACK_LQ),
                                  .pole_pairs = c->pole_pairs,
                                  .known = DQW_KNOWS_R | DQW_KNOWS_LD | DQW_KNOWS_LQ};
    if (t->blocks > 10 && known.Ld_H > 0.0f && known.Lq_H > 0.0f) {
        dqw_model_correct(&b, &known, c->dt_s);
        t->inverse_Ld = 1.0f / known.Ld_H;
        t->inverse_Lq = 1.0f / known.Lq_H;
    }
    const float p = (float)c->pole_pairs;
    float x_d[DQW_TRACK_WEIGHTS] = {b.i_d_A, b.di_d_A_s, -p * b.wi_q_A_rad_s, 0.0f, dead[D], c->angle ? p * b.w_m_rad_s : 0.0f};
    float x_q[DQW_TRACK_WEIGHTS] = {b.i_q_A, p * b.wi_d_A_rad_s, b.di_q_A_s, p * b.w_m_rad_s, dead[Q], 0.0f};

    // [TRK.5] what can be learned from this block
    const float threshold = c->excitation_pu > 0.0f ? c->excitation_pu : EXCITATION_PU;
    uint32_t mask_d = 0;
    uint32_t mask_q = 0;
    float size = 0.0f;
    for (int i = 0; i < DQW_TRACK_WEIGHTS; i++) {
        x_d[i] *= t->neuron.x_scale[i];
        x_q[i] *= t->neuron.x_scale[i];
        if (fabsf(x_d[i]) >= threshold) mask_d |= 1u << i;
        if (fabsf(x_q[i]) >= threshold) mask_q |= 1u << i;
        size += fabsf(x_d[i]) + fabsf(x_q[i]);
    }
    (void)dqw_gate_block(&t->gate, mask_d | mask_q, 0, DQW_TRACK_WEIGHTS);
    if ((mask_d | mask_q) == 0 || !(size < BLOCK_MAX_PU)) return false;
    if (t->gate.blocks < UINT32_MAX) t->gate.blocks++;
    if (t->blocks < UINT32_MAX) t->blocks++;

    // [TRK.6] both rows, then the noise of their inputs, then what may have drifted
    const float common = common_variance(t);
    float ratio[2];
    for (int axis = 0; axis < 2; axis++) {
        const float r = t->blocks > 50 ? variance(t, axis) / common : 1.0f;
        ratio[axis] = r < 1.0f / RATIO_MAX ? 1.0f / RATIO_MAX : r;
    }
    float score[DQW_TRACK_WEIGHTS] = {0};
    learn_row(t, D, x_d, b.v_d_V / c->v_base_V, ratio[D], score);
    learn_row(t, Q, x_q, b.v_q_V / c->v_base_V, ratio[Q], score);
    for (int i = 0; i < DQW_TRACK_WEIGHTS; i++) {
        t->score2[i] += (score[i] * score[i] - t->score2[i]) / memory_of(t);
        t->score_lag[i] += (score[i] * t->score_last[i] - t->score_lag[i]) / memory_of(t);
        t->score_last[i] = score[i];
    }
    if (c->dead_time_width_A > 0.0f) follow_currents(t);
    if (c->noise_on_inputs && t->blocks > 50) take_noise_out(t, &b, ratio, mask_d, mask_q);
    drift(t);
    return true;
}
