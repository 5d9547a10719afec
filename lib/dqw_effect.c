#include "dqw_effect.h"
#include "dqw_effect_kind.h"

#include <math.h>
#include <stddef.h>

#include "dqw_number.h"

// Of weights that belong to one effect, those count whose deviation is below this part of the largest.
#define DQW_KNOWN_RATIO 0.25f
// Currents beyond this many bases heat no more.
#define HEAT_MAX 100.0f

static bool none_negative(const float x[], int n)
{
    for (int i = 0; i < n; i++)
        if (!dqw_is_zero_or_positive(x[i])) return false;
    return true;
}

// Does the shape mean something?
static bool sound(const dqw_effect_config *c)
{
    const float *s = c->shape;
    for (int i = 0; i < DQW_EFFECT_SHAPES; i++)
        if (!dqw_is_finite(s[i])) return false;
    for (int i = 0; i < DQW_EFFECT_STARTS; i++)
        if (!dqw_is_finite(c->start[i])) return false;
    switch (dqw_effect_shape_of(c->effect)) {
    case DQW_SHAPE_WIDTHS:
        if (!dqw_is_positive(s[1]) || !dqw_is_positive(1.0f / s[1])) return false;
        return dqw_is_positive(s[0]) && dqw_is_positive(1.0f / s[0]);
    case DQW_SHAPE_WIDTH: return dqw_is_positive(s[0]) && dqw_is_positive(1.0f / s[0]);
    case DQW_SHAPE_ORDER: return s[0] >= 1.0f && s[0] <= (float)DQW_EFFECT_ORDERS && s[0] == (float)(int)s[0];
    case DQW_SHAPE_HEAT: return none_negative(s + 1, 2) && (s[1] == 0.0f || dqw_is_positive(1.0f / s[1]));
    case DQW_SHAPE_MACHINE: return none_negative(s, 3) && s[0] + s[1] + s[2] > 0.0f;
    case DQW_SHAPE_MAP:
        for (int i = 0; i < 3; i++)
            if (!dqw_is_positive(s[i]) || !dqw_is_positive(1.0f / s[i])) return false;
        return dqw_effect_is_map(c->map);
    case DQW_SHAPE_FREE:
    default: return true;
    }
}

static int check(const dqw_effect_config *list, int count, bool mechanical, bool dead_time_apart)
{
    if (count < 0 || (count > 0 && list == NULL)) return DQW_ERR_EFFECT_LIST;
    int sum = 0;
    int windings = 0;
    int magnets = 0;
    int apart = 0;
    for (int k = 0; k < count; k++) {
        const int weights = dqw_effect_weights(list[k].effect);
        if (weights == 0 || dqw_effect_is_mechanical(list[k].effect) != mechanical) return DQW_ERR_EFFECT_NAME;
        if (!sound(&list[k])) return DQW_ERR_EFFECT_SHAPE;
        if (dead_time_apart && list[k].effect == DQW_EFFECT_DEAD_TIME)
            apart++;
        else
            sum += weights;
        if (sum > DQW_EFFECT_WEIGHTS) return DQW_ERR_EFFECT_ROOM;
        windings += (dqw_effect_needs(list[k].effect) & DQW_NEEDS_WINDING) != 0;
        magnets += (dqw_effect_needs(list[k].effect) & DQW_NEEDS_MAGNET) != 0;
    }
    return windings > 1 || magnets > 1 || apart > 1 ? DQW_ERR_EFFECT_TWICE : sum;
}

int dqw_effect_check(const dqw_effect_config *list, int count, bool mechanical)
{
    return check(list, count, mechanical, false);
}

uint32_t dqw_effect_known(const float weights[], const float sd[], int n)
{
    float largest = 0.0f;
    for (int i = 0; i < n; i++)
        if (dqw_is_finite(weights[i]) && dqw_within(sd[i], DQW_UNKNOWN) && sd[i] < DQW_UNKNOWN)
            largest = fmaxf(largest, fabsf(weights[i]));
    uint32_t known = 0;
    for (int i = 0; i < n; i++)
        if (dqw_is_finite(weights[i]) && dqw_is_finite(sd[i]) && sd[i] < DQW_KNOWN_RATIO * largest) known |= 1u << i;
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

static enum dqw_status check_base(const dqw_effect_base *base)
{
    if (!dqw_is_positive(base->dt_s) || !dqw_is_positive(1.0f / base->dt_s)) return DQW_ERR_DT;
    if (!dqw_is_positive(base->v_V)) return DQW_ERR_V_BASE;
    if (!dqw_is_positive(base->i_A)) return DQW_ERR_I_BASE;
    return dqw_is_positive(base->w_m_rad_s) ? DQW_OK : DQW_ERR_W_BASE;
}

// What an effect asks of samples, and its heating state.
static void take_needs(dqw_effect *e, const dqw_effect_config *c)
{
    const unsigned needs = dqw_effect_needs(c->effect);
    const bool apart = c->effect == DQW_EFFECT_DEAD_TIME && e->base.dead_time_apart;
    e->needs_angle = e->needs_angle || ((needs & DQW_NEEDS_ANGLE) != 0 && !apart);
    e->needs_last = e->needs_last || (needs & DQW_NEEDS_LAST) != 0;
    if ((needs & (DQW_NEEDS_WINDING | DQW_NEEDS_MAGNET)) == 0) return;
    const int state = (needs & DQW_NEEDS_WINDING) != 0 ? 0 : 1;
    if (c->shape[1] > 0.0f) {
        const float i_A = c->shape[2] > 0.0f ? c->shape[2] : e->base.i_A;
        e->heating = (uint8_t)(e->heating | 1u << state);
        e->heat_part[state] = e->base.dt_s / c->shape[1];
        e->heat_unit[state] = 1.0f / i_A / i_A;
    } else if (state == 0) {
        e->needs_winding = true;
    } else {
        e->needs_magnet = true;
    }
}

enum dqw_status dqw_effect_init(dqw_effect *e, const dqw_effect_config *list, int count, const dqw_effect_base *base)
{
    if (e == NULL || base == NULL) return DQW_ERR_NULL;
    const int sum = check(list, count, false, base->dead_time_apart);
    if (sum < 0) return (enum dqw_status)sum;
    const enum dqw_status status = check_base(base);
    if (status != DQW_OK) return status;
    if (count > 0 && base->pole_pairs == 0) return DQW_ERR_EFFECT_POLE_PAIRS;
    dqw_effect n = {0};
    n.list = list;
    n.count = (uint8_t)count;
    n.base = *base;
    n.poles = (float)base->pole_pairs;
    n.poles_4 = 0.25f * n.poles;
    n.step_Hz = 1.0f / base->dt_s;
    n.turn_4 = n.poles_4 * base->dt_s;
    for (int k = 0; k < count; k++) {
        n.weights = (uint8_t)(n.weights + dqw_effect_weights_of(&n, list[k].effect));
        take_needs(&n, &list[k]);
    }
    dqw_effect_plan(&n);
    *e = n;
    return DQW_OK;
}

bool dqw_effect_finite(const dqw_effect *e, const dqw_sample *s)
{
    if (e->needs_winding && !dqw_is_finite(s->temp_winding_C)) return false;
    return !e->needs_magnet || dqw_is_finite(s->temp_magnet_C);
}

static void warm_one(dqw_effect *e, int state, float periods, float mean_A2)
{
    const float whole = e->heat_part[state] * periods;
    const float part = whole < 1.0f ? whole : 1.0f;
    const float to = e->heat_unit[state] * mean_A2;
    const float h = e->heat[state];
    // Time constants of minutes against periods of microseconds: without the rest the sum would stand still. A volatile
    // sum, so that no compiler finds that in real numbers there is no rest.
    const float step = part * ((to < HEAT_MAX ? to : HEAT_MAX) - h) - e->heat_rest[state];
    volatile float sum = h + step;
    volatile float moved = sum - h;
    e->heat_rest[state] = moved - step;
    e->heat[state] = sum;
}

void dqw_effect_warm(dqw_effect *e, uint32_t periods)
{
    if (e->heating == 0 || periods == 0) return;
    const float mean_A2 = e->square_A2 / (float)periods;
    e->square_A2 = 0.0f;
    if (!dqw_is_finite(mean_A2)) return;
    if ((e->heating & 1u) != 0) warm_one(e, 0, (float)periods, mean_A2);
    if ((e->heating & 2u) != 0) warm_one(e, 1, (float)periods, mean_A2);
}

void dqw_effect_gap(dqw_effect *e)
{
    e->has_sample = false;
}

#endif
