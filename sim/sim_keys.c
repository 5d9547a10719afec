#include "sim_keys.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "dqw_sim.h"

// clang-format off
#define AT(field) offsetof(dqw_sim_scenario, field)
#define NUMBER(field) {#field, AT(field), DQW_SIM_FIELD_DOUBLE, NULL}
#define COUNT(field) {#field, AT(field), DQW_SIM_FIELD_INT, NULL}
#define CHOICE(field, names) {#field, AT(field), DQW_SIM_FIELD_CHOICE, names}
// A ramp or a signal alone stands for its value.
#define RAMP(field) {#field, AT(field.value), DQW_SIM_FIELD_DOUBLE, NULL}, NUMBER(field.t_start_s), NUMBER(field.t_end_s)
#define SIGNAL(field)                                                                                                                    \
    {#field, AT(field.value), DQW_SIM_FIELD_DOUBLE, NULL}, NUMBER(field.step), NUMBER(field.t_step_s), NUMBER(field.wave),               \
        NUMBER(field.wave_period_s), CHOICE(field.shape, "sine square triangle stairs "), COUNT(field.levels), NUMBER(field.random),     \
        NUMBER(field.random_hold_s), NUMBER(field.binary), NUMBER(field.binary_hold_s)

static const dqw_sim_field fields[] = {
    NUMBER(duration_s), NUMBER(rtol), CHOICE(method, "adams bdf "), {"balance", AT(balance), DQW_SIM_FIELD_BOOL, NULL},
    {"seed", AT(seed), DQW_SIM_FIELD_SEED, NULL},
    COUNT(machine.pole_pairs), NUMBER(machine.R_ohm), NUMBER(machine.Ld_H), NUMBER(machine.Lq_H), NUMBER(machine.psi_Wb),
    NUMBER(machine.J_kgm2), NUMBER(machine.B_Nms_rad), NUMBER(machine.coulomb_Nm), NUMBER(machine.coulomb_width_rad_s),
    NUMBER(machine.temp_ref_C), NUMBER(machine.temp_ambient_C), NUMBER(machine.temp_start_C), NUMBER(machine.winding_heat_J_K),
    NUMBER(machine.magnet_heat_J_K), NUMBER(machine.winding_magnet_W_K), NUMBER(machine.winding_ambient_W_K),
    NUMBER(machine.magnet_ambient_W_K), {"machine.flux_map", AT(machine.flux_map), DQW_SIM_FIELD_PATH, NULL},
    RAMP(nonideal.dead_time_V), NUMBER(nonideal.dead_time_width_A), RAMP(nonideal.saturation_dd_A_Wb3), RAMP(nonideal.saturation_qq_A_Wb3),
    RAMP(nonideal.saturation_dq_A_Wb3), RAMP(nonideal.iron_loss_S), RAMP(nonideal.winding_alpha_per_K), RAMP(nonideal.magnet_beta_per_K),
    RAMP(nonideal.turn_short), NUMBER(nonideal.turn_short_ohm), RAMP(nonideal.demagnetisation), RAMP(nonideal.phase_connection_ohm),
    RAMP(nonideal.bearing_Nm), RAMP(nonideal.bearing_B_Nms_rad),
    RAMP(nonideal.skin_effect_s2_rad2), RAMP(nonideal.phase_resistance_a_ohm), RAMP(nonideal.phase_resistance_b_ohm),
    RAMP(nonideal.flux_harmonic_6d_Wb), RAMP(nonideal.flux_harmonic_6q_Wb), NUMBER(nonideal.flux_harmonic_6_phase_rad),
    RAMP(nonideal.flux_harmonic_12d_Wb), RAMP(nonideal.flux_harmonic_12q_Wb), NUMBER(nonideal.flux_harmonic_12_phase_rad),
    RAMP(nonideal.delay_periods), RAMP(nonideal.current_gain_a), RAMP(nonideal.current_gain_b), RAMP(nonideal.current_gain_c),
    RAMP(nonideal.current_offset_alpha_A), RAMP(nonideal.current_offset_beta_A), RAMP(nonideal.angle_offset_rad),
    RAMP(nonideal.voltage_offset_d_V), RAMP(nonideal.voltage_offset_q_V), RAMP(nonideal.stribeck_Nm), NUMBER(nonideal.stribeck_width_rad_s),
    RAMP(nonideal.friction_asymmetry_Nm), RAMP(nonideal.cogging_Nm), COUNT(nonideal.cogging_order), NUMBER(nonideal.cogging_phase_rad),
    {"nonideal.inverter_curve", AT(nonideal.inverter_curve), DQW_SIM_FIELD_PATH, NULL},
    RAMP(nonideal.disturbance_V), NUMBER(nonideal.disturbance_Hz), RAMP(nonideal.hum_A), NUMBER(nonideal.hum_Hz), NUMBER(nonideal.clip_A),
    NUMBER(nonideal.dropped_fraction),
    NUMBER(drive.dt_s), NUMBER(drive.v_dc_V), NUMBER(drive.current_bandwidth_rad_s), NUMBER(drive.speed_bandwidth_rad_s), NUMBER(drive.i_max_A),
    CHOICE(drive.hold, "abc dq "), COUNT(drive.log_every), COUNT(drive.log_window),
    CHOICE(profile.control, "speed current voltage "), CHOICE(profile.shaft, "free imposed "), NUMBER(profile.speed_start_rad_s),
    SIGNAL(profile.speed_rad_s), SIGNAL(profile.i_d_A), SIGNAL(profile.i_q_A), SIGNAL(profile.v_d_V), SIGNAL(profile.v_q_V), SIGNAL(profile.load_Nm),
    NUMBER(noise.i), NUMBER(noise.v), NUMBER(noise.w), NUMBER(noise.theta), NUMBER(noise.v_dc), NUMBER(noise.temp), NUMBER(noise.torque),
    NUMBER(noise.step_i_A), NUMBER(noise.step_v_V), NUMBER(noise.step_w_rad_s), NUMBER(noise.step_theta_m_rad), NUMBER(noise.step_v_dc_V),
    NUMBER(noise.step_temp_C), NUMBER(noise.step_torque_Nm), {"noise.seed", AT(noise.seed), DQW_SIM_FIELD_SEED, NULL},
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
    case DQW_SIM_FIELD_DOUBLE: {
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

static int set_by_path(dqw_sim_scenario *s, const char *key, const char *value)
{
    for (size_t i = 0; i < FIELDS; ++i)
        if (strcmp(fields[i].key, key) == 0) return set_field((char *)s + fields[i].offset, &fields[i], value);
    return DQW_SIM_ERR_KEY;
}

int dqw_sim_set(dqw_sim_scenario *s, const char *key, const char *value)
{
    if (!s || !key || !value) return DQW_SIM_ERR_KEY;
    int status = 0;
    if (strcmp(key, shorthands[0]) == 0) {
        for (size_t i = 0; i < CHANNELS && status == 0; ++i) status = set_by_path(s, noise_channels[i], value);
        return status;
    }
    for (size_t i = 0; i < CHANNELS; ++i)
        if (strcmp(key, shorthands[i + 1]) == 0) return set_by_path(s, noise_channels[i], value);
    return set_by_path(s, key, value);
}
