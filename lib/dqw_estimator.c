// What the estimator does in the interrupt: admit a sample, gather it, hand blocks over.
#include "dqw_estimator.h"

#include <stddef.h>

#include "dqw_number.h"

// Rows in the mean slope of dead time's input.
#define SLOPE_ROWS 4096u
#define SQRT3_2 0.8660254f
#define INV_SQRT3 0.57735027f
// tanh is 1 from here on, to 1e-3.
#define TANH_ONE 3.6f

// Voltages as they came, the rest as the estimator takes it.
static uint32_t admit(dqw_estimator *e, const dqw_sample *came, const dqw_sample *s, bool saturated)
{
    const dqw_sample *l = &e->last;
    const bool in_range = dqw_within(came->v_d_V, e->v_limit_V) && dqw_within(came->v_q_V, e->v_limit_V) && dqw_within(s->i_d_A, e->i_limit_A) &&
                          dqw_within(s->i_q_A, e->i_limit_A) && dqw_within(s->w_m_rad_s, e->w_limit_rad_s);
    bool finite = in_range || (dqw_is_finite(came->v_d_V) && dqw_is_finite(came->v_q_V) && dqw_is_finite(s->i_d_A) && dqw_is_finite(s->i_q_A) &&
                               dqw_is_finite(s->w_m_rad_s));
    finite = finite && (!e->config->angle || dqw_is_direction(s->cosine, s->sine));
#if DQW_EFFECT_WEIGHTS > 0
    finite = finite && dqw_effect_finite(&e->effect, s);
#endif
    const bool repeated = e->has_last && s->i_d_A == l->i_d_A && s->i_q_A == l->i_q_A && s->w_m_rad_s == l->w_m_rad_s;
    const dqw_gate_sample g = {.finite = finite, .saturated = saturated || !in_range, .repeated = repeated};
    return dqw_gate_check(&e->gate, g);
}

// The sample with the voltage that acts from it on, seen in the rotating frame; the angle it has turned by the middle of its period is small.
static dqw_sample adapted(dqw_estimator *e, const dqw_sample *s)
{
    const dqw_estimator_config *c = e->config;
    dqw_sample x = *s;
    if (c->speed_electrical) x.w_m_rad_s /= (float)c->pole_pairs;
    if (c->voltage_next) {
        x.v_d_V = e->commanded ? e->command_d_V : 0.0f;
        x.v_q_V = e->commanded ? e->command_q_V : 0.0f;
        e->command_d_V = s->v_d_V;
        e->command_q_V = s->v_q_V;
    }
    if (c->voltage_held) {
        float turn = (c->voltage_next ? 1.5f : 0.5f) * (float)c->pole_pairs * x.w_m_rad_s * c->dt_s;
        turn = turn > 2.0f ? 2.0f : turn < -2.0f ? -2.0f : turn;
        // Within 3e-4 to 1 rad.
        const float turn2 = turn * turn;
        const float cosine = 1.0f - turn2 * (0.5f - turn2 * (1.0f / 24.0f - turn2 * (1.0f / 720.0f)));
        const float sine = turn * (1.0f - turn2 * (1.0f / 6.0f - turn2 * (1.0f / 120.0f)));
        const float v_d = x.v_d_V;
        x.v_d_V = cosine * v_d + sine * x.v_q_V;
        x.v_q_V = cosine * x.v_q_V - sine * v_d;
    }
    return x;
}

// tanh to 1e-3, bounded by 1: its continued fraction to the fifth term.
static float soft_sign(float x)
{
    const float a = x > TANH_ONE ? TANH_ONE : x < -TANH_ONE ? -TANH_ONE : x;
    const float a2 = a * a;
    return a * (945.0f + a2 * (105.0f + a2)) / (945.0f + a2 * (420.0f + 15.0f * a2));
}

// What an inverter with dead time takes from each phase per volt of it, as dq. (E51)
static void dead_time(dqw_estimator *e, const dqw_sample *s, float *d, float *q)
{
    const float width = e->dead_time_width_A;
    if (!(width > 0.0f)) {
        *d = *q = 0.0f;
        return;
    }
    // Noise wider than the step would smooth it: so the noisier the currents, the slower they are followed here.
    const float follow = e->last_good ? e->follow : 1.0f;
    e->slow_d_A += follow * (s->i_d_A - e->slow_d_A);
    e->slow_q_A += follow * (s->i_q_A - e->slow_q_A);
    const float k = 1.0f / width;
    const float alpha = k * (s->cosine * e->slow_d_A - s->sine * e->slow_q_A);
    const float beta = SQRT3_2 * k * (s->sine * e->slow_d_A + s->cosine * e->slow_q_A);
    const float a = soft_sign(alpha);
    const float b = soft_sign(beta - 0.5f * alpha);
    const float c = soft_sign(-0.5f * alpha - beta);
    const float lost_alpha = (2.0f * a - b - c) * (1.0f / 3.0f);
    const float lost_beta = (b - c) * INV_SQRT3;
    *d = s->cosine * lost_alpha + s->sine * lost_beta;
    *q = s->cosine * lost_beta - s->sine * lost_alpha;
    // How much of it the current's noise moves, on average: what tanh gains at this current, (1 - tanh^2)/width. One sample in four, and
    // never the one that ends a block, is enough.
    if ((e->window.at & 3u) != 1u) return;
    const float slope = k * (1.0f - (a * a + b * b + c * c) * (1.0f / 3.0f));
    const uint32_t rows = e->noise.of.rows;
    e->dead_slope_inv_A += (slope - e->dead_slope_inv_A) / (1.0f + 0.25f * (float)(rows < SLOPE_ROWS ? rows : SLOPE_ROWS));
}

// What the effects take a sample for, in one place: without room for effects, nothing. False where there is no pair yet.
#if DQW_EFFECT_WEIGHTS > 0
static int signals_of(const dqw_estimator *e)
{
    return DQW_PLAIN_SIGNALS + 2 * e->effect.weights;
}

static bool pair_effects(dqw_estimator *e, const dqw_sample *s, bool good, float pair[])
{
    if (e->effect.count == 0) return good;
    bool there = good;
    float *x = pair + DQW_PLAIN_SIGNALS;
    if (!good)
        dqw_effect_gap(&e->effect);
    else if (e->config->settled)
        dqw_effect_static(&e->effect, s, x, x + e->effect.weights);
    else
        there = dqw_effect_pair(&e->effect, e->last_good ? &e->last : NULL, s, x, x + e->effect.weights);
    dqw_effect_heat(&e->effect, s->i_d_A, s->i_q_A);
    return there;
}
#else
static int signals_of(const dqw_estimator *e)
{
    (void)e;
    return DQW_PLAIN_SIGNALS;
}

static bool pair_effects(dqw_estimator *e, const dqw_sample *s, bool good, float pair[])
{
    (void)e;
    (void)s;
    (void)pair;
    return good;
}
#endif

// The pair that a sample ends, as sums and steps: dqw_estimator_means() makes means and slopes of them. (E13)
static void gather(dqw_estimator *e, const dqw_sample *s, float dead_d, float dead_q, float pair[])
{
    const dqw_sample *l = &e->last;
    const float step_d_A = s->i_d_A - l->i_d_A;
    const float step_q_A = s->i_q_A - l->i_q_A;
    pair[0] = l->v_d_V;
    pair[1] = l->v_q_V;
    pair[2] = s->i_d_A + l->i_d_A;
    pair[3] = s->i_q_A + l->i_q_A;
    pair[4] = step_d_A;
    pair[5] = step_q_A;
    pair[6] = s->w_m_rad_s * s->i_d_A + l->w_m_rad_s * l->i_d_A;
    pair[7] = s->w_m_rad_s * s->i_q_A + l->w_m_rad_s * l->i_q_A;
    pair[8] = s->w_m_rad_s + l->w_m_rad_s;
    pair[9] = dead_d + e->dead_d;
    pair[10] = dead_q + e->dead_q;
    dqw_window_add(&e->window, pair, signals_of(e));
    // Steps less what the voltage made of them.
    dqw_noise_step(&e->noise, step_d_A - e->step_A_per_V[0] * l->v_d_V, step_q_A - e->step_A_per_V[1] * l->v_q_V, s->w_m_rad_s - l->w_m_rad_s);
}

// A settled row as a block of its own.
static uint32_t hand_over_row(dqw_estimator *e, const dqw_sample *s, float dead_d, float dead_q, const float pair[])
{
    e->halves++;
    if (e->pending) {
        if (e->missed < UINT8_MAX) e->missed++;
        return DQW_EVENT_MISSED;
    }
    const dqw_estimator_block row = {
        .sum = {s->v_d_V, s->v_q_V, 2.0f * s->i_d_A, 2.0f * s->i_q_A, 0.0f, 0.0f, 2.0f * s->w_m_rad_s * s->i_d_A, 2.0f * s->w_m_rad_s * s->i_q_A,
                2.0f * s->w_m_rad_s, 2.0f * dead_d, 2.0f * dead_q},
        .cosine = s->cosine,
        .sine = s->sine,
        .follow = 1.0f,
        .number = e->halves,
    };
    e->block = row;
#if DQW_EFFECT_WEIGHTS > 0
    for (int i = DQW_PLAIN_SIGNALS; i < signals_of(e); i++) e->block.sum[i] = pair[i];
#else
    (void)pair;
#endif
    e->pending = true;
    return DQW_EVENT_BLOCK;
}

// Before a block is written: what the background made of those before it.
static void take_given(dqw_estimator *e)
{
    if (!e->given_ready) return;
    e->step_A_per_V[0] = e->given.step_A_per_V[0];
    e->step_A_per_V[1] = e->given.step_A_per_V[1];
    e->follow = e->given.follow;
    if (e->given.noise_anew) dqw_noise_init(&e->noise);
    e->given_ready = false;
}

static uint32_t end_half(dqw_estimator *e, const dqw_sample *s, bool good)
{
    const bool taken = e->pending;
    const bool whole = e->window.valid == e->window.half;
    const float v_V[2] = {e->window.sum[0], e->window.sum[1]};
    float lost[DQW_ESTIMATOR_SIGNALS];
    uint32_t event = dqw_window_end(&e->window, taken ? lost : e->block.sum);
    e->halves++;
    if (event == DQW_EVENT_BLOCK && taken) {
        event = DQW_EVENT_MISSED;
        if (e->missed < UINT8_MAX) e->missed++;
    } else if (event == DQW_EVENT_BLOCK) {
        dqw_estimator_block *b = &e->block;
        b->v_step_V[0] = v_V[0] - e->half_v_V[0];
        b->v_step_V[1] = v_V[1] - e->half_v_V[1];
        b->cosine = e->half_cosine;
        b->sine = e->half_sine;
        b->noise = e->noise.of;
        b->dead_slope_inv_A = e->dead_slope_inv_A;
        b->follow = e->follow;
        b->number = e->halves;
        b->whole = whole && e->half_whole;
        e->pending = true;
    } else if (event == DQW_EVENT_INCOMPLETE && e->gate.incomplete < UINT32_MAX) {
        e->gate.incomplete++;
    }
    take_given(e);
    const bool has_angle = good && e->config->angle;
    e->half_cosine = has_angle ? s->cosine : 0.0f;
    e->half_sine = has_angle ? s->sine : 0.0f;
    e->half_v_V[0] = v_V[0];
    e->half_v_V[1] = v_V[1];
    e->half_whole = whole;
    return event;
}

// A sample, or the last one again in the place of one that is missing or refused.
static uint32_t take(dqw_estimator *e, const dqw_sample *s, uint32_t event)
{
    const dqw_estimator_config *c = e->config;
    const bool good = event == 0;
    float dead_d = 0.0f;
    float dead_q = 0.0f;
    if (good) dead_time(e, s, &dead_d, &dead_q);

    // [EST.2] the pair that it ends, into the window
    float pair[DQW_ESTIMATOR_SIGNALS];
    const bool there = pair_effects(e, s, good, pair);
    if (c->settled) {
        if (good) event |= hand_over_row(e, s, dead_d, dead_q, pair);
    } else {
        if (there && e->last_good) {
            gather(e, s, dead_d, dead_q, pair);
        } else {
            dqw_window_add(&e->window, NULL, signals_of(e));
            dqw_noise_gap(&e->noise);
        }
        // [EST.3] a block for the background
        if (dqw_window_full(&e->window)) event |= end_half(e, s, good);
    }
    // A voltage that acts later is not known at the first sample.
    e->last_good = good && (!c->voltage_next || e->commanded);
    e->commanded = good;
    e->dead_d = dead_d;
    e->dead_q = dead_q;
    return event;
}

uint32_t dqw_estimator_sample(dqw_estimator *e, const dqw_sample *sample, bool saturated)
{
    // [EST.1] may this sample be learned
    const dqw_estimator_config *c = e->config;
    const dqw_sample *s = sample;
    dqw_sample changed;
    if (c->voltage_next || c->voltage_held || c->speed_electrical) {
        changed = adapted(e, sample);
        s = &changed;
    }
    const uint32_t event = take(e, s, admit(e, sample, s, saturated));
    e->last = *s;
    e->has_last = true;
    return event;
}

void dqw_estimator_missing(dqw_estimator *e, uint32_t periods)
{
    if (periods == 1) {
        const dqw_gate_sample none = {.finite = false};
        (void)take(e, &e->last, dqw_gate_check(&e->gate, none));
        e->has_last = false;
        return;
    }
    e->halves += (e->window.at + periods) / e->window.half;
    e->has_last = e->last_good = e->commanded = e->half_whole = false;
    e->half_cosine = e->half_sine = 0.0f;
#if DQW_EFFECT_WEIGHTS > 0
    dqw_effect_gap(&e->effect);
#endif
    dqw_noise_gap(&e->noise);
    dqw_window_restart(&e->window);
}
