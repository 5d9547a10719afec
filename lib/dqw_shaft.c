// dqw_shaft: the start, and what the interrupt does. dqw_shaft_learn.c has the background.
#include "dqw_shaft.h"
#include "dqw_effect_kind.h"

#include <math.h>
#include <stddef.h>

#include "dqw_effect.h"
#include "dqw_gain.h"
#include "dqw_gate.h"
#include "dqw_number.h"
#include "dqw_window.h"

#define HALF_WINDOW 25
#define HALF_MAX 10000
#define WILD 10.0f
// By default: half a block in seconds and samples, width of a soft direction in rated speeds.
#define DEFAULT_HALF_S 25e-3f
#define DEFAULT_HALF_LEAST 10.0f
#define DEFAULT_WIDTH 0.01f
// Start variance of a per-unit weight: 1000 bases of standard deviation, so that a start value is no prior.
#define START_VARIANCE 1e6f
// Beyond this a start value would never be forgotten.
#define START_MAX_PU 4194304.0f
// Between these a value and its square keep all their digits.
#define UNIT_MIN 1e-18f
#define UNIT_MAX 1e18f

// Where a pair has its signals; the effects' stand behind.
enum { TORQUE = 0, STEP, SPEEDS, DIRECTIONS, PLAIN };

dqw_shaft_config dqw_shaft_config_default(const dqw_shaft_nameplate *nameplate)
{
    dqw_shaft_config c = {0};
    if (nameplate == NULL) return c;
    c.dt_s = nameplate->dt_s;
    c.torque_base_Nm = nameplate->torque_Nm;
    c.w_base_rad_s = nameplate->w_m_rad_s;
    c.coulomb = true;
    c.coulomb_width_rad_s = DEFAULT_WIDTH * nameplate->w_m_rad_s;
    if (!dqw_is_positive(nameplate->dt_s)) return c;
    const float half = DEFAULT_HALF_S / nameplate->dt_s + 0.5f;
    c.half_window = (uint16_t)(half < DEFAULT_HALF_LEAST ? DEFAULT_HALF_LEAST
                               : half < (float)HALF_MAX  ? half
                                                         : (float)HALF_MAX);
    return c;
}

static enum dqw_status check(const dqw_shaft_config *c)
{
    if (!dqw_is_positive(c->dt_s)) return DQW_ERR_DT;
    if (!dqw_is_positive(c->torque_base_Nm)) return DQW_ERR_TORQUE_BASE;
    if (!dqw_is_positive(c->w_base_rad_s)) return DQW_ERR_W_BASE;
    if (!dqw_is_zero_or_positive(c->J_kgm2)) return DQW_ERR_J;
    if (!dqw_is_zero_or_positive(c->B_Nms_rad)) return DQW_ERR_B;
    if (c->half_window > HALF_MAX) return DQW_ERR_HALF_WINDOW;
    if (!dqw_is_zero_or_positive(c->excitation_pu)) return DQW_ERR_EXCITATION;
    if (!dqw_is_zero_or_positive(c->standstill_rad_s)) return DQW_ERR_STANDSTILL;
    const float width = c->coulomb_width_rad_s;
    return dqw_is_zero_or_positive(width) && (width == 0.0f || dqw_is_positive(1.0f / width)) ? DQW_OK
                                                                                              : DQW_ERR_COULOMB_WIDTH;
}

// A start value per unit; false where it or its unit does not fit.
static bool start_at(float *w_pu, float value, float unit)
{
    *w_pu = value / unit;
    return dqw_within(unit, UNIT_MAX) && unit >= UNIT_MIN && dqw_within(*w_pu, START_MAX_PU);
}

static enum dqw_status init_effects(dqw_shaft *s, const dqw_shaft_config *c)
{
#if DQW_EFFECT_WEIGHTS > 0
    if (c->effect_count > 0 && c->effects == NULL) return DQW_ERR_EFFECT_LIST;
    for (int k = 0; k < c->effect_count; k++) {
        const dqw_effect_config *e = &c->effects[k];
        const int weights = dqw_effect_weights(e->effect);
        if (!dqw_effect_is_mechanical(e->effect)) return DQW_ERR_EFFECT_NAME;
        if (weights > DQW_EFFECT_WEIGHTS - s->weights) return DQW_ERR_EFFECT_ROOM;
        if (dqw_effect_check(e, 1, true) < 0) return DQW_ERR_EFFECT_SHAPE;
        s->needs_angle = s->needs_angle || e->effect == DQW_EFFECT_COGGING_TORQUE;
        for (int i = 0; i < weights; i++)
            if (!start_at(&s->w_pu[s->inputs++], e->start[i], c->torque_base_Nm)) return DQW_ERR_UNIT;
        s->weights = (uint8_t)(s->weights + weights);
    }
#else
    (void)s;
    (void)c;
#endif
    return DQW_OK;
}

static void pair_effects(dqw_shaft *s, float w_m_rad_s, float theta_m_rad, float pair[DQW_SHAFT_SIGNALS])
{
#if DQW_EFFECT_WEIGHTS > 0
    float x[DQW_EFFECT_WEIGHTS];
    int at = 0;
    for (int k = 0; k < s->config->effect_count; k++) {
        dqw_effect_torque(&s->config->effects[k], w_m_rad_s, theta_m_rad, x + at);
        at += dqw_effect_weights(s->config->effects[k].effect);
    }
    for (int i = 0; i < at; i++) {
        pair[PLAIN + i] = s->x_last[i] + x[i];
        s->x_last[i] = x[i];
    }
#else
    (void)s;
    (void)w_m_rad_s;
    (void)theta_m_rad;
    (void)pair;
#endif
}

enum dqw_status dqw_shaft_init(dqw_shaft *s, const dqw_shaft_config *config)
{
    if (s == NULL || config == NULL) return DQW_ERR_NULL;
    const dqw_shaft_config *c = config;
    enum dqw_status status = check(c);
    if (status != DQW_OK) return status;

    dqw_shaft n = {0};
    const int half = c->half_window != 0 ? c->half_window : HALF_WINDOW;
    n.config = config;
    n.B_unit_Nms_rad = c->torque_base_Nm / c->w_base_rad_s;
    // A full change of speed in half a block is one unit of the step.
    n.J_unit_kgm2 = n.B_unit_Nms_rad * c->dt_s * (float)half;
    if (!start_at(&n.w_pu[DQW_J], c->J_kgm2, n.J_unit_kgm2) ||
        !start_at(&n.w_pu[DQW_B], c->B_Nms_rad, n.B_unit_Nms_rad))
        return DQW_ERR_UNIT;
    n.inputs = c->coulomb ? DQW_COULOMB + 1 : DQW_COULOMB;
    if (c->coulomb && c->coulomb_width_rad_s > 0.0f) n.slope_s_rad = 1.0f / c->coulomb_width_rad_s;
    status = init_effects(&n, c);
    if (status == DQW_OK) status = dqw_gain_init(&n.gain, n.inputs, START_VARIANCE);
    if (status == DQW_OK) status = dqw_window_init(&n.window, half, PLAIN + n.weights);
    if (status != DQW_OK) return status;
    dqw_gate_init(&n.gate, 0);
    *s = n;
    return DQW_OK;
}

enum dqw_status dqw_shaft_define(dqw_shaft *s, const dqw_shaft_config *config)
{
    return dqw_shaft_init(s, config);
}

static float direction(const dqw_shaft *s, float w)
{
    if (!s->config->coulomb || !(fabsf(w) > s->config->standstill_rad_s)) return 0.0f;
    if (s->slope_s_rad > 0.0f) return tanhf(w * s->slope_s_rad);
    return w > 0.0f ? 1.0f : -1.0f;
}

// One pair, NULL where it is none; half a window that is full goes to the background, unless it still has the one
// before.
static uint32_t gather(dqw_shaft *s, const float pair[])
{
    dqw_window *w = &s->window;
    if (pair == NULL) {
        dqw_window_refuse(w);
    } else {
        dqw_window_cell *cell = dqw_window_cells(w);
        for (int i = 0; i < w->signals; i++) dqw_window_gather(&cell[i], pair[i]);
        dqw_window_count(w);
    }
    if (!dqw_window_full(w)) return 0;
    if (dqw_window_turn(w)) return DQW_EVENT_BLOCK;
    if (s->missed < UINT32_MAX) s->missed++;
    return DQW_EVENT_MISSED;
}

uint32_t dqw_shaft_sample(dqw_shaft *s, float torque_Nm, float w_m_rad_s, float theta_m_rad, bool saturated)
{
    // [SHAFT.1] may this sample be learned
    const dqw_shaft_config *c = s->config;
    const dqw_gate_sample g = {
        .finite = dqw_is_finite(torque_Nm) && dqw_is_finite(w_m_rad_s) &&
                  (!s->needs_angle || dqw_is_finite(theta_m_rad)),
        .saturated = saturated || fabsf(torque_Nm) > WILD * c->torque_base_Nm ||
                     fabsf(w_m_rad_s) > WILD * c->w_base_rad_s,
    };
    const uint32_t refused = dqw_gate_check(&s->gate, g);
    const bool paired = refused == 0 && s->has_last;
    s->has_last = refused == 0;

    // [SHAFT.2] the pair that it ends
    float pair[DQW_SHAFT_SIGNALS];
    if (refused == 0) {
        const float now = direction(s, w_m_rad_s);
        pair[TORQUE] = s->torque_last_Nm;
        pair[STEP] = w_m_rad_s - s->w_last_rad_s;
        pair[SPEEDS] = w_m_rad_s + s->w_last_rad_s;
        pair[DIRECTIONS] = now + s->direction_last;
        pair_effects(s, w_m_rad_s, theta_m_rad, pair);
        s->torque_last_Nm = torque_Nm;
        s->w_last_rad_s = w_m_rad_s;
        s->direction_last = now;
    }
    return refused | gather(s, paired ? pair : NULL);
}

void dqw_shaft_missing(dqw_shaft *s, uint32_t periods)
{
    s->has_last = false;
    if (periods == 1u) {
        const dqw_gate_sample none = {.finite = false};
        (void)dqw_gate_check(&s->gate, none);
        (void)gather(s, NULL);
    } else {
        dqw_window_restart(&s->window);
    }
}
