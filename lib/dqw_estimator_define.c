// How an estimator begins: which configuration it takes, and what it knows then.
#include <stddef.h>

#include "dqw_estimator_block.h"
#include "dqw_estimator_random.h"
#include "dqw_half_window.h"
#include "dqw_segment.h"
#include "dqw_number.h"

#define HALF_WINDOW 20
#define HALF_WINDOW_MOST 10000
// No number of a drive is larger.
#define FIELD_MOST 1e30f
// No drive gives a sample of this many bases.
#define WILD 10.0f
// Where nominal values are not known: parts of what the bases make of each.
#define USUAL_R_PU 0.1f
#define USUAL_L_PU 0.1f
#define USUAL_PSI_PU 0.5f
// Start deviations: no machine's weight is three bases, no inverter loses a third of its voltage; a polynomial's parts
// may be large against each other. (E92)
#define START_SD_PU 3.0f
#define START_DEAD_SD_PU 0.1f
#define START_EFFECT_SD_PU 10.0f
// Beyond that nobody controls a current.
#define ANGLE_LATE_PERIODS 2.0f
// Where three deviations are more, no value is usable.
#define VOLTAGE_SCALE_MOST_PPM 100000u
// Of a default configuration.
#define DEAD_TIME_WIDTH_PU 0.02f
#define STALE 10u

float dqw_estimator_unit(const dqw_estimator *e, int weight)
{
    const dqw_estimator_config *c = e->config;
    const float turning = (float)(e->pole_pairs != 0 ? e->pole_pairs : 1) * c->w_base_rad_s;
    switch (weight) {
    case DQW_R: return c->v_base_V / c->i_base_A;
    case DQW_LD:
    case DQW_LQ: return c->v_base_V / (c->i_base_A * turning);
    case DQW_PSI: return c->v_base_V / turning;
    case DQW_DEAD_CONSTANT: return c->v_base_V;
    case DQW_DEAD_TIME: return e->pole_pairs == 0 && !c->settled ? c->v_base_V / (c->i_base_A * turning) : c->v_base_V;
    case DQW_PSI_Q:
        return e->pole_pairs == 0 && !c->settled ? c->v_base_V / (c->i_base_A * turning) : c->v_base_V / turning;
    default: break;
    }
#if DQW_EFFECT_WEIGHTS > 0
    int first = DQW_PARAMETERS;
    for (int k = 0; k < e->effect.count; k++) {
        first += dqw_effect_weights_of(&e->effect, e->effect.list[k].effect);
        if (weight < first) return c->v_base_V / dqw_effect_input_base(&e->effect, k);
    }
#endif
    return 0.0f;
}

float dqw_estimator_start_sd_pu(const dqw_estimator *e, int weight)
{
    // The same place, an inductance.
    if (weight == DQW_POLES_LD && e->pole_pairs == 0 && !e->config->settled) return START_SD_PU;
    const bool dead = weight == DQW_DEAD_TIME || weight == DQW_DEAD_CONSTANT;
    return dead ? START_DEAD_SD_PU : weight < DQW_PARAMETERS ? START_SD_PU : START_EFFECT_SD_PU;
}

float dqw_estimator_nominal_pu(const dqw_estimator *e, int weight)
{
    const dqw_estimator_config *c = e->config;
    const float nominal[] = {c->R_ohm, c->Ld_H, c->Lq_H, c->psi_Wb};
    static const float usual_pu[] = {USUAL_R_PU, USUAL_L_PU, USUAL_L_PU, USUAL_PSI_PU};
    return nominal[weight] > 0.0f ? nominal[weight] / dqw_estimator_unit(e, weight) : usual_pu[weight];
}

static void start_effects(dqw_estimator *e)
{
#if DQW_EFFECT_WEIGHTS > 0
    int at = DQW_PARAMETERS;
    for (int k = 0; k < e->effect.count; k++) {
        const dqw_effect_config *effect = &e->effect.list[k];
        if (effect->effect == DQW_EFFECT_DEAD_TIME)
            e->w_pu[DQW_DEAD_TIME] = effect->start[0] / dqw_estimator_unit(e, DQW_DEAD_TIME);
        for (int i = 0; i < dqw_effect_weights_of(&e->effect, effect->effect); i++, at++)
            e->w_pu[at] = effect->start[i] / dqw_estimator_unit(e, at);
    }
#else
    (void)e;
#endif
}

void dqw_estimator_start(dqw_estimator *e, const float start_pu[])
{
    (void)dqw_gain_init(&e->gain, e->inputs, 1.0f);
    for (int i = 0; i < e->inputs; i++) {
        const float sd = dqw_estimator_start_sd_pu(e, i) * (1.0f / DQW_ESTIMATOR_START_RESIDUAL_PU);
        e->gain.d[i] = sd * sd;
        e->w_pu[i] = 0.0f;
        e->excess_q10[i] = 0;
    }
    for (int i = 0; i <= DQW_PSI; i++) e->w_pu[i] = dqw_estimator_nominal_pu(e, i);
    start_effects(e);
    float band_pu[DQW_FOLLOWED];
    dqw_estimator_least_bands(e, band_pu);
    dqw_segment_init(&e->segment, band_pu);
    for (int i = 0; start_pu != NULL && i < e->inputs; i++) e->w_pu[i] = start_pu[i];
    for (int i = 0; i < DQW_ESTIMATOR_SCORES; i++) e->score2[i] = e->score_lag[i] = e->score_last[i] = 0.0f;
    for (int i = 0; i < DQW_ESTIMATOR_INPUTS; i++) e->late_w[i] = 0.0f;
    e->late_pu2 = e->late_error_pu2 = 0.0f;
    e->error_pu2[0] = e->error_pu2[1] = e->recent_pu2 = 0.0f;
    for (int k = 0; k < 3; k++) e->lasting_pu2[k] = 0.0f;
    e->slow_pu2 = 0.0f;
    e->slow_at = e->across = 0;
    for (int i = 0; i < DQW_ESTIMATOR_INPUTS; i++) e->slow_alone_pu2[i] = 0.0f;
    e->slow_before_pu[0] = e->slow_before_pu[1] = 0.0f;
    for (int i = 0; i < DQW_ESTIMATOR_INPUTS; i++) e->alone_pu2[i] = 0.0f;
    e->noisy_pu2[0] = e->noisy_pu2[1] = 0.0f;
    e->answered = 1.0f;
    for (int L = 0; L < 2; L++) e->above_q10[L][0] = e->above_q10[L][1] = 0;
    for (int k = 0; k < 3; k++) e->e_before_pu[k][0] = e->e_before_pu[k][1] = 0.0f;
    e->blocks = 0;
    e->learned = 0;
}

static enum dqw_status check_numbers(const dqw_estimator_config *c)
{
    enum { NEEDED = 4 };
#define AT(member) offsetof(dqw_estimator_config, member)
    static const uint8_t at[] = {AT(dt_s),           AT(v_base_V),  AT(i_base_A),      AT(w_base_rad_s),
                                 AT(R_ohm),          AT(Ld_H),      AT(Lq_H),          AT(psi_Wb),
                                 AT(v_limit_V),      AT(i_limit_A), AT(excitation_pu), AT(dead_time_width_A),
                                 AT(voltage_error_V)};
#undef AT
    static const int8_t status[] = {DQW_ERR_DT,           DQW_ERR_V_BASE,     DQW_ERR_I_BASE,
                                    DQW_ERR_W_BASE,       DQW_ERR_R,          DQW_ERR_LD,
                                    DQW_ERR_LQ,           DQW_ERR_PSI,        DQW_ERR_V_LIMIT,
                                    DQW_ERR_I_LIMIT,      DQW_ERR_EXCITATION, DQW_ERR_DEAD_TIME_WIDTH,
                                    DQW_ERR_VOLTAGE_ERROR};
    for (unsigned i = 0; i < sizeof at; i++) {
        const float field = *(const float *)(const void *)((const char *)c + at[i]);
        if (!dqw_within(field, FIELD_MOST) || !(field >= 0.0f) || (i < NEEDED && field == 0.0f))
            return (enum dqw_status)status[i];
    }
    return DQW_OK;
}

static enum dqw_status check(const dqw_estimator_config *c)
{
    const enum dqw_status status = check_numbers(c);
    if (status != DQW_OK) return status;
    if (c->half_window > HALF_WINDOW_MOST) return DQW_ERR_HALF_WINDOW;
    if (c->settled && (c->voltage_next || c->voltage_held)) return DQW_ERR_SETTLED;
    if (c->pole_pairs == 0 && (c->voltage_held || c->speed_electrical)) return DQW_ERR_POLE_PAIRS;
    if (c->dead_time_width_A > 0.0f && !dqw_is_finite(1.0f / c->dead_time_width_A)) return DQW_ERR_DEAD_TIME_WIDTH;
    if ((unsigned)c->modulation >= DQW_MODULATIONS) return DQW_ERR_MODULATION;
    if (!dqw_within(c->angle_late_s, ANGLE_LATE_PERIODS * c->dt_s)) return DQW_ERR_ANGLE_LATE;
    if (c->voltage_scale_ppm > VOLTAGE_SCALE_MOST_PPM) return DQW_ERR_VOLTAGE_SCALE;
#if DQW_EFFECT_WEIGHTS > 0
    // Their laws see the currents as they come.
    if (c->angle_late_s != 0.0f && c->effect_count > 0) return DQW_ERR_ANGLE_LATE;
#endif
    if (c->random != NULL && c->random->learn == NULL) return DQW_ERR_RANDOM;
    return DQW_OK;
}

static enum dqw_status init_effects(dqw_estimator *e, const dqw_estimator_config *c)
{
#if DQW_EFFECT_WEIGHTS > 0
    const dqw_effect_base base = {c->dt_s, c->v_base_V, c->i_base_A, c->w_base_rad_s, c->pole_pairs, true};
    const enum dqw_status status = dqw_effect_init(&e->effect, c->effects, c->effect_count, &base);
    if (status != DQW_OK) return status;
    if (e->effect.needs_angle && !c->angle) return DQW_ERR_EFFECT_ANGLE;
    for (int k = 0; k < c->effect_count; k++) {
        if (c->effects[k].effect != DQW_EFFECT_DEAD_TIME) continue;
        if (!c->angle) return DQW_ERR_EFFECT_ANGLE;
        e->dead_time_width_A = c->effects[k].shape[0];
    }
    e->inputs = (uint8_t)(DQW_PARAMETERS + e->effect.weights);
    return DQW_OK;
#else
    (void)e;
    (void)c;
    return DQW_OK;
#endif
}

enum dqw_status dqw_estimator_init(dqw_estimator *e, const dqw_estimator_config *config)
{
    if (e == NULL || config == NULL) return DQW_ERR_NULL;
    const dqw_estimator_config *c = config;
    enum dqw_status status = check(c);
    if (status != DQW_OK) return status;
    dqw_estimator n = {
        .config = config, .follow = 1.0f, .turn_cosine = 1.0f, .inputs = DQW_PARAMETERS, .pole_pairs = c->pole_pairs};
    // Without an angle there is no phase whose current has a sign.
    n.dead_time_width_A = c->angle ? c->dead_time_width_A : 0.0f;
    status = init_effects(&n, c);
    if (status != DQW_OK) return status;
    const bool unknown = c->modulation == DQW_MODULATION_UNKNOWN;
    n.modulation = (uint8_t)(unknown ? DQW_MODULATION_CENTRED : c->modulation);
    n.trial = unknown && n.dead_time_width_A > 0.0f && !c->settled ? DQW_ESTIMATOR_SEEKS : 0;
    const int half = c->settled ? 1 : c->half_window != 0 ? c->half_window : HALF_WINDOW;
    (void)dqw_window_init(&n.window, half, DQW_PLAIN_SIGNALS + 2 * (n.inputs - DQW_PARAMETERS));
    for (int i = 0; i < n.inputs; i++)
        if (!dqw_is_positive(dqw_estimator_unit(&n, i))) return DQW_ERR_UNIT;
    dqw_estimator_start(&n, NULL);
    for (int i = 0; i < n.inputs; i++)
        if (!dqw_is_finite(n.w_pu[i])) return DQW_ERR_UNIT;
    n.v_limit_bits = dqw_size_bits(c->v_limit_V > 0.0f ? c->v_limit_V : WILD * c->v_base_V);
    n.i_limit_bits = dqw_size_bits(c->i_limit_A > 0.0f ? c->i_limit_A : WILD * c->i_base_A);
    n.w_limit_bits = dqw_size_bits(WILD * c->w_base_rad_s);
    dqw_gate_init(&n.gate, c->stale_limit);
    dqw_stage_init(&n.stage, c->threshold_ppm);
    dqw_stage_define(&n.stage);
    *e = n;
    return DQW_OK;
}

enum dqw_status dqw_estimator_define(dqw_estimator *e, const dqw_estimator_config *config)
{
    if (e == NULL) return DQW_ERR_NULL;
    const dqw_stage stage = e->stage;
    dqw_gate gate = e->gate;
    const uint32_t halves = e->halves;
    const uint8_t missed = e->missed;
    const enum dqw_status status = dqw_estimator_init(e, config);
    if (status != DQW_OK) return status;
    e->stage.back = stage.back;
    e->stage.times_back = stage.times_back;
    e->stage.residual_ppm = stage.residual_ppm;
    gate.stale_limit = config->stale_limit;
    e->gate = gate;
    e->halves = e->number = halves;
    e->missed = missed;
    return DQW_OK;
}

dqw_estimator_config dqw_estimator_config_default(const dqw_nameplate *plate)
{
    const dqw_estimator_config none = {.dt_s = 0.0f};
    dqw_estimator_config c = none;
    if (plate == NULL) return c;
    c.dt_s = plate->dt_s;
    c.v_base_V = plate->v_V;
    c.i_base_A = plate->i_A;
    c.w_base_rad_s = plate->w_m_rad_s;
    c.pole_pairs = plate->pole_pairs;
    c.half_window = dqw_nameplate_half_window(plate);
    c.dead_time_width_A = DEAD_TIME_WIDTH_PU * plate->i_A;
    c.stale_limit = STALE;
    c.angle = true;
    c.follow = true;
    c.encoder_offset = true;
    c.noise_on_inputs = true;
    return c;
}
