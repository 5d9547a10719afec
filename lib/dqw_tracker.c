#include "dqw_tracker.h"

#include <math.h>
#include <stddef.h>

#include "dqw_transform.h"

#define HALF_WINDOW 20
#define EXCITATION_PU 0.002f
#define WILD 10.0f
// Start deviation of a weight, in nominal values, dead time's in voltage bases, and of a block's residual in those: wide enough to be
// no prior, and narrow enough that noise on a machine at rest moves nothing.
#define START_SD 3.0f
#define START_DEAD_SD_PU 0.1f
#define START_RESIDUAL_PU 0.01f
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
// An input whose power is not three times its noise teaches nothing; even at the end of the warm-up, noise alone passes by ten deviations only.
#define NOISE_MARGIN 3.0f
// Rows that only measure the noise and its share.
#define WARM_UP 1000u
// Where noise is more than this part of all that was learned of a weight, taking it out could run away.
#define NOISE_PART_MAX 0.05f
// A per-unit weight beyond this is no machine's.
#define WEIGHT_MAX_PU 1e4f
#define EXCESS_PART (1.0f / 256.0f)
#define SLOPE_ROWS 4096u

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

static float start_weight_pu(const dqw_tracker *t, int i)
{
    const dqw_tracker_config *c = t->config;
    const float start[DQW_TRACK_WEIGHTS] = {c->R_ohm, c->Ld_H, c->Lq_H, c->psi_Wb, 0.0f, 0.0f};
    return start[i] / (t->neuron.y_base * t->neuron.x_scale[i]);
}

// Start variance of a weight per unit of residual variance.
static float start_variance(const dqw_tracker *t, int i)
{
    const float sd_pu = i == DQW_TRACK_DEAD_TIME ? START_DEAD_SD_PU : START_SD * start_weight_pu(t, i == DQW_TRACK_PSI_Q ? DQW_TRACK_PSI : i);
    return sd_pu * sd_pu / (START_RESIDUAL_PU * START_RESIDUAL_PU);
}

// Forget what was learned: weights as configured.
static void start_again(dqw_tracker *t)
{
    (void)dqw_gain_init(&t->gain, DQW_TRACK_WEIGHTS, 1.0f);
    for (int i = 0; i < DQW_TRACK_WEIGHTS; i++) {
        t->neuron.w_pu[i] = start_weight_pu(t, i);
        t->gain.d[i] = start_variance(t, i);
        t->score2[i] = t->score_lag[i] = t->score_last[i] = 0.0f;
    }
    t->error_pu2[D] = t->error_pu2[Q] = 0.0f;
    t->blocks = 0;
    t->learned = 0;
    if (t->restarts < UINT32_MAX) t->restarts++;
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
    if (status == DQW_OK) status = dqw_gain_init(&n.gain, DQW_TRACK_WEIGHTS, 1.0f);
    if (status == DQW_OK) status = dqw_window_init(&n.window, half_of(c), DQW_TRACK_SIGNALS);
    if (status != DQW_OK) return status;
    start_again(&n);
    for (int i = 0; i < DQW_TRACK_WEIGHTS; i++)
        if (!(fabsf(n.neuron.w_pu[i]) < WEIGHT_MAX_PU)) return DQW_ERR_RANGE;
    n.restarts = 0;
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
    t->dead_slope_inv_A += (slope - t->dead_slope_inv_A) / (1.0f + (float)(t->noise.rows < SLOPE_ROWS ? t->noise.rows : SLOPE_ROWS));
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
    if (t->window.at == 0) {
        t->half_theta_rad = good ? s->theta_e_rad : NAN;
        t->halves++;
    }
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
    if ((t->learned >> i & 1u) == 0 || t->blocks < 2u * DQW_TRACK_WEIGHTS) return INFINITY;
    const float p = dqw_gain_covariance(&t->gain, i, i);
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
static void learn_row(dqw_tracker *t, int axis, const float x_pu[], uint32_t mask, float y_pu, float ratio, float score[])
{
    const float weigh = 1.0f / sqrtf(ratio);
    float x[DQW_TRACK_WEIGHTS];
    float k[DQW_TRACK_WEIGHTS];
    float e = y_pu;
    for (int i = 0; i < DQW_TRACK_WEIGHTS; i++) {
        e -= t->neuron.w_pu[i] * x_pu[i];
        x[i] = (mask >> i & 1u) != 0 ? x_pu[i] * weigh : 0.0f;
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

// Noise of dead time's input, A per unit of its mean slope: where what is left of the noise is wide, that of a step; where
// narrow, tanh's own; and all of it where the currents stay within the width.
static float dead_noise(const dqw_tracker *t, float var_i)
{
    const float sd = sqrtf(var_i * t->follow / (2.0f - t->follow));
    return var_i * fmaxf(t->dead_slope_inv_A, 0.53f / (sd + 1.2f * t->config->dead_time_width_A));
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

// Variances of the noise of a block's inputs, per unit, and the covariances that do not vanish. (E60)
typedef struct input_noise {
    float d[DQW_TRACK_WEIGHTS], q[DQW_TRACK_WEIGHTS];
    float lq_psi_q;  // d row
    float ld_psi;    // q row
    float dead_in_R[2], R_in_dead[2], dead_L[2];
} input_noise;

static input_noise noise_of(const dqw_tracker *t, const dqw_block *b)
{
    const dqw_tracker_config *c = t->config;
    const float h = (float)half_of(c);
    const float p = (float)c->pole_pairs;
    const float sum = h * (h + 1.0f);
    const float mean = (h * (4.0f * h * h - 1.0f) / 6.0f + h * h) / (sum * sum);
    const float slope = 2.0f * h / (c->dt_s * c->dt_s * sum * sum);
    const float var[2] = {dqw_noise_variance(t->noise.i_d_A2), dqw_noise_variance(t->noise.i_q_A2)};
    const float var_w = dqw_noise_variance(t->noise.w_rad2_s2);
    const float w2 = b->w_m_rad_s * b->w_m_rad_s;
    const float turn = mean * p * p * var_w;
    const float *s = t->neuron.x_scale;
    input_noise n = {
        .d = {mean * var[D], slope * var[D], mean * p * p * (w2 * var[Q] + var_w * (b->i_q_A * b->i_q_A + var[Q])), 0.0f, 0.0f, c->angle ? turn : 0.0f},
        .q = {mean * var[Q], mean * p * p * (w2 * var[D] + var_w * (b->i_d_A * b->i_d_A + var[D])), slope * var[Q], turn, 0.0f, 0.0f},
        .lq_psi_q = c->angle ? -turn * b->i_q_A * s[DQW_TRACK_LQ] * s[DQW_TRACK_PSI_Q] : 0.0f,
        .ld_psi = turn * b->i_d_A * s[DQW_TRACK_LD] * s[DQW_TRACK_PSI],
    };
    if (c->dead_time_width_A > 0.0f) {
        const float g = mean * t->dead_slope_inv_A;
        const float with_R = g * s[DQW_TRACK_R] * s[DQW_TRACK_DEAD_TIME];
        const float with_L[2] = {s[DQW_TRACK_LD], s[DQW_TRACK_LQ]};
        n.d[DQW_TRACK_DEAD_TIME] = g * dead_noise(t, var[D]);
        n.q[DQW_TRACK_DEAD_TIME] = g * dead_noise(t, var[Q]);
        for (int axis = 0; axis < 2; axis++) {
            n.dead_in_R[axis] = with_R * dead_alike(t, var[axis]);
            n.R_in_dead[axis] = with_R * var[axis];
            n.dead_L[axis] = late(t) * slope * var[axis] * with_L[axis] * s[DQW_TRACK_DEAD_TIME];
        }
    }
    for (int i = 0; i < DQW_TRACK_WEIGHTS; i++) {
        n.d[i] *= s[i] * s[i];
        n.q[i] *= s[i] * s[i];
    }
    return n;
}

// Noise of the inputs turns the gradient by C w: put back. (E60)
static void take_noise_out(dqw_tracker *t, const input_noise *n, const float ratio[2], uint32_t mask_d, uint32_t mask_q)
{
    const float *w = t->neuron.w_pu;
    const float dead = w[DQW_TRACK_DEAD_TIME];
    float z[DQW_TRACK_WEIGHTS];
    for (int i = 0; i < DQW_TRACK_WEIGHTS; i++) {
        const float part = dqw_gain_covariance(&t->gain, i, i) * (n->d[i] / ratio[D] + n->q[i] / ratio[Q]);
        if (((mask_d | mask_q) >> i & 1u) != 0 && part > NOISE_PART_MAX) return;
    }
    for (int i = 0; i < DQW_TRACK_WEIGHTS; i++)
        z[i] = ((mask_d >> i & 1u) != 0 ? n->d[i] * w[i] / ratio[D] : 0.0f) + ((mask_q >> i & 1u) != 0 ? n->q[i] * w[i] / ratio[Q] : 0.0f);
    z[DQW_TRACK_R] += dead * (n->dead_in_R[D] / ratio[D] + n->dead_in_R[Q] / ratio[Q]);
    z[DQW_TRACK_LD] += n->ld_psi / ratio[Q] * w[DQW_TRACK_PSI] + n->dead_L[D] / ratio[D] * dead;
    z[DQW_TRACK_LQ] += n->lq_psi_q / ratio[D] * w[DQW_TRACK_PSI_Q] + n->dead_L[Q] / ratio[Q] * dead;
    z[DQW_TRACK_PSI] += n->ld_psi / ratio[Q] * w[DQW_TRACK_LD];
    z[DQW_TRACK_PSI_Q] += n->lq_psi_q / ratio[D] * w[DQW_TRACK_LQ];
    z[DQW_TRACK_DEAD_TIME] += (n->R_in_dead[D] / ratio[D] + n->R_in_dead[Q] / ratio[Q]) * w[DQW_TRACK_R] +
                              n->dead_L[D] / ratio[D] * w[DQW_TRACK_LD] + n->dead_L[Q] / ratio[Q] * w[DQW_TRACK_LQ];
    float move[DQW_TRACK_WEIGHTS];
    dqw_gain_apply(&t->gain, z, move);
    for (int i = 0; i < DQW_TRACK_WEIGHTS; i++) t->neuron.w_pu[i] += move[i];
}

static void drift(dqw_tracker *t)
{
    const float rate = t->config->drift_per_sqrt_s;
    if (!(rate > 0.0f)) return;
    const float common = common_variance(t);
    const float unit = rate * rate * (float)half_of(t->config) * t->config->dt_s / common;
    const float widest = START_RESIDUAL_PU * START_RESIDUAL_PU / common;
    for (int i = 0; i < DQW_TRACK_WEIGHTS; i++) {
        // Inputs whose healthy weight is about zero drift as part of the flux' and the resistance's voltage at the bases.
        const float w = i == DQW_TRACK_DEAD_TIME ? START_DEAD_SD_PU : start_weight_pu(t, i == DQW_TRACK_PSI_Q ? DQW_TRACK_PSI : i);
        if (dqw_gain_covariance(&t->gain, i, i) < widest * start_variance(t, i)) dqw_gain_grow(&t->gain, i, unit * w * w);
    }
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
    const input_noise noise = noise_of(t, &b);
    uint32_t mask_d = 0;
    uint32_t mask_q = 0;
    float size = 0.0f;
    for (int i = 0; i < DQW_TRACK_WEIGHTS; i++) {
        x_d[i] *= t->neuron.x_scale[i];
        x_q[i] *= t->neuron.x_scale[i];
        size += fabsf(x_d[i]) + fabsf(x_q[i]);
        // What of both inputs' power is above the noise, on average: chosen by the mean and not by the block, or the choice would bias.
        const float net = x_d[i] * x_d[i] + x_q[i] * x_q[i] - NOISE_MARGIN * (noise.d[i] + noise.q[i]);
        t->excess_pu2[i] += (net - t->excess_pu2[i]) * EXCESS_PART;
        if (!(t->excess_pu2[i] > 0.0f)) continue;
        if (fabsf(x_d[i]) >= threshold) mask_d |= 1u << i;
        if (fabsf(x_q[i]) >= threshold) mask_q |= 1u << i;
    }
    (void)dqw_gate_block(&t->gate, mask_d | mask_q, 0, DQW_TRACK_WEIGHTS);
    if ((mask_d | mask_q) == 0 || !(size < BLOCK_MAX_PU) || t->noise.rows < WARM_UP) {
        drift(t);
        return false;
    }
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
    learn_row(t, D, x_d, mask_d, b.v_d_V / c->v_base_V, ratio[D], score);
    learn_row(t, Q, x_q, mask_q, b.v_q_V / c->v_base_V, ratio[Q], score);
    for (int i = 0; i < DQW_TRACK_WEIGHTS; i++) {
        t->score2[i] += (score[i] * score[i] - t->score2[i]) / memory_of(t);
        t->score_lag[i] += (score[i] * t->score_last[i] - t->score_lag[i]) / memory_of(t);
        t->score_last[i] = score[i];
    }
    if (c->dead_time_width_A > 0.0f) follow_currents(t);
    if (c->noise_on_inputs && t->blocks > 1) take_noise_out(t, &noise, ratio, mask_d, mask_q);
    bool sound = true;
    for (int i = 0; i < DQW_TRACK_WEIGHTS; i++) sound = sound && fabsf(t->neuron.w_pu[i]) < WEIGHT_MAX_PU;
    if (!sound) {
        start_again(t);
        return false;
    }
    for (int i = 0; i < DQW_TRACK_WEIGHTS; i++)
        if (dqw_gain_covariance(&t->gain, i, i) < LEARNED_RATIO * start_variance(t, i)) t->learned |= (uint8_t)(1u << i);
    drift(t);
    return true;
}
