// dqw_effect_pair(), dqw_effect_static(): the laws of the electrical effects.
#include <math.h>
#include <stddef.h>

#include "dqw_effect.h"

#if DQW_EFFECT_WEIGHTS > 0

#define SQRT3 1.7320508f

// A sample as the laws see it, and where their parts go: voltage f, flux linkage g of one unit of each weight.
typedef struct moment {
    float i_d, i_q, w_e;
    float cosine, sine;  ///< of the electrical angle
    float end_d, end_q;  ///< the voltage that the sample ends, as the rotor sees it then
    float *f_d, *f_q, *g_d, *g_q;
} moment;

// Dq image of phase quantities, zero sequence removed.
static void put_phases(const moment *m, float a, float b, float c, float *d, float *q)
{
    const float alpha = (2.0f * a - b - c) * (1.0f / 3.0f);
    const float beta = (b - c) * (1.0f / SQRT3);
    *d = m->cosine * alpha + m->sine * beta;
    *q = m->cosine * beta - m->sine * alpha;
}

// A sensor adds o to the true current. (E53)
static void put_sensor(const moment *m, int k, const float shape[], float alpha, float beta)
{
    const float o_d = m->cosine * alpha + m->sine * beta;
    const float o_q = m->cosine * beta - m->sine * alpha;
    m->f_d[k] = -shape[0] * o_d;
    m->f_q[k] = -shape[0] * o_q;
    m->g_d[k] = -shape[1] * o_d;
    m->g_q[k] = -shape[2] * o_q;
}

// Cosine and sine of n times the angle.
static void put_power(const moment *m, unsigned n, float *cosine, float *sine)
{
    // To length 1, to first order: what a sensor's amplitude is off by would count n times.
    const float by = 1.5f - 0.5f * (m->cosine * m->cosine + m->sine * m->sine);
    float base_c = by * m->cosine;
    float base_s = by * m->sine;
    float c = 1.0f;
    float s = 0.0f;
    for (; n > 0; n >>= 1) {
        float next;
        if ((n & 1u) != 0) {
            next = c * base_c - s * base_s;
            s = c * base_s + s * base_c;
            c = next;
        }
        next = base_c * base_c - base_s * base_s;
        base_s = 2.0f * base_c * base_s;
        base_c = next;
    }
    *cosine = c;
    *sine = s;
}

// A polynomial of a co-energy: the currents over its base. (E52)
static void put_saturation(const dqw_effect_config *c, const moment *m)
{
    const float x = m->i_d / c->shape[0];
    const float y = m->i_q / c->shape[0];
    if (c->effect == DQW_EFFECT_SATURATION) {
        m->g_d[0] = x * x;
        m->g_d[1] = x * x * x;
        m->g_d[2] = x * x * x * x;
        m->g_q[3] = y * y * y;
        m->g_q[4] = y * y * y * y * y;
    } else {
        m->g_d[0] = y * y;
        m->g_q[0] = 2.0f * x * y;
        m->g_d[1] = 2.0f * x * y * y;
        m->g_q[1] = 2.0f * x * x * y;
        m->g_d[2] = y * y * y * y;
        m->g_q[2] = 4.0f * x * y * y * y;
    }
}

static void put(const dqw_effect *e, const dqw_effect_config *c, const moment *m, const dqw_sample *s)
{
    const float alpha = m->cosine * m->i_d - m->sine * m->i_q;
    const float beta = m->sine * m->i_d + m->cosine * m->i_q;
    const float a = alpha;
    const float b = -0.5f * alpha + 0.5f * SQRT3 * beta;
    switch (c->effect) {
    case DQW_EFFECT_DEAD_TIME: {
        const float k = 1.0f / c->shape[0];
        put_phases(m, tanhf(k * a), tanhf(k * b), tanhf(-k * (a + b)), m->f_d, m->f_q);
        break;
    }
    case DQW_EFFECT_SATURATION:
    case DQW_EFFECT_CROSS_SATURATION: put_saturation(c, m); break;
    case DQW_EFFECT_WINDING_TEMPERATURE: {
        const float h = c->shape[1] > 0.0f ? e->heat[0] : s->temp_winding_C - c->shape[0];
        m->f_d[0] = h * m->i_d;
        m->f_q[0] = h * m->i_q;
        break;
    }
    case DQW_EFFECT_MAGNET_TEMPERATURE: m->g_d[0] = c->shape[1] > 0.0f ? e->heat[1] : s->temp_magnet_C - c->shape[0]; break;
    case DQW_EFFECT_IRON_LOSS:
        m->g_d[0] = -c->shape[1] * (m->end_d - c->shape[0] * m->i_d);
        m->g_q[0] = -c->shape[2] * (m->end_q - c->shape[0] * m->i_q);
        break;
    case DQW_EFFECT_FLUX_HARMONICS: {
        float cosine;
        float sine;
        put_power(m, (unsigned)c->shape[0], &cosine, &sine);
        m->g_d[0] = m->g_q[2] = cosine;
        m->g_d[1] = m->g_q[3] = sine;
        break;
    }
    case DQW_EFFECT_CURRENT_OFFSET:
        put_sensor(m, 0, c->shape, 1.0f, 0.0f);
        put_sensor(m, 1, c->shape, 0.0f, 1.0f);
        break;
    case DQW_EFFECT_CURRENT_GAIN_MISMATCH:
        put_sensor(m, 0, c->shape, alpha, -beta);
        put_sensor(m, 1, c->shape, beta, alpha);
        break;
    case DQW_EFFECT_ANGLE_OFFSET:
        m->g_d[0] = (c->shape[1] - c->shape[0]) * m->i_q;
        m->g_q[0] = (c->shape[1] - c->shape[0]) * m->i_d - c->shape[2];
        break;
    case DQW_EFFECT_SKIN_EFFECT:
        m->f_d[0] = m->w_e * m->w_e * m->i_d;
        m->f_q[0] = m->w_e * m->w_e * m->i_q;
        break;
    case DQW_EFFECT_PHASE_RESISTANCE_IMBALANCE:
        put_phases(m, a, 0.0f, 0.0f, &m->f_d[0], &m->f_q[0]);
        put_phases(m, 0.0f, b, 0.0f, &m->f_d[1], &m->f_q[1]);
        break;
    case DQW_EFFECT_VOLTAGE_OFFSET: m->f_d[0] = m->f_q[1] = 1.0f; break;
    default: break;
    }
}

// f + w_e J g and g of every weight; `last` NULL: a settled row, whose voltage was always there.
static void evaluate(dqw_effect *e, const dqw_sample *last, const dqw_sample *s, float a_d[], float a_q[], float g_d[], float g_q[])
{
    moment m = {.i_d = s->i_d_A, .i_q = s->i_q_A, .w_e = (float)e->base.pole_pairs * s->w_m_rad_s, .cosine = 1.0f};
    if (e->needs_angle) {
        m.cosine = s->cosine;
        m.sine = s->sine;
    }
    if (e->needs_last && last == NULL) {
        m.end_d = s->v_d_V;
        m.end_q = s->v_q_V;
        e->late_d_V = -m.w_e * e->base.dt_s * s->v_q_V;
        e->late_q_V = m.w_e * e->base.dt_s * s->v_d_V;
    } else if (e->needs_last) {
        const float v_d = last->v_d_V;
        const float v_q = last->v_q_V;
        const float turn = m.w_e * e->base.dt_s;
        const float half = 0.5f * turn;
        m.end_d = cosf(half) * v_d + sinf(half) * v_q;
        m.end_q = cosf(half) * v_q - sinf(half) * v_d;
        e->late_d_V = s->v_d_V - (cosf(turn) * v_d + sinf(turn) * v_q);
        e->late_q_V = s->v_q_V - (cosf(turn) * v_q - sinf(turn) * v_d);
    }
    for (int i = 0; i < e->weights; i++) a_d[i] = a_q[i] = g_d[i] = g_q[i] = 0.0f;
    m.f_d = a_d;
    m.f_q = a_q;
    m.g_d = g_d;
    m.g_q = g_q;
    for (int k = 0; k < e->count; k++) {
        put(e, &e->list[k], &m, s);
        const int weights = dqw_effect_weights(e->list[k].effect);
        m.f_d += weights;
        m.f_q += weights;
        m.g_d += weights;
        m.g_q += weights;
    }
    for (int i = 0; i < e->weights; i++) {
        a_d[i] -= m.w_e * g_q[i];
        a_q[i] += m.w_e * g_d[i];
    }
}

// What depends on the change of voltage at the start of a period holds for all of it: a delay; and the current that iron takes,
// whose step the samples before and after do not show.
static void add_late(const dqw_effect *e, bool settled, float d[], float q[])
{
    int at = 0;
    for (int k = 0; k < e->count; k++) {
        const dqw_effect_config *c = &e->list[k];
        float factor = c->effect == DQW_EFFECT_DELAY ? 1.0f : 0.0f;
        if (c->effect == DQW_EFFECT_IRON_LOSS && !settled) factor = 0.5f * c->shape[0];
        d[at] += factor * e->late_d_V;
        q[at] += factor * e->late_q_V;
        at += dqw_effect_weights(c->effect);
    }
}

bool dqw_effect_pair(dqw_effect *e, const dqw_sample *last, const dqw_sample *s, float d[], float q[])
{
    if (e->count == 0) return true;
    float a_d[DQW_EFFECT_WEIGHTS], a_q[DQW_EFFECT_WEIGHTS], g_d[DQW_EFFECT_WEIGHTS], g_q[DQW_EFFECT_WEIGHTS];
    const bool pair = last != NULL && e->has_sample;
    e->has_sample = last != NULL || !e->needs_last;
    if (!e->has_sample) return false;

    // [EFF.1] the pair: what its first sample began, ...
    if (pair) {
        for (int i = 0; i < e->weights; i++) {
            d[i] = 0.5f * e->a_d[i];
            q[i] = 0.5f * e->a_q[i];
        }
        if (e->needs_last) add_late(e, false, d, q);
    }

    // [EFF.2] ... and this one ends
    evaluate(e, last, s, a_d, a_q, g_d, g_q);
    for (int i = 0; i < e->weights; i++) {
        if (pair) {
            d[i] += 0.5f * a_d[i] + (g_d[i] - e->g_d[i]) / e->base.dt_s;
            q[i] += 0.5f * a_q[i] + (g_q[i] - e->g_q[i]) / e->base.dt_s;
        }
        e->a_d[i] = a_d[i];
        e->a_q[i] = a_q[i];
        e->g_d[i] = g_d[i];
        e->g_q[i] = g_q[i];
    }
    return pair;
}

void dqw_effect_static(dqw_effect *e, const dqw_sample *s, float d[], float q[])
{
    if (e->count == 0) return;
    float g_d[DQW_EFFECT_WEIGHTS], g_q[DQW_EFFECT_WEIGHTS];
    evaluate(e, NULL, s, d, q, g_d, g_q);
    if (e->needs_last) add_late(e, true, d, q);
}

#else
typedef int dqw_effect_has_no_laws;
#endif
