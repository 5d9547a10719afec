#include "sim_keys.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "sim_signal.h"

// clang-format off
#define FIELD(name, field, kind, rule, choices)                                                                      \
    {#name, offsetof(dqw_sim_scenario, field), DQW_SIM_FIELD_##kind, DQW_SIM_##rule, choices}
#define NUMBER(field, rule) FIELD(field, field, DOUBLE, rule, NULL)
#define OTHER(field, kind) FIELD(field, field, kind, ANY, NULL)
#define COUNT(field) OTHER(field, INT)
#define CHOICE(field, names) FIELD(field, field, CHOICE, ANY, names)
// A ramp or a signal alone stands for its value.
#define RAMP(field, rule)                                                                                            \
    FIELD(field, field.value, RAMP, rule, NULL), NUMBER(field.t_start_s, ANY), NUMBER(field.t_end_s, ANY)
#define SIGNAL(field)                                                                                                \
    FIELD(field, field.value, DOUBLE, ANY, NULL), NUMBER(field.step, ANY), NUMBER(field.t_step_s, ANY),              \
        NUMBER(field.wave, ANY), NUMBER(field.wave_period_s, ANY),                                                   \
        CHOICE(field.shape, "sine square triangle stairs "), COUNT(field.levels), NUMBER(field.random, ANY),         \
        NUMBER(field.random_hold_s, ANY), NUMBER(field.binary, ANY), NUMBER(field.binary_hold_s, ANY)

// A key, and what its value may be. Beside those of an effect of the catalogue stands its name: lint looks there.
static const dqw_sim_field fields[] = {
    NUMBER(duration_s, ABOVE_0), NUMBER(rtol, ABOVE_0), CHOICE(method, "adams bdf rk4 "), OTHER(balance, BOOL),
    OTHER(seed, SEED),
    COUNT(machine.pole_pairs), NUMBER(machine.R_ohm, ABOVE_0), NUMBER(machine.Ld_H, ABOVE_0),
    NUMBER(machine.Lq_H, ABOVE_0), NUMBER(machine.psi_Wb, FROM_0), NUMBER(machine.J_kgm2, FROM_0),
    NUMBER(machine.B_Nms_rad, FROM_0),
    NUMBER(machine.coulomb_Nm, FROM_0), NUMBER(machine.coulomb_width_rad_s, FROM_0),  // coulomb_friction
    NUMBER(machine.temp_ref_C, ANY), NUMBER(machine.temp_ambient_C, ANY), NUMBER(machine.temp_start_C, ANY),
    NUMBER(machine.winding_heat_J_K, FROM_0), NUMBER(machine.magnet_heat_J_K, FROM_0),
    NUMBER(machine.winding_magnet_W_K, FROM_0), NUMBER(machine.winding_ambient_W_K, FROM_0),
    NUMBER(machine.magnet_ambient_W_K, FROM_0), NUMBER(machine.housing_heat_J_K, FROM_0),
    NUMBER(machine.winding_housing_W_K, FROM_0), NUMBER(machine.magnet_housing_W_K, FROM_0),
    NUMBER(machine.housing_ambient_W_K, FROM_0), OTHER(machine.flux_map, PATH),  // flux_map
    RAMP(nonideal.dead_time_V, FROM_0), NUMBER(nonideal.dead_time_width_A, FROM_0),  // dead_time
    RAMP(nonideal.saturation_dd_A_Wb3, ANY), RAMP(nonideal.saturation_qq_A_Wb3, ANY),  // saturation
    RAMP(nonideal.saturation_dq_A_Wb3, ANY),  // cross_saturation
    RAMP(nonideal.iron_loss_S, FROM_0),  // iron_loss
    RAMP(nonideal.iron_hysteresis_S_rad_s, FROM_0), NUMBER(nonideal.iron_hysteresis_corner_rad_s, FROM_0),
    NUMBER(nonideal.iron_loss_tau_s, FROM_0), RAMP(nonideal.heat_W, ANY),
    RAMP(nonideal.winding_alpha_per_K, ANY),  // winding_temperature
    RAMP(nonideal.magnet_beta_per_K, ANY),  // magnet_temperature
    RAMP(nonideal.turn_short, BELOW_1), NUMBER(nonideal.turn_short_ohm, FROM_0),
    NUMBER(nonideal.turn_short_H, FROM_0),
    RAMP(nonideal.demagnetisation, BELOW_1), RAMP(nonideal.phase_connection_ohm, FROM_0),
    RAMP(nonideal.bearing_Nm, FROM_0), RAMP(nonideal.bearing_B_Nms_rad, FROM_0),
    RAMP(nonideal.skin_effect_s2_rad2, FROM_0),  // skin_effect
    RAMP(nonideal.phase_resistance_a_ohm, ANY),  // phase_resistance_imbalance
    RAMP(nonideal.phase_resistance_b_ohm, ANY),
    RAMP(nonideal.flux_harmonic_6d_Wb, ANY), RAMP(nonideal.flux_harmonic_6q_Wb, ANY),  // flux_harmonics
    NUMBER(nonideal.flux_harmonic_6_phase_rad, ANY), RAMP(nonideal.flux_harmonic_12d_Wb, ANY),
    RAMP(nonideal.flux_harmonic_12q_Wb, ANY), NUMBER(nonideal.flux_harmonic_12_phase_rad, ANY),
    RAMP(nonideal.magnet_asymmetry_Wb, ANY), NUMBER(nonideal.magnet_asymmetry_phase_rad, ANY),
    RAMP(nonideal.delay_periods, TO_2),  // delay
    RAMP(nonideal.current_gain_a, A_GAIN), RAMP(nonideal.current_gain_b, A_GAIN),  // current_gain_mismatch
    RAMP(nonideal.current_gain_c, A_GAIN),
    RAMP(nonideal.current_offset_alpha_A, ANY), RAMP(nonideal.current_offset_beta_A, ANY),  // current_offset
    RAMP(nonideal.angle_offset_rad, ANY),  // angle_offset
    RAMP(nonideal.voltage_offset_d_V, ANY), RAMP(nonideal.voltage_offset_q_V, ANY),  // voltage_offset
    RAMP(nonideal.stribeck_Nm, FROM_0), NUMBER(nonideal.stribeck_width_rad_s, FROM_0),  // stribeck_friction
    RAMP(nonideal.friction_asymmetry_Nm, ANY),  // direction_asymmetry
    RAMP(nonideal.cogging_Nm, FROM_0), COUNT(nonideal.cogging_order),  // cogging_torque
    NUMBER(nonideal.cogging_phase_rad, ANY),
    OTHER(nonideal.inverter_curve, PATH),
    RAMP(nonideal.disturbance_V, FROM_0), NUMBER(nonideal.disturbance_Hz, FROM_0), RAMP(nonideal.hum_A, FROM_0),
    NUMBER(nonideal.hum_Hz, FROM_0), NUMBER(nonideal.clip_A, FROM_0), NUMBER(nonideal.dropped_fraction, BELOW_1),
    CHOICE(inverter.modulation, "mean centred clamped_low clamped_high clamped_60 "), COUNT(inverter.carriers),
    COUNT(inverter.compare_counts), NUMBER(inverter.dead_time_s, FROM_0),
    CHOICE(inverter.dead_side, "both upper lower "), NUMBER(inverter.node_F, FROM_0),
    NUMBER(inverter.switch_V, FROM_0), NUMBER(inverter.switch_ohm, FROM_0), NUMBER(inverter.diode_V, FROM_0),
    NUMBER(inverter.diode_ohm, FROM_0), NUMBER(inverter.knee_A, FROM_0),
    CHOICE(inverter.reverse, "diode channel "), NUMBER(inverter.source_ohm, FROM_0), NUMBER(inverter.link_F, FROM_0),
    NUMBER(inverter.ripple_V, FROM_0), NUMBER(inverter.ripple_Hz, FROM_0),
    CHOICE(sensing.phases, "abc ab bc ca "), NUMBER(sensing.late_periods, BELOW_1), NUMBER(sensing.filter_s, FROM_0),
    NUMBER(sensing.noise_A, FROM_0), NUMBER(sensing.once_rad, ANY), NUMBER(sensing.once_phase_rad, ANY),
    NUMBER(sensing.twice_rad, ANY), NUMBER(sensing.twice_phase_rad, ANY),
    NUMBER(sensing.angle_late_periods, TO_1), NUMBER(sensing.speed_bandwidth_rad_s, FROM_0),
    OTHER(sensing.observer, BOOL), NUMBER(sensing.observer_lag_s, ANY), NUMBER(sensing.observer_load_rad_A, ANY),
    NUMBER(sensing.observer_noise_rad, FROM_0), NUMBER(sensing.observer_corner_rad_s, FROM_0),
    NUMBER(sensing.observer_bandwidth_rad_s, FROM_0),
    NUMBER(drive.dt_s, ABOVE_0), NUMBER(drive.v_dc_V, ABOVE_0), NUMBER(drive.current_bandwidth_rad_s, FROM_0),
    NUMBER(drive.speed_bandwidth_rad_s, FROM_0), NUMBER(drive.i_max_A, ABOVE_0), CHOICE(drive.hold, "abc dq "),
    OTHER(drive.unturned, BOOL), OTHER(drive.overmodulation, BOOL), NUMBER(drive.compensation, FROM_0),
    NUMBER(drive.compensation_width_A, FROM_0), CHOICE(drive.link, "measured nominal "),
    CHOICE(drive.logged, "mean decided "),
    COUNT(drive.log_every), COUNT(drive.log_window),
    NUMBER(polled.rate_Hz, FROM_0), COUNT(polled.queue_rows), NUMBER(polled.jitter_s, FROM_0),
    NUMBER(polled.lost_fraction, BELOW_1), NUMBER(polled.repeated_fraction, BELOW_1),
    NUMBER(polled.speed_noise_rad_s, FROM_0), NUMBER(polled.step_i_A, FROM_0), NUMBER(polled.step_v_V, FROM_0),
    NUMBER(polled.step_erpm, FROM_0), NUMBER(polled.step_v_dc_V, FROM_0),
    CHOICE(profile.control, "speed current voltage "), CHOICE(profile.shaft, "free imposed "),
    NUMBER(profile.speed_start_rad_s, ANY), SIGNAL(profile.speed_rad_s), SIGNAL(profile.i_d_A), SIGNAL(profile.i_q_A),
    SIGNAL(profile.v_d_V), SIGNAL(profile.v_q_V),
    SIGNAL(profile.load_Nm),  // load_torque
    NUMBER(noise.i, FROM_0), NUMBER(noise.v, FROM_0), NUMBER(noise.w, FROM_0), NUMBER(noise.theta, FROM_0),
    NUMBER(noise.v_dc, FROM_0), NUMBER(noise.temp, FROM_0), NUMBER(noise.torque, FROM_0),
    NUMBER(noise.step_i_A, FROM_0), NUMBER(noise.step_v_V, FROM_0), NUMBER(noise.step_w_rad_s, FROM_0),
    NUMBER(noise.step_theta_m_rad, FROM_0), NUMBER(noise.step_v_dc_V, FROM_0), NUMBER(noise.step_temp_C, FROM_0),
    NUMBER(noise.step_torque_Nm, FROM_0), OTHER(noise.seed, SEED),
};
// clang-format on

// Beside the fields: a name for all noise at once, and short names.
static const char *const noise_channels[] = {"noise.i",    "noise.v",    "noise.w",     "noise.theta",
                                             "noise.v_dc", "noise.temp", "noise.torque"};
static const char *const shorthands[] = {"noise",       "noise_i",    "noise_v",    "noise_w",
                                         "noise_theta", "noise_v_dc", "noise_temp", "noise_torque"};
enum {
    FIELDS = sizeof fields / sizeof *fields,
    CHANNELS = sizeof noise_channels / sizeof *noise_channels,
    SHORTHANDS = sizeof shorthands / sizeof *shorthands
};

// A ramp begins with its value.
void dqw_sim_ramps_at(const dqw_sim_scenario *s, double t_s, dqw_sim_nonideal *now)
{
    for (size_t i = 0; i < FIELDS; ++i) {
        if (fields[i].kind != DQW_SIM_FIELD_RAMP) continue;
        const dqw_sim_ramp *ramp = (const void *)((const char *)s + fields[i].offset);
        char *to = (char *)now + fields[i].offset - offsetof(dqw_sim_scenario, nonideal);
        *(double *)(void *)to = dqw_sim_ramp_at(ramp, t_s);
    }
}

size_t dqw_sim_field_count(void) { return FIELDS; }
const dqw_sim_field *dqw_sim_field_at(size_t index) { return index < FIELDS ? &fields[index] : NULL; }

const char *dqw_sim_key_at(size_t index)
{
    if (index < FIELDS) return fields[index].key;
    return index < FIELDS + SHORTHANDS ? shorthands[index - FIELDS] : NULL;
}

static int choice_of(const char *choices, const char *value)
{
    const size_t length = strchr(value, ' ') ? 0 : strlen(value);
    int n = 0;
    for (const char *c = choices; *c; c = strchr(c, ' ') + 1, ++n)
        if (length && strncmp(c, value, length) == 0 && c[length] == ' ') return n;
    return -1;
}

static int set_field(char *to, const dqw_sim_field *f, const char *value)
{
    char *end = NULL;
    errno = 0;
    switch (f->kind) {
    case DQW_SIM_FIELD_DOUBLE:
    case DQW_SIM_FIELD_RAMP: {
        const double x = strtod(value, &end);
        if (end == value || *end || !isfinite(x)) return DQW_SIM_ERR_VALUE;
        memcpy(to, &x, sizeof x);
        return 0;
    }
    case DQW_SIM_FIELD_INT: {
        const long x = strtol(value, &end, 10);
        if (end == value || *end || errno || x < -1000000000L || x > 1000000000L) return DQW_SIM_ERR_VALUE;
        const int i = (int)x;
        memcpy(to, &i, sizeof i);
        return 0;
    }
    case DQW_SIM_FIELD_SEED: {
        const unsigned long long x = strtoull(value, &end, 10);
        if (end == value || *end || errno || strchr(value, '-')) return DQW_SIM_ERR_VALUE;
        const uint64_t u = x;
        memcpy(to, &u, sizeof u);
        return 0;
    }
    case DQW_SIM_FIELD_BOOL: {
        const bool yes = strcmp(value, "true") == 0 || strcmp(value, "1") == 0;
        if (!yes && strcmp(value, "false") != 0 && strcmp(value, "0") != 0) return DQW_SIM_ERR_VALUE;
        memcpy(to, &yes, sizeof yes);
        return 0;
    }
    case DQW_SIM_FIELD_PATH: {
        if (strlen(value) >= sizeof((dqw_sim_machine *)0)->flux_map) return DQW_SIM_ERR_VALUE;
        memcpy(to, value, strlen(value) + 1);
        return 0;
    }
    case DQW_SIM_FIELD_CHOICE: {
        const int x = choice_of(f->choices, value);
        if (x < 0) return DQW_SIM_ERR_VALUE;
        // An enum whose values are 0, 1, ... has the size of an int or of an unsigned.
        memcpy(to, &x, sizeof x);
        return 0;
    }
    }
    return DQW_SIM_ERR_VALUE;
}

static const dqw_sim_field *field_of(const char *key)
{
    for (size_t i = 0; i < CHANNELS; ++i)
        if (strcmp(key, shorthands[i + 1]) == 0) key = noise_channels[i];
    for (size_t i = 0; i < FIELDS; ++i)
        if (strcmp(fields[i].key, key) == 0) return &fields[i];
    return NULL;
}

int dqw_sim_set(dqw_sim_scenario *s, const char *key, const char *value)
{
    if (!s || !key || !value) return DQW_SIM_ERR_KEY;
    int status = 0;
    if (strcmp(key, shorthands[0]) == 0) {
        for (size_t i = 0; i < CHANNELS && status == 0; ++i) status = dqw_sim_set(s, noise_channels[i], value);
        return status;
    }
    const dqw_sim_field *f = field_of(key);
    return f ? set_field((char *)s + f->offset, f, value) : DQW_SIM_ERR_KEY;
}

static void list_choices(const char *choices, char *text, size_t size)
{
    size_t used = 0;
    for (const char *c = choices; *c && used < size; c = strchr(c, ' ') + 1) {
        const int length = (int)strcspn(c, " ");
        const char *join = c == choices ? "" : c[length + 1] ? ", " : " or ";
        used += (size_t)snprintf(text + used, size - used, "%s%.*s", join, length, c);
    }
}

void dqw_sim_expected(const char *key, char *text, size_t size)
{
    const dqw_sim_field *f = field_of(strcmp(key, shorthands[0]) == 0 ? noise_channels[0] : key);
    const char *what = "";
    if (f) switch (f->kind) {
        case DQW_SIM_FIELD_DOUBLE:
        case DQW_SIM_FIELD_RAMP: what = "a number"; break;
        case DQW_SIM_FIELD_INT: what = "a whole number"; break;
        case DQW_SIM_FIELD_SEED: what = "a whole number from 0 on"; break;
        case DQW_SIM_FIELD_BOOL: what = "true or false"; break;
        case DQW_SIM_FIELD_PATH: what = "a path of at most 255 characters"; break;
        case DQW_SIM_FIELD_CHOICE: list_choices(f->choices, text, size); return;
        }
    snprintf(text, size, "%s", what);
}

void dqw_sim_chosen(const dqw_sim_scenario *s, const char *key, char *text, size_t size)
{
    const dqw_sim_field *f = field_of(key);
    const bool choice = f && f->kind == DQW_SIM_FIELD_CHOICE;
    const char *name = choice ? f->choices : "";
    for (int n = choice ? *(const int *)(const void *)((const char *)s + f->offset) : 0; n > 0; --n)
        name = strchr(name, ' ') + 1;
    snprintf(text, size, "%.*s", (int)strcspn(name, " "), name);
}
