// What the estimator starts from: units of its weights, and what may be asked of it.
#include <stddef.h>

#include "dqw_estimator_block_q15.h"
#include "dqw_estimator_random_q15.h"
#include "dqw_q15.h"

#define HALF_WINDOW 20
// Beyond that nobody controls a current.
#define ANGLE_LATE_PERIODS 2
// Where three deviations are more, no value is usable.
#define VOLTAGE_SCALE_MOST_PPM 100000u
#define ONE_Q15 32768
#define ONE_Q24 16777216
#define ONE_Q30 1073741824
#define RADIAN_Q28 268435456
// A unit is a voltage at full scale of what it acts on: 8 full voltages at most, 2^-17 at least; what a step of the
// full current may take.
#define MOST_BITS 43u
#define SLOPE_MOST_BITS 52u
#define LEAST_BITS 24u
// A nominal value beyond that is of no machine with these full scales; one beyond 32 units starts there.
#define NOMINAL_MOST ((int64_t)1 << 14)
#define START_MOST_Q24 ((int64_t)1 << 29)
// 3.6 widths must be a quarter of a thousandth of the full current, or their inverse does not fit.
#define WIDE_LEAST_Q28 65537
// Start variance over the residual's: (3 bases / 0.01)^2, and what the sums can hold of it, 2^21.
#define START_COV 90000
// An effect's weight: (10 bases / 0.01)^2.
#define START_EFFECT_COV 1000000
#define WIDEST_Q40 ((int64_t)1 << 61)
// Of a nameplate: the width of dead time in the rated current, equal samples.
#define DEAD_TIME_PARTS 50u
#define STALE_LIMIT 10u

static uint32_t turning(const dqw_estimator_q15_config *c, uint32_t pole_pairs)
{
    return c->speed_electrical ? 1u : pole_pairs != 0 ? pole_pairs : DQW_POLES_Q15_SCALE;
}

static uint8_t half_of(const dqw_estimator_q15_config *c)
{
    return c->half_window != 0 ? c->half_window : HALF_WINDOW;
}

static int64_t at_full_scale_q40(const dqw_scale *s, int parameter, uint32_t si)
{
    return parameter == DQW_R     ? dqw_scale_R_q40(s, si)
           : parameter == DQW_PSI ? dqw_scale_psi_q40(s, si)
                                  : dqw_scale_L_q40(s, si);
}

static int64_t turned_q40(int64_t x_q40, int parameter, int64_t turn_q28)
{
    return parameter == DQW_R ? x_q40 : dqw_q_product64(x_q40, turn_q28, -28);
}

static bool fits(int64_t x_q40, unsigned most)
{
    const unsigned bits = dqw_q_bits64(x_q40);
    return bits >= LEAST_BITS && bits <= most;
}

// A tenth of the full voltage for R and L, half of it for the flux, at full scale.
static int64_t base_of(const dqw_scale *s, int parameter, uint32_t pairs)
{
    const int64_t turning_mrad_s = (int64_t)s->w_full_mrad_s * pairs;
    if (parameter == DQW_R) return dqw_q_quotient64((int64_t)s->v_full_mV * 100000, s->i_full_mA, 0);
    if (parameter == DQW_PSI) return dqw_q_quotient64((int64_t)s->v_full_mV * 500000000, turning_mrad_s, 0);
    return dqw_q_quotient64((int64_t)s->v_full_mV * 100000000000, turning_mrad_s * s->i_full_mA, 0);
}

static bool fits_all(const dqw_estimator_q15_config *c, int parameter, int64_t x_q40, int64_t turn_q28)
{
    const bool slope = parameter == DQW_LD || parameter == DQW_LQ;
    return fits(turned_q40(x_q40, parameter, turn_q28), MOST_BITS) &&
           (!slope || c->settled || fits(x_q40, SLOPE_MOST_BITS));
}

static uint64_t width_uA(const dqw_estimator_q15_config *c)
{
#if DQW_EFFECT_WEIGHTS > 0
    for (int k = 0; k < c->effect_count; k++)
        if (c->effects[k].effect == DQW_EFFECT_DEAD_TIME) return c->effects[k].i_uA;
#endif
    return (uint64_t)c->dead_time_width_mA * 1000u;
}

enum dqw_status dqw_units_of_q15(const dqw_estimator_q15_config *config, uint32_t pole_pairs, dqw_units_q15 *u)
{
    static const enum dqw_status refused[] = {DQW_ERR_R, DQW_ERR_LD, DQW_ERR_LQ, DQW_ERR_PSI};
    const dqw_scale *s = &config->scale;
    const uint32_t nominal[] = {config->R_uohm, config->Ld_nH, config->Lq_nH, config->psi_nWb};
    // Units are of what is configured; rows of what was found.
    const uint32_t pairs = turning(config, s->pole_pairs);
    const int64_t turn_q28 = dqw_scale_turn_q28(s, pairs);
    const int64_t now_q28 = dqw_scale_turn_q28(s, turning(config, pole_pairs));
    int64_t q40[4];
    for (int i = 0; i < 4; i++) {
        const int64_t base = base_of(s, i, pairs);
        q40[i] = at_full_scale_q40(s, i, nominal[i]);
        u->si[i] = nominal[i];
        u->w_q24[i] = ONE_Q24;
        if (fits_all(config, i, q40[i], turn_q28)) continue;
        if (base < 1 || base > UINT32_MAX) return DQW_ERR_UNIT;
        if (nominal[i] >= NOMINAL_MOST * base) return refused[i];
        u->si[i] = (uint32_t)base;
        q40[i] = at_full_scale_q40(s, i, u->si[i]);
        if (!fits_all(config, i, q40[i], turn_q28)) return DQW_ERR_UNIT;
        const int64_t w_q24 = dqw_q_quotient64(nominal[i], base, 24);
        if (nominal[i] > 0) u->w_q24[i] = (int32_t)(w_q24 < START_MOST_Q24 ? w_q24 : START_MOST_Q24);
    }
    u->R_q40 = q40[0];
    for (int axis = 0; axis < 2; axis++) {
        u->L_q40[axis] = q40[DQW_LD + axis];
        u->X_q40[axis] = turned_q40(q40[DQW_LD + axis], DQW_LD, now_q28);
    }
    u->psi_q40 = turned_q40(q40[DQW_PSI], DQW_PSI, now_q28);
    u->width_q40 = config->angle ? dqw_q_quotient64((int64_t)width_uA(config), (int64_t)s->i_full_mA * 1000, 40) : 0;
    return DQW_OK;
}

int64_t dqw_estimator_whole_q40(const dqw_estimator_q15 *e, const dqw_units_q15 *u, int weight)
{
#if DQW_EFFECT_WEIGHTS > 0
    int at = DQW_PARAMETERS;
    for (int k = 0; k < e->effect.count && weight >= DQW_PARAMETERS; k++) {
        at += dqw_effect_weights_of_q15(&e->effect, e->effect.list[k].effect);
        if (weight < at) return (int64_t)e->effect.base_q28[k] * 4096;
    }
#endif
    switch (weight) {
    case DQW_R: return u->R_q40;
    // Of a slope, what one pole pair would make.
    case DQW_LD:
    case DQW_LQ: return dqw_q_floor64(u->X_q40[weight - DQW_LD], dqw_estimator_seeks_q15(e) ? DQW_POLES_Q15_BITS : 0u);
    case DQW_DEAD_CONSTANT: return ((int64_t)1 << 40) / DQW_DEAD_TIME_Q15_PARTS;
    case DQW_DEAD_TIME: return dqw_estimator_seeks_q15(e) ? u->X_q40[0] : ((int64_t)1 << 40) / DQW_DEAD_TIME_Q15_PARTS;
    case DQW_PSI_Q: return dqw_estimator_seeks_q15(e) ? u->X_q40[1] : u->psi_q40;
    default: return u->psi_q40;
    }
}

// Where an effect's weights start; in halvings of its input, so that a usual input makes a full voltage of one.
#if DQW_EFFECT_WEIGHTS > 0
static int64_t shifted_q24(const dqw_effect_q15 *f, int k, int i, unsigned shift)
{
    return dqw_q_scale64(dqw_effect_based_q40(f, k, i, f->list[k].start_q40[i]), -16 - (int)shift);
}

static unsigned shift_of(const dqw_effect_q15 *f, int k)
{
    return 28u - (dqw_q_bits64(f->base_q28[k]) < 9u    ? 9u
                  : dqw_q_bits64(f->base_q28[k]) > 28u ? 28u
                                                       : dqw_q_bits64(f->base_q28[k]));
}

static void start_effects(dqw_estimator_q15 *e, bool nominal)
{
    int at = 0;
    for (int k = 0; k < e->effect.count; k++)
        for (int i = 0; i < dqw_effect_weights_of_q15(&e->effect, e->effect.list[k].effect); i++, at++) {
            e->shift[at] = (uint8_t)shift_of(&e->effect, k);
            if (!nominal) continue;
            const int64_t w_q24 = shifted_q24(&e->effect, k, i, e->shift[at]);
            e->w_q24[DQW_PARAMETERS + at] = (int32_t)(w_q24 > START_MOST_Q24    ? START_MOST_Q24
                                                      : w_q24 < -START_MOST_Q24 ? -START_MOST_Q24
                                                                                : w_q24);
        }
}

static enum dqw_status check_effects(const dqw_estimator_q15_config *c, dqw_scale *scale, dqw_effect_q15 *effect)
{
    int dead = c->dead_time_width_mA != 0;
    for (int k = 0; k < c->effect_count; k++) {
        if (c->effects[k].effect != DQW_EFFECT_DEAD_TIME) continue;
        if (!c->angle) return DQW_ERR_EFFECT_ANGLE;
        if (++dead > 1) return DQW_ERR_EFFECT_TWICE;
        if (c->effects[k].i_uA == 0) return DQW_ERR_EFFECT_SHAPE;
    }
    *scale = c->scale;
    if (c->speed_electrical) scale->pole_pairs = 1;
    const dqw_effect_q15_base base = {
        .scale = scale, .settled = c->settled, .dead_time_apart = true, .half_window = half_of(c)};
    const enum dqw_status status = dqw_effect_init_q15(effect, c->effects, c->effect_count, &base);
    return status == DQW_OK && effect->needs_angle && !c->angle ? DQW_ERR_EFFECT_ANGLE : status;
}
#else
static void start_effects(dqw_estimator_q15 *e, bool nominal)
{
    (void)nominal;
    (void)e;
}
#endif

int64_t dqw_estimator_start_cov_q40(const dqw_estimator_q15 *e, const dqw_units_q15 *u, int weight)
{
    // Dead time's deviation is a tenth of the full voltage, as much as three of its units.
    const bool dead_time = weight == DQW_DEAD_CONSTANT || (weight == DQW_DEAD_TIME && !dqw_estimator_seeks_q15(e));
    const int64_t whole_q40 = dead_time ? (int64_t)1 << 40 : dqw_estimator_whole_q40(e, u, weight);
    const int64_t square_q40 = dqw_q_product64(whole_q40, whole_q40, -40);
    const int64_t cov_q40 = dqw_q_quotient64(weight < DQW_PARAMETERS ? START_COV : START_EFFECT_COV, square_q40, 80);
    return cov_q40 > 0 && cov_q40 < WIDEST_Q40 ? cov_q40 : WIDEST_Q40;
}

void dqw_estimator_start_q15(dqw_estimator_q15 *e, const int32_t start_q24[])
{
    // Without weights to start from, what the motion told of the pole pairs goes too.
    if (start_q24 == NULL) e->pole_pairs = e->config->scale.pole_pairs;
    e->turn_q28 = (int32_t)dqw_scale_turn_q28(&e->config->scale, turning(e->config, e->pole_pairs));
    dqw_units_q15 u;
    (void)dqw_units_of_q15(e->config, e->pole_pairs, &u);
    const int n = dqw_estimator_inputs_q15(e);
    const dqw_normal_q15 nothing = {.inputs = (uint8_t)(n + 1), .c_q32 = n + 1};
    e->normal = nothing;
    start_effects(e, start_q24 == NULL);
    for (int i = 0; i <= n; i++) {
        int64_t prior_q32 = 1;
        if (i < n) {
            e->cov_q40[i] = dqw_estimator_start_cov_q40(e, &u, i);
            prior_q32 = dqw_q_quotient64((int64_t)1 << 40, e->cov_q40[i], 32);
            e->excess_q10[i] = 0;
            if (start_q24 != NULL)
                e->w_q24[i] = start_q24[i];
            else if (i < DQW_PARAMETERS)
                e->w_q24[i] = i < 4 ? u.w_q24[i] : 0;
        }
        e->normal.a_q32[DQW_NORMAL_A(i, i)] = prior_q32;
    }
    for (int i = 0; i < DQW_ESTIMATOR_Q15_SCORES; i++) {
        e->score2_q68[i] = e->score_lag_q68[i] = 0;
        e->score_last_q34[i] = 0;
    }
    e->error_q56[0] = e->error_q56[1] = e->recent_q54 = 0;
    e->answered_q15 = 32768u;
    for (int L = 0; L < 2; L++) e->above_q10[L][0] = e->above_q10[L][1] = 0;
    dqw_estimator_follow_start_q15(e);
    e->blocks = 0;
    e->learned = 0;
    e->across = 0;
}

static enum dqw_status check(const dqw_estimator_q15_config *c, dqw_units_q15 *u)
{
    const enum dqw_status scale = dqw_scale_check(&c->scale);
    if (scale != DQW_OK) return scale;
#if DQW_EFFECT_WEIGHTS > 0
    if (c->effect_count > 0 && c->effects == NULL) return DQW_ERR_EFFECT_LIST;
    // Their laws see the currents as they come.
    if (c->effect_count > 0 && c->angle_late_ns != 0) return DQW_ERR_ANGLE_LATE;
    // Each of the list has a weight, but dead time, which stands in it once at most.
    if (c->effect_count > DQW_EFFECT_WEIGHTS + 1) return DQW_ERR_EFFECT_ROOM;
#endif
    if (c->excitation_q15 > DQW_SCALE_MOST_Q15) return DQW_ERR_EXCITATION;
    if (c->settled && (c->voltage_next || c->voltage_held)) return DQW_ERR_SETTLED;
    if (c->scale.pole_pairs == 0 && (c->voltage_held || c->speed_electrical)) return DQW_ERR_POLE_PAIRS;
    if ((unsigned)c->modulation >= DQW_MODULATIONS) return DQW_ERR_MODULATION;
    if (dqw_q_size64(c->angle_late_ns) > (int64_t)ANGLE_LATE_PERIODS * c->scale.dt_ns) return DQW_ERR_ANGLE_LATE;
    if (c->voltage_error_mV > DQW_SCALE_MAX) return DQW_ERR_VOLTAGE_ERROR;
    if (c->voltage_scale_ppm > VOLTAGE_SCALE_MOST_PPM) return DQW_ERR_VOLTAGE_SCALE;
    if (c->random != NULL && c->random->learn == NULL) return DQW_ERR_RANDOM;
    // Below one radian a period, and not standing still
    const int64_t turn_q28 = dqw_scale_turn_q28(&c->scale, turning(c, c->scale.pole_pairs));
    if (turn_q28 < 1 || turn_q28 >= RADIAN_Q28) return DQW_ERR_TURN;
    const enum dqw_status units = dqw_units_of_q15(c, c->scale.pole_pairs, u);
    if (units != DQW_OK) return units;
    const enum dqw_status width = c->dead_time_width_mA > 0 ? DQW_ERR_DEAD_TIME_WIDTH : DQW_ERR_EFFECT_SHAPE;
    if (u->width_q40 >= (int64_t)1 << 44) return width;
    const int64_t wide_q28 = dqw_q_quotient64(18 * u->width_q40, 5, -12);
    if (u->width_q40 > 0 && (wide_q28 < WIDE_LEAST_Q28 || wide_q28 > INT32_MAX)) return width;
    return c->half_window <= DQW_WINDOW_Q15_HALF ? DQW_OK : DQW_ERR_HALF_WINDOW;
}

enum dqw_status dqw_estimator_init_q15(dqw_estimator_q15 *e, const dqw_estimator_q15_config *config)
{
    if (e == NULL || config == NULL) return DQW_ERR_NULL;
    const dqw_estimator_q15_config *c = config;
    dqw_units_q15 u;
    const enum dqw_status status = check(c, &u);
    if (status != DQW_OK) return status;
#if DQW_EFFECT_WEIGHTS > 0
    dqw_effect_q15 effect;
    dqw_scale scale;
    const enum dqw_status listed = check_effects(c, &scale, &effect);
    if (listed != DQW_OK) return listed;
#endif

    // In place: a small core's stack has no room for a second one.
    const dqw_estimator_q15 zero = {.config = NULL};
    *e = zero;
    e->config = config;
#if DQW_EFFECT_WEIGHTS > 0
    e->scale = scale;
    e->effect = effect;
    e->effect.scale = &e->scale;
    e->inputs = (uint8_t)(DQW_PARAMETERS + effect.weights);
#endif
    (void)dqw_window_init_q15(&e->window, c->settled ? 1 : half_of(c),
                              DQW_PLAIN_Q15_SIGNALS + 2 * (dqw_estimator_inputs_q15(e) - DQW_PARAMETERS));
    e->turn_cosine_q30 = ONE_Q30;
    e->follow_q15 = ONE_Q15;
    e->given.follow_q15 = ONE_Q15;
    if (u.width_q40 > 0) {
        e->wide_q28 = (int32_t)dqw_q_quotient64(18 * u.width_q40, 5, -12);
        e->per_wide = dqw_q31_sat(dqw_q_quotient64(1, e->wide_q28, 47));
    }
    const bool unknown = c->modulation == DQW_MODULATION_UNKNOWN;
    e->modulation = (uint8_t)(unknown ? DQW_MODULATION_CENTRED : c->modulation);
    e->trial = unknown && e->wide_q28 > 0 && !c->settled ? DQW_ESTIMATOR_SEEKS_Q15 : 0;
    dqw_estimator_start_q15(e, NULL);
    dqw_gate_init(&e->gate, c->stale_limit);
    dqw_stage_init(&e->stage, c->threshold_ppm);
    dqw_stage_define(&e->stage);
    return DQW_OK;
}

enum dqw_status dqw_estimator_define_q15(dqw_estimator_q15 *e, const dqw_estimator_q15_config *config)
{
    if (e == NULL || config == NULL) return DQW_ERR_NULL;
    const dqw_stage stage = e->stage;
    dqw_gate gate = e->gate;
    const uint32_t halves = e->halves;
    const uint8_t missed = e->missed;
    const enum dqw_status status = dqw_estimator_init_q15(e, config);
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

static uint32_t half_more(uint32_t rated)
{
    const uint64_t full = (uint64_t)rated + rated / 2u;
    return full < DQW_SCALE_MAX ? (uint32_t)full : DQW_SCALE_MAX;
}

dqw_estimator_q15_config dqw_estimator_config_default_q15(const dqw_nameplate_q15 *plate)
{
    const dqw_estimator_q15_config none = {.R_uohm = 0};
    if (plate == NULL) return none;
    dqw_estimator_q15_config c = {.scale = {.v_full_mV = half_more(plate->v_mV),
                                            .i_full_mA = half_more(plate->i_mA),
                                            .w_full_mrad_s = half_more(plate->w_mrad_s),
                                            .dt_ns = plate->dt_ns,
                                            .pole_pairs = plate->pole_pairs},
                                  .dead_time_width_mA = plate->i_mA / DEAD_TIME_PARTS,
                                  .stale_limit = STALE_LIMIT,
                                  .angle = true,
                                  .encoder_offset = true,
                                  .follow = true,
                                  .noise_on_inputs = true};
    const dqw_scale rated = {.w_full_mrad_s = plate->w_mrad_s, .dt_ns = plate->dt_ns, .pole_pairs = plate->pole_pairs};
    const uint16_t half = dqw_nameplate_half_window_q15(&rated);
    c.half_window = (uint8_t)(half < DQW_WINDOW_Q15_HALF ? half : DQW_WINDOW_Q15_HALF);
    return c;
}
