// What the estimator does in the interrupt: admit a sample, gather it, hand blocks over.
#include "dqw_estimator.h"

#include <stddef.h>

#include "dqw_estimator_block.h"
#include "dqw_modulation.h"
#include "dqw_number.h"

// Rows in the mean slope of dead time's input.
#define SLOPE_ROWS 4096u
#define SQRT3_2 0.8660254f
#define INV_SQRT3 0.57735027f
// tanh is 1 from here on, to 1e-3.
#define TANH_ONE 3.6f

static uint32_t admit(dqw_estimator *e, const dqw_sample *came, const dqw_sample *s, bool saturated)
{
    const bool in_range = dqw_size_bits(came->v_d_V) <= e->v_limit_bits &&
                          dqw_size_bits(came->v_q_V) <= e->v_limit_bits && dqw_size_bits(s->i_d_A) <= e->i_limit_bits &&
                          dqw_size_bits(s->i_q_A) <= e->i_limit_bits && dqw_size_bits(s->w_m_rad_s) <= e->w_limit_bits;
    bool finite = in_range || dqw_sample_finite(came, s);
    finite = finite && (!e->config->angle || dqw_is_direction(s->cosine, s->sine));
#if DQW_EFFECT_WEIGHTS > 0
    finite = finite && dqw_effect_finite(&e->effect, s);
#endif
    const bool repeated = e->has_last && dqw_number_bits(s->i_d_A) == dqw_number_bits(e->i_d_A) &&
                          dqw_number_bits(s->i_q_A) == dqw_number_bits(e->i_q_A) &&
                          dqw_number_bits(s->w_m_rad_s) == dqw_number_bits(e->w_m_rad_s);
    const dqw_gate_sample g = {.finite = finite, .saturated = saturated || !in_range, .repeated = repeated};
    return dqw_gate_check(&e->gate, g);
}

// tanh to 1e-3, bounded by 1: its continued fraction to the fifth term.
static float soft_sign(float x)
{
    const float a = x > TANH_ONE ? TANH_ONE : x < -TANH_ONE ? -TANH_ONE : x;
    const float a2 = a * a;
    return a * (945.0f + a2 * (105.0f + a2)) / (945.0f + a2 * (420.0f + 15.0f * a2));
}

// Dead time's input at a sample.
typedef struct {
    float d, q;
    float sign[3];  // of the phases' currents
} dead_input;

// What an inverter with dead time takes from each phase per volt of it, as dq. (E51)
static dead_input dead_time(dqw_estimator *e, const dqw_sample *s)
{
    dead_input x = {.d = 0.0f};
    const float width = e->dead_time_width_A;
    if (!(width > 0.0f)) return x;
    // Noise wider than the step would smooth it: so the noisier the currents, the slower they are followed here.
    const float follow = e->last_good ? e->follow : 1.0f;
    e->slow_d_A += follow * (s->i_d_A - e->slow_d_A);
    e->slow_q_A += follow * (s->i_q_A - e->slow_q_A);
    const float k = 1.0f / width;
    const float alpha = k * (s->cosine * e->slow_d_A - s->sine * e->slow_q_A);
    const float beta = SQRT3_2 * k * (s->sine * e->slow_d_A + s->cosine * e->slow_q_A);
    const float a = x.sign[0] = soft_sign(alpha);
    const float b = x.sign[1] = soft_sign(beta - 0.5f * alpha);
    const float c = x.sign[2] = soft_sign(-0.5f * alpha - beta);
    const float lost_alpha = (2.0f * a - b - c) * (1.0f / 3.0f);
    const float lost_beta = (b - c) * INV_SQRT3;
    x.d = s->cosine * lost_alpha + s->sine * lost_beta;
    x.q = s->cosine * lost_beta - s->sine * lost_alpha;
    // How much of it the current's noise moves, on average: what tanh gains at this current, (1 - tanh^2)/width. One
    // sample in four, and never the one that ends a block, is enough.
    if ((e->window.at & 3u) != 1u) return x;
    const float slope = k * (1.0f - (a * a + b * b + c * c) * (1.0f / 3.0f));
    const uint32_t rows = e->noise.of.rows;
    e->dead_slope_inv_A += (slope - e->dead_slope_inv_A) /
                           (1.0f + 0.25f * (float)(rows < SLOPE_ROWS ? rows : SLOPE_ROWS));
    return x;
}

// A pair's, of its two samples: what follows the currents late is taken ahead by as much of its own step. (E60)
static float joined(const dqw_estimator *e, float before, float now)
{
    return now + before + e->lead * (now - before);
}

// In the order of the numbers, as integers.
static int32_t ordered(float x)
{
    const uint32_t bits = dqw_number_bits(x);
    return (int32_t)(bits >> 31 != 0 ? ~(bits & 0x7fffffffu) : bits);
}

// Legs that rested in the period that s ends, c and n the direction in its middle, nearly.
static uint8_t resting(const dqw_estimator *e, float c, float n)
{
    const enum dqw_modulation m = (enum dqw_modulation)e->modulation;
    if (m == DQW_MODULATION_CENTRED || !(e->dead_time_width_A > 0.0f)) return 0;
    if (m == DQW_MODULATION_MASK) return e->resting;
    const float alpha = c * e->v_d_V - n * e->v_q_V;
    const float beta = 2.0f * SQRT3_2 * (n * e->v_d_V + c * e->v_q_V);
    const int32_t v[3] = {ordered(2.0f * alpha), ordered(beta - alpha), ordered(-alpha - beta)};
    return dqw_modulation_resting(m, v);
}

// A leg that rests has no dead time: out of the pair's input with it; and what the others have whatever their currents'
// signs shows. (E101)
static void leave_out(const dqw_estimator *e, const dqw_sample *s, const dead_input *x, float dead[4])
{
    const float c = 0.5f * (e->cosine + s->cosine);
    const float n = 0.5f * (e->sine + s->sine);
    const uint8_t legs = resting(e, c, n) & 7u;
    if (legs == 7u) {
        dead[0] = dead[1] = 0.0f;
        return;
    }
    static const float alpha[3] = {2.0f / 3.0f, -1.0f / 3.0f, -1.0f / 3.0f};
    static const float beta[3] = {0.0f, INV_SQRT3, -INV_SQRT3};
    for (int k = 0; k < 3; k++) {
        if ((legs >> k & 1u) == 0) continue;
        const float d = c * alpha[k] + n * beta[k];
        const float q = c * beta[k] - n * alpha[k];
        const float sign = joined(e, e->dead_sign[k], x->sign[k]);
        dead[0] -= sign * d;
        dead[1] -= sign * q;
        dead[2] -= 2.0f * d;
        dead[3] -= 2.0f * q;
    }
}

// What the inputs of the effects are made of, behind the plain signals. Without room for effects, nothing. False where
// there is no pair.
static bool gather_effects(dqw_estimator *e, const dqw_sample *s, bool good)
{
    bool there = good && e->last_good;
#if DQW_EFFECT_WEIGHTS > 0
    if (e->effect.count == 0) return there;
    dqw_window_cell *cell = dqw_window_cells(&e->window) + DQW_PLAIN_SIGNALS;
    const dqw_sample last = {
        .v_d_V = e->v_d_V, .v_q_V = e->v_q_V, .i_d_A = e->i_d_A, .i_q_A = e->i_q_A, .w_m_rad_s = e->w_m_rad_s};
    if (!good)
        dqw_effect_gap(&e->effect);
    else
        there = dqw_effect_gather(&e->effect, e->last_good ? &last : NULL, s, cell);
#else
    (void)s;
#endif
    return there;
}

// The pair that a sample ends, as sums and steps: dqw_estimator_means() makes means and slopes of them. (E13)
static void gather(dqw_estimator *e, const dqw_sample *s, const dead_input *x)
{
    const float step_d_A = s->i_d_A - e->i_d_A;
    const float step_q_A = s->i_q_A - e->i_q_A;
    float dead[4] = {joined(e, e->dead_d, x->d), joined(e, e->dead_q, x->q), 0.0f, 0.0f};
    if (e->modulation != (uint8_t)DQW_MODULATION_CENTRED) leave_out(e, s, x, dead);
    const float pair[DQW_PLAIN_SIGNALS] = {
        e->v_d_V,
        e->v_q_V,
        s->i_d_A + e->i_d_A,
        s->i_q_A + e->i_q_A,
        step_d_A,
        step_q_A,
        s->w_m_rad_s * s->i_d_A + e->w_m_rad_s * e->i_d_A,
        s->w_m_rad_s * s->i_q_A + e->w_m_rad_s * e->i_q_A,
        s->w_m_rad_s + e->w_m_rad_s,
        dead[0],
        dead[1],
        dead[2],
        dead[3],
    };
    dqw_window_cell *cell = dqw_window_cells(&e->window);
    for (int i = 0; i < DQW_PLAIN_SIGNALS; i++) dqw_window_gather(&cell[i], pair[i]);
    dqw_window_count(&e->window);
    if (e->config->settled) return;
    // Steps less what the voltage made of them.
    const float made_d_A = e->step_A_per_V[0] * e->v_d_V;
    dqw_noise_step(&e->noise, step_d_A - made_d_A, step_q_A - e->step_A_per_V[1] * e->v_q_V,
                   s->w_m_rad_s - e->w_m_rad_s, made_d_A);
}

static void keep(dqw_estimator *e, const dqw_sample *s)
{
    e->v_d_V = s->v_d_V;
    e->v_q_V = s->v_q_V;
    e->i_d_A = s->i_d_A;
    e->i_q_A = s->i_q_A;
    e->w_m_rad_s = s->w_m_rad_s;
    e->cosine = s->cosine;
    e->sine = s->sine;
    e->resting = s->resting;
}

static void keep_dead(dqw_estimator *e, const dead_input *x)
{
    e->dead_d = x->d;
    e->dead_q = x->q;
    for (int k = 0; k < 3; k++) e->dead_sign[k] = x->sign[k];
}

// A settled row is a block of its own: it makes a pair with itself.
static void begin_row(dqw_estimator *e, const dqw_sample *s, const dead_input *x)
{
#if DQW_EFFECT_WEIGHTS > 0
    if (e->effect.count > 0) {
        float d[DQW_EFFECT_WEIGHTS];
        float q[DQW_EFFECT_WEIGHTS];
        dqw_effect_static(&e->effect, s, d, q);
        dqw_window_cell *cell = dqw_window_cells(&e->window) + DQW_PLAIN_SIGNALS;
        for (int i = 0; i < e->effect.weights; i++, cell += 2) {
            dqw_window_gather(&cell[0], d[i]);
            dqw_window_gather(&cell[1], q[i]);
        }
    }
#endif
    keep(e, s);
    keep_dead(e, x);
}

// Before a half is gathered: what the background made of those before it.
static void take_given(dqw_estimator *e)
{
    if (!e->given_ready) return;
    e->step_A_per_V[0] = e->given.step_A_per_V[0];
    e->step_A_per_V[1] = e->given.step_A_per_V[1];
    e->lead = e->given.lead;
    e->follow = 2.0f / (2.0f + e->lead);
    if (e->given.noise_anew) dqw_noise_anew(&e->noise);
    e->given_ready = false;
}

static uint32_t end_half(dqw_estimator *e, const dqw_sample *s, bool good)
{
    e->halves++;
#if DQW_EFFECT_WEIGHTS > 0
    if (e->effect.count > 0) dqw_effect_warm(&e->effect, e->window.half);
#endif
    if (!dqw_window_turn(&e->window)) {
        if (e->missed < UINT8_MAX) e->missed++;
        return DQW_EVENT_MISSED;
    }
    dqw_estimator_handed *h = &e->handed;
    const bool has_angle = good && e->config->angle;
    h->cosine = has_angle ? s->cosine : 0.0f;
    h->sine = has_angle ? s->sine : 0.0f;
    h->noise = e->noise.of;
    h->dead_slope_inv_A = e->dead_slope_inv_A;
    h->number = e->halves;
    take_given(e);
    return DQW_EVENT_BLOCK;
}

// A sample; or what stands for one that is missing or refused, whose numbers are not used.
static uint32_t take(dqw_estimator *e, const dqw_sample *s, uint32_t event)
{
    const dqw_estimator_config *c = e->config;
    const bool good = event == 0;
    const dead_input none = {.d = 0.0f};
    const dead_input x = good ? dead_time(e, s) : none;

    // [EST.2] the pair that it ends, into the window
    const bool row = c->settled && good;
    if (row) begin_row(e, s, &x);
    if (row || (!c->settled && gather_effects(e, s, good))) {
        gather(e, s, &x);
    } else if (!c->settled) {
        dqw_window_refuse(&e->window);
        dqw_noise_gap(&e->noise);
    }
#if DQW_EFFECT_WEIGHTS > 0
    // Every sample heats, also one that may not be learned; the heating states go on by what was gathered.
    if (e->effect.count > 0) dqw_effect_heat(&e->effect, s->i_d_A, s->i_q_A);
#endif
    // [EST.3] a half for the background
    if (dqw_window_full(&e->window)) event |= end_half(e, s, good);
    // A voltage that acts later is not known at the first sample.
    e->last_good = good && (!c->voltage_next || e->commanded);
    e->commanded = good;
    keep_dead(e, &x);
    return event;
}

static uint32_t step(dqw_estimator *e, const dqw_sample *came, const dqw_sample *s, bool saturated)
{
    // [EST.1] may this sample be learned
    const uint32_t event = take(e, s, admit(e, came, s, saturated));
    keep(e, s);
    e->has_last = true;
    return event;
}

uint32_t dqw_estimator_sample(dqw_estimator *e, const dqw_sample *s, bool saturated)
{
    const dqw_estimator_config *c = e->config;
    if (!c->voltage_next && !c->voltage_held && !c->speed_electrical) return step(e, s, s, saturated);
    dqw_sample changed;
    dqw_estimator_adapt(e, s, &changed);
    return step(e, s, &changed, saturated);
}

void dqw_estimator_missing(dqw_estimator *e, uint32_t periods)
{
    if (periods == 1) {
        const dqw_sample none = {.i_d_A = e->i_d_A, .i_q_A = e->i_q_A};
        const dqw_gate_sample g = {.finite = false};
        (void)take(e, &none, dqw_gate_check(&e->gate, g));
        e->has_last = false;
        return;
    }
    e->halves += periods / e->window.half + (e->window.at + periods % e->window.half) / e->window.half;
    e->has_last = e->last_good = e->commanded = false;
#if DQW_EFFECT_WEIGHTS > 0
    // A half that is given up has heated.
    dqw_effect_warm(&e->effect, e->window.at);
    dqw_effect_gap(&e->effect);
#endif
    dqw_noise_gap(&e->noise);
    dqw_window_restart(&e->window);
}
