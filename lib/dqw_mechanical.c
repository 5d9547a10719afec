#include "dqw_mechanical.h"

#include <math.h>
#include <stddef.h>

#include "dqw_number.h"

#define HALF_WINDOW 25
#define EXCITATION_PU 0.002f
#define KNOWN_RATIO 0.25f
#define WILD 10.0f

enum { IN_J = 0, IN_B, IN_COULOMB };
// Signals of a pair: torque, slope of speed, speed, direction; then the effects' inputs.
enum { PLAIN = 4, SIGNALS = PLAIN + DQW_EFFECT_WEIGHTS };
// Inputs of the neuron: J, B, Coulomb friction where it is asked for, then the effects'.
enum { INPUTS = 3 + DQW_EFFECT_WEIGHTS };

#if DQW_EFFECT_WEIGHTS > 0
static int weights_of(const dqw_mechanical *m)
{
    return m->weights;
}

static enum dqw_status init_effects(dqw_mechanical *m, const dqw_mechanical_config *c, dqw_learner_config *neuron, float start[])
{
    const int weights = dqw_effect_check(c->effects, c->effect_count, true);
    if (weights < 0) return (enum dqw_status)weights;
    m->effects = c->effects;
    m->effect_count = c->effect_count;
    m->weights = (uint8_t)weights;
    for (int k = 0; k < c->effect_count; k++) {
        m->needs_angle = m->needs_angle || c->effects[k].effect == DQW_EFFECT_COGGING_TORQUE;
        for (int i = 0; i < dqw_effect_weights(c->effects[k].effect); i++) {
            neuron->x_base[neuron->inputs] = 1.0f;
            start[neuron->inputs++] = c->effects[k].start[i];
        }
    }
    return DQW_OK;
}

static bool finite_for_effects(const dqw_mechanical *m, float theta_m_rad)
{
    return !m->needs_angle || isfinite(theta_m_rad);
}

// Means of the effects' inputs over the pair that this sample ends, behind the plain signals.
static void pair_effects(dqw_mechanical *m, float w_m_rad_s, float theta_m_rad, float pair[SIGNALS])
{
    float x[DQW_EFFECT_WEIGHTS];
    int at = 0;
    for (int k = 0; k < m->effect_count; k++) {
        dqw_effect_torque(&m->effects[k], w_m_rad_s, theta_m_rad, x + at);
        at += dqw_effect_weights(m->effects[k].effect);
    }
    for (int i = 0; i < at; i++) {
        pair[PLAIN + i] = 0.5f * (m->x_last[i] + x[i]);
        m->x_last[i] = x[i];
    }
}
#else
static int weights_of(const dqw_mechanical *m)
{
    (void)m;
    return 0;
}

static enum dqw_status init_effects(dqw_mechanical *m, const dqw_mechanical_config *c, dqw_learner_config *neuron, float start[])
{
    (void)m;
    (void)c;
    (void)neuron;
    (void)start;
    return DQW_OK;
}

static bool finite_for_effects(const dqw_mechanical *m, float theta_m_rad)
{
    (void)m;
    (void)theta_m_rad;
    return true;
}

static void pair_effects(dqw_mechanical *m, float w_m_rad_s, float theta_m_rad, float pair[SIGNALS])
{
    (void)m;
    (void)w_m_rad_s;
    (void)theta_m_rad;
    (void)pair;
}
#endif

enum dqw_status dqw_mechanical_init(dqw_mechanical *m, const dqw_mechanical_config *config)
{
    if (m == NULL || config == NULL) return DQW_ERR_NULL;
    if (!dqw_is_positive(config->dt_s) || !dqw_is_positive(config->torque_base_Nm) || !dqw_is_positive(config->w_base_rad_s)) return DQW_ERR_RANGE;
    const float rest[] = {config->J_kgm2, config->B_Nms_rad, config->excitation_pu, config->standstill_rad_s, config->coulomb_width_rad_s};
    for (unsigned i = 0; i < sizeof rest / sizeof rest[0]; i++)
        if (!isfinite(rest[i]) || rest[i] < 0.0f) return DQW_ERR_RANGE;

    dqw_mechanical n = {0};
    const int half = config->half_window != 0 ? config->half_window : HALF_WINDOW;
    dqw_learner_config neuron = {.inputs = config->coulomb ? 3 : 2, .step_size = 1.0f, .y_base = config->torque_base_Nm};
    // A full change of speed within one block is the base of the slope.
    neuron.x_base[IN_J] = config->w_base_rad_s / (config->dt_s * (float)half);
    neuron.x_base[IN_B] = config->w_base_rad_s;
    neuron.x_base[IN_COULOMB] = 1.0f;
    float start[INPUTS] = {config->J_kgm2, config->B_Nms_rad};
    enum dqw_status status = init_effects(&n, config, &neuron, start);
    if (status == DQW_OK) status = dqw_axis_init(&n.axis, &neuron);
    for (int i = 0; status == DQW_OK && i < neuron.inputs; i++) status = dqw_learner_set_weight(&n.axis.neuron, i, start[i]);
    if (status == DQW_OK) status = dqw_window_init(&n.window, half, PLAIN + weights_of(&n));
    if (status != DQW_OK) return status;
    dqw_gate_init(&n.gate, 0);
    n.dt_s = config->dt_s;
    n.torque_limit_Nm = WILD * config->torque_base_Nm;
    n.w_limit_rad_s = WILD * config->w_base_rad_s;
    n.excitation_pu = config->excitation_pu > 0.0f ? config->excitation_pu : EXCITATION_PU;
    n.standstill_rad_s = config->standstill_rad_s;
    n.coulomb_width_rad_s = config->coulomb_width_rad_s;
    n.coulomb = config->coulomb;
    *m = n;
    return DQW_OK;
}

static float direction(const dqw_mechanical *m, float w)
{
    if (!(fabsf(w) > m->standstill_rad_s)) return 0.0f;
    if (m->coulomb_width_rad_s > 0.0f) return tanhf(w / m->coulomb_width_rad_s);
    return w > 0.0f ? 1.0f : -1.0f;
}

static uint32_t learn(dqw_mechanical *m, const float block[SIGNALS])
{
    // [MEC.1] the block's inputs, and which of them can teach their weight
    const dqw_learner *l = &m->axis.neuron;
    const int first = m->coulomb ? 3 : 2;
    const uint32_t inputs = l->inputs;
    float x[INPUTS] = {block[1], block[2], block[3]};
    for (int i = 0; i < weights_of(m); i++) x[first + i] = block[PLAIN + i];
    uint32_t mask = 0;
    for (uint32_t i = 0; i < inputs; i++)
        if (fabsf(x[i]) * l->x_scale[i] >= m->excitation_pu) mask |= 1u << i;
    const uint32_t event = mask != (1u << inputs) - 1u ? (uint32_t)DQW_EVENT_UNEXCITED : 0u;
    if (mask == 0) return event;

    // [MEC.2] one neuron for all of the shaft
    if (m->gate.blocks < UINT32_MAX) m->gate.blocks++;
    (void)dqw_axis_learn(&m->axis, x, block[0], mask);
    return event | DQW_EVENT_LEARNED;
}

uint32_t dqw_mechanical_step(dqw_mechanical *m, float torque_Nm, float w_m_rad_s)
{
    return dqw_mechanical_step_at(m, torque_Nm, w_m_rad_s, NAN);
}

uint32_t dqw_mechanical_step_at(dqw_mechanical *m, float torque_Nm, float w_m_rad_s, float theta_m_rad)
{
    // [MEC.3] may this sample be learned
    const dqw_gate_sample g = {.finite = isfinite(torque_Nm) && isfinite(w_m_rad_s) && finite_for_effects(m, theta_m_rad),
                               .saturated = fabsf(torque_Nm) > m->torque_limit_Nm || fabsf(w_m_rad_s) > m->w_limit_rad_s};
    uint32_t event = dqw_gate_check(&m->gate, g);

    // [MEC.4] the pair that it ends
    float pair[SIGNALS];
    const bool paired = event == 0 && m->has_last;
    if (paired) {
        pair[0] = m->torque_last_Nm;
        pair[1] = (w_m_rad_s - m->w_last_rad_s) / m->dt_s;
        pair[2] = 0.5f * (w_m_rad_s + m->w_last_rad_s);
        pair[3] = 0.5f * (direction(m, w_m_rad_s) + direction(m, m->w_last_rad_s));
    }
    if (event == 0) pair_effects(m, w_m_rad_s, theta_m_rad, pair);
    m->has_last = event == 0;
    m->torque_last_Nm = torque_Nm;
    m->w_last_rad_s = w_m_rad_s;

    // [MEC.5] a block, where half a window is full
    float block[SIGNALS];
    const uint32_t window = dqw_window_step(&m->window, paired ? pair : NULL, block);
    if (window == DQW_EVENT_LEARNED) {
        event |= learn(m, block);
    } else if (window == DQW_EVENT_INCOMPLETE) {
        event |= window;
        if (m->gate.incomplete < UINT32_MAX) m->gate.incomplete++;
    }
    return event;
}

void dqw_mechanical_gap(dqw_mechanical *m)
{
    m->has_last = false;
    dqw_window_restart(&m->window);
}

#if DQW_EFFECT_WEIGHTS > 0
int dqw_mechanical_effect(const dqw_mechanical *m, int index, float weights[], float sd[])
{
    if (index < 0 || index >= m->effect_count) return DQW_ERR_SIZE;
    int first = m->coulomb ? 3 : 2;
    for (int k = 0; k < index; k++) first += dqw_effect_weights(m->effects[k].effect);
    const int n = dqw_effect_weights(m->effects[index].effect);
    for (int i = 0; i < n; i++) {
        weights[i] = dqw_learner_weight(&m->axis.neuron, first + i);
        sd[i] = dqw_axis_weight_sd(&m->axis, first + i);
    }
    return (int)dqw_effect_known(weights, sd, n);
}
#endif

dqw_friction dqw_mechanical_read(const dqw_mechanical *m)
{
    const dqw_axis *a = &m->axis;
    dqw_friction f = {0};
    f.J_kgm2 = dqw_learner_weight(&a->neuron, IN_J);
    f.B_Nms_rad = dqw_learner_weight(&a->neuron, IN_B);
    f.J_sd_kgm2 = dqw_axis_weight_sd(a, IN_J);
    f.B_sd_Nms_rad = dqw_axis_weight_sd(a, IN_B);
    f.J_known = f.J_kgm2 > 0.0f && f.J_sd_kgm2 < KNOWN_RATIO * f.J_kgm2;
    f.B_known = f.B_Nms_rad > 0.0f && f.B_sd_Nms_rad < KNOWN_RATIO * f.B_Nms_rad;
    if (m->coulomb) {
        f.coulomb_Nm = dqw_learner_weight(&a->neuron, IN_COULOMB);
        f.coulomb_sd_Nm = dqw_axis_weight_sd(a, IN_COULOMB);
        f.coulomb_known = f.coulomb_Nm > 0.0f && f.coulomb_sd_Nm < KNOWN_RATIO * f.coulomb_Nm;
    }
    return f;
}
