#include "dqw_effect.h"

#include <math.h>
#include <stddef.h>

#include "dqw_number.h"

// Temperature differences of this size are the base of what the sample's temperature brings.
#define HEAT_BASE_K 50.0f
// A voltage one period late differs from the right one by no more than this part of the base, as a rule.
#define DELAY_BASE 0.1f
// Of weights that belong to one effect, those count whose deviation is below this part of the largest.
#define DQW_KNOWN_RATIO 0.25f
// Currents beyond this many bases heat no more.
#define HEAT_MAX 100.0f

static bool none_negative(const float x[], int n)
{
    for (int i = 0; i < n; i++)
        if (!(x[i] >= 0.0f)) return false;
    return true;
}

// Does the shape mean something?
static bool sound(const dqw_effect_config *c)
{
    const float *s = c->shape;
    for (int i = 0; i < DQW_EFFECT_SHAPES; i++)
        if (!isfinite(s[i])) return false;
    for (int i = 0; i < DQW_EFFECT_STARTS; i++)
        if (!isfinite(c->start[i])) return false;
    switch (c->effect) {
    case DQW_EFFECT_DEAD_TIME:
    case DQW_EFFECT_SATURATION:
    case DQW_EFFECT_CROSS_SATURATION:
    case DQW_EFFECT_COULOMB_FRICTION:
    case DQW_EFFECT_DIRECTION_ASYMMETRY:
    case DQW_EFFECT_COGGING_TORQUE: return dqw_is_positive(s[0]) && dqw_is_positive(1.0f / s[0]);
    case DQW_EFFECT_FLUX_HARMONICS: return s[0] >= 1.0f && s[0] <= (float)DQW_EFFECT_ORDERS && s[0] == (float)(int)s[0];
    case DQW_EFFECT_STRIBECK_FRICTION: return dqw_is_positive(s[0]) && dqw_is_positive(s[1]) && dqw_is_positive(1.0f / s[0]) && dqw_is_positive(1.0f / s[1]);
    case DQW_EFFECT_WINDING_TEMPERATURE:
    case DQW_EFFECT_MAGNET_TEMPERATURE: return none_negative(s + 1, 2) && (s[1] == 0.0f || dqw_is_positive(1.0f / s[1]));
    case DQW_EFFECT_IRON_LOSS:
    case DQW_EFFECT_CURRENT_OFFSET:
    case DQW_EFFECT_CURRENT_GAIN_MISMATCH:
    case DQW_EFFECT_ANGLE_OFFSET: return none_negative(s, 3) && s[0] + s[1] + s[2] > 0.0f;
    default: return true;
    }
}

int dqw_effect_check(const dqw_effect_config *list, int count, bool mechanical)
{
    if (count < 0) return DQW_ERR_SIZE;
    if (count > 0 && list == NULL) return DQW_ERR_NULL;
    int sum = 0;
    int windings = 0;
    int magnets = 0;
    for (int k = 0; k < count; k++) {
        const int weights = dqw_effect_weights(list[k].effect);
        if (weights == 0 || dqw_effect_is_mechanical(list[k].effect) != mechanical) return DQW_ERR_RANGE;
        if (weights > DQW_EFFECT_WEIGHTS - sum) return DQW_ERR_SIZE;
        if (!sound(&list[k])) return DQW_ERR_RANGE;
        sum += weights;
        if (list[k].effect == DQW_EFFECT_WINDING_TEMPERATURE) windings++;
        if (list[k].effect == DQW_EFFECT_MAGNET_TEMPERATURE) magnets++;
    }
    return windings > 1 || magnets > 1 ? DQW_ERR_RANGE : sum;
}

uint32_t dqw_effect_known(const float weights[], const float sd[], int n)
{
    float largest = 0.0f;
    for (int i = 0; i < n; i++)
        if (isfinite(sd[i])) largest = fmaxf(largest, fabsf(weights[i]));
    uint32_t known = 0;
    for (int i = 0; i < n; i++)
        if (isfinite(weights[i]) && sd[i] < DQW_KNOWN_RATIO * largest) known |= 1u << i;
    return known;
}

void dqw_effect_torque(const dqw_effect_config *config, float w_m_rad_s, float theta_m_rad, float x[])
{
    const float *s = config->shape;
    switch (config->effect) {
    case DQW_EFFECT_COULOMB_FRICTION: x[0] = tanhf(w_m_rad_s / s[0]); break;
    case DQW_EFFECT_DIRECTION_ASYMMETRY: x[0] = fabsf(tanhf(w_m_rad_s / s[0])); break;
    case DQW_EFFECT_STRIBECK_FRICTION: {
        const float part = w_m_rad_s / s[1];
        x[0] = tanhf(w_m_rad_s / s[0]) * expf(-part * part);
        break;
    }
    case DQW_EFFECT_COGGING_TORQUE:
        x[0] = cosf(s[0] * theta_m_rad);
        x[1] = sinf(s[0] * theta_m_rad);
        break;
    case DQW_EFFECT_LOAD_TORQUE: x[0] = 1.0f; break;
    default: break;
    }
}

#if DQW_EFFECT_WEIGHTS > 0

enum dqw_status dqw_effect_init(dqw_effect *e, const dqw_effect_config *list, int count, const dqw_effect_base *base)
{
    if (e == NULL || base == NULL) return DQW_ERR_NULL;
    const int weights = dqw_effect_check(list, count, false);
    if (weights < 0) return (enum dqw_status)weights;
    if (!dqw_is_positive(base->dt_s) || !dqw_is_positive(base->v_V) || !dqw_is_positive(base->i_A) || !dqw_is_positive(base->w_m_rad_s)) return DQW_ERR_RANGE;
    if (count > 0 && base->pole_pairs == 0) return DQW_ERR_RANGE;
    dqw_effect n = {0};
    n.list = list;
    n.count = (uint8_t)count;
    n.weights = (uint8_t)weights;
    n.base = *base;
    for (int k = 0; k < count; k++) {
        const enum dqw_effect_name name = list[k].effect;
        const bool measured = list[k].shape[1] == 0.0f;
        n.needs_angle = n.needs_angle || name == DQW_EFFECT_DEAD_TIME || name == DQW_EFFECT_FLUX_HARMONICS || name == DQW_EFFECT_CURRENT_OFFSET ||
                        name == DQW_EFFECT_CURRENT_GAIN_MISMATCH || name == DQW_EFFECT_PHASE_RESISTANCE_IMBALANCE;
        n.needs_winding = n.needs_winding || (name == DQW_EFFECT_WINDING_TEMPERATURE && measured);
        n.needs_magnet = n.needs_magnet || (name == DQW_EFFECT_MAGNET_TEMPERATURE && measured);
        n.needs_last = n.needs_last || name == DQW_EFFECT_DELAY || name == DQW_EFFECT_IRON_LOSS;
    }
    *e = n;
    return DQW_OK;
}

float dqw_effect_input_base(const dqw_effect *e, int index)
{
    const dqw_effect_config *c = &e->list[index];
    const float *s = c->shape;
    const float w_e = (float)e->base.pole_pairs * e->base.w_m_rad_s;
    const float i = e->base.i_A;
    const float heat = s[1] > 0.0f ? 1.0f : HEAT_BASE_K;
    switch (c->effect) {
    case DQW_EFFECT_SATURATION:
    case DQW_EFFECT_CROSS_SATURATION: return w_e;
    case DQW_EFFECT_WINDING_TEMPERATURE: return heat * i;
    case DQW_EFFECT_MAGNET_TEMPERATURE: return heat * w_e;
    case DQW_EFFECT_IRON_LOSS: return fmaxf(s[1], s[2]) * e->base.v_V * w_e;
    case DQW_EFFECT_FLUX_HARMONICS: return s[0] * w_e;
    case DQW_EFFECT_CURRENT_OFFSET: return s[0] + fmaxf(s[1], s[2]) * w_e;
    case DQW_EFFECT_CURRENT_GAIN_MISMATCH: return (s[0] + fmaxf(s[1], s[2]) * w_e) * i;
    case DQW_EFFECT_ANGLE_OFFSET: return (s[2] + fabsf(s[1] - s[0]) * i) * w_e;
    case DQW_EFFECT_DELAY: return DELAY_BASE * e->base.v_V;
    case DQW_EFFECT_SKIN_EFFECT: return w_e * w_e * i;
    case DQW_EFFECT_PHASE_RESISTANCE_IMBALANCE: return i;
    default: return 1.0f;
    }
}

bool dqw_effect_finite(const dqw_effect *e, const dqw_sample *s)
{
    if (e->needs_angle && !dqw_is_direction(s->cosine, s->sine)) return false;
    if (e->needs_winding && !isfinite(s->temp_winding_C)) return false;
    return !e->needs_magnet || isfinite(s->temp_magnet_C);
}

void dqw_effect_heat(dqw_effect *e, float i_d_A, float i_q_A)
{
    for (int k = 0; k < e->count; k++) {
        const dqw_effect_config *c = &e->list[k];
        const bool winding = c->effect == DQW_EFFECT_WINDING_TEMPERATURE;
        if ((!winding && c->effect != DQW_EFFECT_MAGNET_TEMPERATURE) || !(c->shape[1] > 0.0f)) continue;
        const float i_base = c->shape[2] > 0.0f ? c->shape[2] : e->base.i_A;
        const float d = i_d_A / i_base;
        const float q = i_q_A / i_base;
        const float square = d * d + q * q;
        if (square != square) continue;
        float *h = &e->heat[winding ? 0 : 1];
        float *rest = &e->heat_rest[winding ? 0 : 1];
        // Time constants of minutes against periods of microseconds: without the rest the sum would stand still.
        const float part = fminf(e->base.dt_s / c->shape[1], 1.0f);
        const float step = part * (fminf(square, HEAT_MAX) - *h) - *rest;
        const float sum = *h + step;
        *rest = (sum - *h) - step;
        *h = sum;
    }
}

void dqw_effect_gap(dqw_effect *e)
{
    e->has_sample = false;
}

#endif
