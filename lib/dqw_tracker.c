// What the tracker does in the interrupt: admit a sample, gather it, hand blocks over.
#include "dqw_tracker.h"

#include <math.h>

#include "dqw_number.h"

#define HALF_WINDOW 20
// No drive gives a sample of this many bases.
#define WILD 10.0f
// Rows in the mean slope of dead time's input.
#define SLOPE_ROWS 4096u
#define SQRT3_2 0.8660254f
#define INV_SQRT3 0.57735027f
// Start deviation of dead time, in voltage bases.
#define START_DEAD_SD_PU 0.1f

float dqw_tracker_unit(const dqw_tracker_config *config, enum dqw_tracker_weight weight)
{
    const float turning = (float)config->pole_pairs * config->w_base_rad_s;
    switch (weight) {
    case DQW_TRACK_R: return config->v_base_V / config->i_base_A;
    case DQW_TRACK_LD:
    case DQW_TRACK_LQ: return config->v_base_V / (config->i_base_A * turning);
    case DQW_TRACK_PSI:
    case DQW_TRACK_PSI_Q: return config->v_base_V / turning;
    case DQW_TRACK_DEAD_TIME: return config->v_base_V;
    default: return NAN;
    }
}

float dqw_tracker_start_sd_pu(const dqw_tracker *t, int i)
{
    const dqw_tracker_config *c = t->config;
    const float nominal[DQW_TRACK_WEIGHTS] = {c->R_ohm, c->Ld_H, c->Lq_H, c->psi_Wb, 0.0f, c->psi_Wb};
    return i == DQW_TRACK_DEAD_TIME ? START_DEAD_SD_PU : DQW_TRACK_START_SD * nominal[i] / dqw_tracker_unit(c, (enum dqw_tracker_weight)i);
}

void dqw_tracker_start(dqw_tracker *t)
{
    const float part = 1.0f / DQW_TRACK_START_RESIDUAL_PU;
    (void)dqw_gain_init(&t->gain, DQW_TRACK_WEIGHTS, 1.0f);
    for (int i = 0; i < DQW_TRACK_WEIGHTS; i++) {
        const float sd = dqw_tracker_start_sd_pu(t, i);
        t->w_pu[i] = i <= DQW_TRACK_PSI ? sd * (1.0f / DQW_TRACK_START_SD) : 0.0f;
        t->gain.d[i] = sd * part * (sd * part);
    }
    for (int i = 0; i < DQW_TRACK_SCORES; i++) t->score2[i] = t->score_lag[i] = t->score_last[i] = 0.0f;
    for (int i = 0; i < DQW_TRACK_WEIGHTS; i++) t->excess_q10[i] = 0;
    t->step_A_per_V[0] = t->config->dt_s / t->config->Ld_H;
    t->step_A_per_V[1] = t->config->dt_s / t->config->Lq_H;
    t->error_pu2[0] = t->error_pu2[1] = 0.0f;
    t->blocks = 0;
    t->learned = 0;
}

enum dqw_status dqw_tracker_init(dqw_tracker *t, const dqw_tracker_config *config)
{
    if (t == NULL || config == NULL) return DQW_ERR_NULL;
    const dqw_tracker_config *c = config;
    const float needed[] = {c->dt_s, c->v_base_V, c->i_base_A, c->w_base_rad_s, c->R_ohm, c->Ld_H, c->Lq_H, c->psi_Wb, (float)c->pole_pairs};
    const float rest[] = {c->v_limit_V, c->i_limit_A, c->excitation_pu, c->dead_time_width_A, c->drift_per_sqrt_s};
    for (unsigned i = 0; i < sizeof needed / sizeof needed[0]; i++)
        if (!dqw_is_positive(needed[i])) return DQW_ERR_RANGE;
    for (unsigned i = 0; i < sizeof rest / sizeof rest[0]; i++)
        if (!dqw_is_zero_or_positive(rest[i])) return DQW_ERR_RANGE;

    dqw_tracker n = {.config = config, .follow = 1.0f};
    const enum dqw_status status = dqw_window_init(&n.window, c->half_window != 0 ? c->half_window : HALF_WINDOW, DQW_TRACK_SIGNALS);
    if (status != DQW_OK) return status;
    dqw_tracker_start(&n);
    for (int i = 0; i < DQW_TRACK_WEIGHTS; i++)
        if (!dqw_is_positive(n.gain.d[i]) || !dqw_is_finite(dqw_tracker_unit(c, (enum dqw_tracker_weight)i))) return DQW_ERR_RANGE;
    dqw_gate_init(&n.gate, c->stale_limit);
    dqw_noise_init(&n.noise);
    n.i_d_A = NAN;
    *t = n;
    return DQW_OK;
}

static uint32_t admit(dqw_tracker *t, const dqw_sample *s, bool saturated)
{
    const dqw_tracker_config *c = t->config;
    const float v_limit = c->v_limit_V > 0.0f ? c->v_limit_V : WILD * c->v_base_V;
    const float i_limit = c->i_limit_A > 0.0f ? c->i_limit_A : WILD * c->i_base_A;
    const bool repeated = s->i_d_A == t->i_d_A && s->i_q_A == t->i_q_A && s->w_m_rad_s == t->w_m_rad_s;
    const bool has_angle = !c->angle || dqw_is_direction(s->cosine, s->sine);
    const bool in_range = dqw_within(s->v_d_V, v_limit) && dqw_within(s->v_q_V, v_limit) && dqw_within(s->i_d_A, i_limit) && dqw_within(s->i_q_A, i_limit) &&
                          dqw_within(s->w_m_rad_s, WILD * c->w_base_rad_s);
    // Nothing times what is not finite is not a number.
    const bool finite = in_range || dqw_is_finite(0.0f * s->v_d_V + 0.0f * s->v_q_V + 0.0f * s->i_d_A + 0.0f * s->i_q_A + 0.0f * s->w_m_rad_s);
    const dqw_gate_sample g = {.finite = finite && has_angle, .saturated = saturated || !in_range, .repeated = repeated};
    return dqw_gate_check(&t->gate, g);
}

// tanh to 2.4 %, bounded by 1.
static float soft_sign(float x)
{
    const float a = x > 3.0f ? 3.0f : x < -3.0f ? -3.0f : x;
    const float a2 = a * a;
    return a * (27.0f + a2) / (27.0f + 9.0f * a2);
}

// What an inverter with dead time takes from each phase per volt of it, as dq. (E51)
static void dead_time(dqw_tracker *t, const dqw_sample *s, float *d, float *q)
{
    const float width = t->config->dead_time_width_A;
    if (!t->config->angle || !(width > 0.0f)) {
        *d = *q = 0.0f;
        return;
    }
    // Noise wider than the step would smooth it: so the noisier the currents, the slower they are followed here.
    const float follow = t->last_good ? t->follow : 1.0f;
    t->slow_d_A += follow * (s->i_d_A - t->slow_d_A);
    t->slow_q_A += follow * (s->i_q_A - t->slow_q_A);
    const float cosine = s->cosine;
    const float sine = s->sine;
    const float k = 1.0f / width;
    const float alpha = k * (cosine * t->slow_d_A - sine * t->slow_q_A);
    const float beta = SQRT3_2 * k * (sine * t->slow_d_A + cosine * t->slow_q_A);
    const float a = soft_sign(alpha);
    const float b = soft_sign(beta - 0.5f * alpha);
    const float c = soft_sign(-0.5f * alpha - beta);
    const float lost_alpha = (2.0f * a - b - c) * (1.0f / 3.0f);
    const float lost_beta = (b - c) * INV_SQRT3;
    *d = cosine * lost_alpha + sine * lost_beta;
    *q = cosine * lost_beta - sine * lost_alpha;
    // How much of it the current's noise moves, on average: what tanh gains at this current, (1 - tanh^2)/width. One sample in four, and
    // never the one that ends a block, is enough.
    if ((t->window.at & 3u) != 1u) return;
    const float slope = k * (1.0f - (a * a + b * b + c * c) * (1.0f / 3.0f));
    t->dead_slope_inv_A += (slope - t->dead_slope_inv_A) / (1.0f + 0.25f * (float)(t->noise.rows < SLOPE_ROWS ? t->noise.rows : SLOPE_ROWS));
}

// The pair that a sample ends, as sums and steps: dqw_tracker_block() makes means and slopes of them. (E13)
static void gather(dqw_tracker *t, const dqw_sample *s, float dead_d, float dead_q)
{
    const float step_d_A = s->i_d_A - t->i_d_A;
    const float step_q_A = s->i_q_A - t->i_q_A;
    const float pair[DQW_TRACK_SIGNALS] = {
        t->v_d_V,
        t->v_q_V,
        s->i_d_A + t->i_d_A,
        s->i_q_A + t->i_q_A,
        step_d_A,
        step_q_A,
        s->w_m_rad_s * s->i_d_A + t->w_m_rad_s * t->i_d_A,
        s->w_m_rad_s * s->i_q_A + t->w_m_rad_s * t->i_q_A,
        s->w_m_rad_s + t->w_m_rad_s,
        dead_d + t->dead_d,
        dead_q + t->dead_q,
    };
    dqw_window_add(&t->window, pair, DQW_TRACK_SIGNALS);
    // Steps less what the voltage made of them.
    dqw_noise_step(&t->noise, step_d_A - t->step_A_per_V[0] * t->v_d_V, step_q_A - t->step_A_per_V[1] * t->v_q_V, s->w_m_rad_s - t->w_m_rad_s);
}

static uint32_t end_half(dqw_tracker *t, float cosine, float sine)
{
    float lost[DQW_TRACK_SIGNALS];
    const bool taken = t->pending;
    const uint32_t event = dqw_window_end(&t->window, taken ? lost : t->block);
    if (event == DQW_EVENT_LEARNED && taken) {
        if (t->missed < UINT8_MAX) t->missed++;
    } else if (event == DQW_EVENT_LEARNED) {
        t->block_cosine = t->half_cosine;
        t->block_sine = t->half_sine;
        t->pending = true;
    } else if (event == DQW_EVENT_INCOMPLETE && t->gate.incomplete < UINT32_MAX) {
        t->gate.incomplete++;
    }
    t->half_cosine = cosine;
    t->half_sine = sine;
    t->halves++;
    return event;
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
    if (good && t->last_good) {
        gather(t, s, dead_d, dead_q);
    } else {
        dqw_window_add(&t->window, NULL, DQW_TRACK_SIGNALS);
        dqw_noise_gap(&t->noise);
    }

    // [TRK.3] a block for the background
    if (dqw_window_full(&t->window)) event |= end_half(t, good ? s->cosine : 0.0f, good ? s->sine : 0.0f);
    t->last_good = good;
    t->v_d_V = s->v_d_V;
    t->v_q_V = s->v_q_V;
    t->i_d_A = s->i_d_A;
    t->i_q_A = s->i_q_A;
    t->w_m_rad_s = s->w_m_rad_s;
    t->dead_d = dead_d;
    t->dead_q = dead_q;
    return event;
}

void dqw_tracker_gap(dqw_tracker *t, uint32_t periods)
{
    t->halves += (t->window.at + periods) / t->window.half;
    // Equal to nothing.
    t->i_d_A = NAN;
    t->last_good = false;
    dqw_noise_gap(&t->noise);
    dqw_window_restart(&t->window);
}
