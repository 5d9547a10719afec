#include "dqw_text.h"

#include <stddef.h>

#define LENGTH(table) (sizeof(table) / sizeof((table)[0]))
// An enumerator added at the end of its list has a text, or this does not compile.
#define COMPLETE(table, count) typedef char table##_is_complete[LENGTH(table) == (size_t)(count) ? 1 : -1]

// By the status without its sign.
static const char *const status_texts[] = {
    [-DQW_OK] = "done",
    [-DQW_ERR_NULL] = "a pointer that must be there is null",
    [-DQW_ERR_SIZE] = "a count is zero, or above its compile-time limit",
    [-DQW_ERR_RANGE] = "a number is NaN, infinite, or outside its documented range",
    [-DQW_ERR_DT] = "dt_s: the PWM period, above 0 s; dt_ns: 1 .. 1000000000",
    [-DQW_ERR_V_BASE] = "v_base_V: the rated phase voltage, above 0 V; v_full_mV: 1 .. 10000000",
    [-DQW_ERR_I_BASE] = "i_base_A: the rated phase current, above 0 A; i_full_mA: 1 .. 10000000",
    [-DQW_ERR_W_BASE] = "w_base_rad_s: the rated mechanical speed, above 0 rad/s; w_full_mrad_s: 1 .. 10000000",
    [-DQW_ERR_TORQUE_BASE] = "torque_base_Nm: the rated torque, above 0 Nm",
    [-DQW_ERR_R] = "R_ohm: the resistance to start from, 0 (from the bases) or above; above 0 where `commissioned`",
    [-DQW_ERR_LD] = "Ld_H: the inductance to start from, 0 (from the bases) or above",
    [-DQW_ERR_LQ] = "Lq_H: the inductance to start from, 0 (from the bases) or above",
    [-DQW_ERR_PSI] = "psi_Wb: the flux to start from, 0 (from the bases) or above; above 0 where `commissioned`",
    [-DQW_ERR_J] = "J_kgm2: the inertia, 0 (not known) or above",
    [-DQW_ERR_B] = "B_Nms_rad: the viscous friction to start from, 0 (not known) or above",
    [-DQW_ERR_POLE_PAIRS] = "pole_pairs: 1 .. 65535, or 0 (to be found) where the object finds them",
    [-DQW_ERR_HALF_WINDOW] = "half_window: 0 (the default) or 1 .. 10000 pairs, in fixed point up to 100",
    [-DQW_ERR_V_LIMIT] = "v_limit_V: a sample beyond it is saturated, 0 (ten bases) or above",
    [-DQW_ERR_I_LIMIT] = "i_limit_A: a sample beyond it is saturated, 0 (ten bases) or above",
    [-DQW_ERR_EXCITATION] =
        "excitation_pu: the least input that teaches, 0 (the default) or above, as part of its base",
    [-DQW_ERR_DEAD_TIME_WIDTH] =
        "dead_time_width_A: the current that makes three quarters of the step, 0 (none is learned) or above",
    [-DQW_ERR_VOLTAGE_ERROR] =
        "voltage_error_V: by how much the voltage may be off, 0 (what the residual shows) or above",
    [-DQW_ERR_COULOMB_WIDTH] = "coulomb_width_rad_s: where friction has changed its sign, 0 (at once) or above",
    [-DQW_ERR_STANDSTILL] = "standstill_rad_s: below it friction has no direction, 0 or above",
    [-DQW_ERR_UNIT] =
        "bases and start values together: a weight beyond what the arithmetic holds; look for a wrong unit",
    [-DQW_ERR_RANDOM] = "random: the memory lent to stage 2 is not made, dqw_estimator_random_init makes it",
    [-DQW_ERR_TURN] = "w_full_mrad_s, pole_pairs and dt_ns together: the angle in a period, above 0 and below 1 rad",
    [-DQW_ERR_SETTLED] = "settled: a settled point has no period in which its voltage could act later or be held",
    [-DQW_ERR_MODULATION] = "modulation: none of those that enum dqw_modulation names",
    [-DQW_ERR_ANGLE_LATE] =
        "angle_late_s: how long before its currents the angle was taken, two periods at most, 0 beside effects",
    [-DQW_ERR_VOLTAGE_SCALE] = "voltage_scale_ppm: deviation of the voltage's scale, 0 (exact) to 100000",
    [-DQW_ERR_EFFECT_LIST] = "effects: the list is null where effect_count is not 0",
    [-DQW_ERR_EFFECT_NAME] = "effects: no name, or one of the shaft where the machine's belong, or the other way round",
    [-DQW_ERR_EFFECT_SHAPE] = "effects: a shape or start value that means nothing; dqw_effect_name.h says each shape",
    [-DQW_ERR_EFFECT_TWICE] = "effects: one of which there can only be one stands twice",
    [-DQW_ERR_EFFECT_ROOM] = "effects: their weights together are more than DQW_EFFECT_WEIGHTS",
    [-DQW_ERR_EFFECT_POLE_PAIRS] = "effects: one of the list needs pole_pairs, which are not given",
    [-DQW_ERR_EFFECT_ANGLE] = "effects: one of the list needs the angle, which the configuration says is not given",
    [-DQW_ERR_BAND] = "band: a change that is healthy, 0 (the default) or above, for every channel",
    [-DQW_ERR_ALPHA] = "alpha_per_K: of the winding's resistance, 0 (0.0039) or above; ppm up to 10^6",
    [-DQW_ERR_BETA] = "beta_per_K: of the magnet's flux, as a positive fall, 0 (0.001) or above; ppm up to 10^6",
    [-DQW_ERR_HEATING] = "heating_K_s: the fastest healthy heating, 0 (1) or above; mK up to 10^6",
    [-DQW_ERR_RESIDUAL_FLOOR] = "residual_floor: a residual that is none, 0 (the default) or above; ppm up to 10^6",
    [-DQW_ERR_STORE_VERSION] = "the store was written by another version",
    [-DQW_ERR_STORE_DAMAGED] = "the store is damaged: its checksum does not fit",
    [-DQW_ERR_STORE_CONFIG] = "the store was written with another configuration",
};
COMPLETE(status_texts, 1 - DQW_ERR_STORE_CONFIG);

static const char *const parameter_texts[] = {
    [DQW_WATCH_R] = "R_ohm",
    [DQW_WATCH_LD] = "Ld_H",
    [DQW_WATCH_LQ] = "Lq_H",
    [DQW_WATCH_PSI] = "psi_Wb",
    [DQW_WATCH_DEAD_TIME] = "dead_time_V",
    [DQW_WATCH_ANGLE] = "psi_q_Wb",
#if DQW_MAP_WEIGHTS > 0
    [DQW_WATCH_MAP_D] = "flux_map_d",
    [DQW_WATCH_MAP_Q] = "flux_map_q",
#endif
    [DQW_WATCH_OFFSET] = "offset_A",
    [DQW_WATCH_RESISTANCE] = "phase_resistance_ohm",
    [DQW_WATCH_REACTANCE] = "gain_H",
    [DQW_WATCH_SHORT] = "short_S",
    [DQW_WATCH_FRICTION] = "friction_Nm",
    [DQW_WATCH_TEMPERATURE] = "temperature_K",
    [DQW_WATCH_RESIDUAL] = "residual_V",
};
COMPLETE(parameter_texts, DQW_WATCH_CHANNELS);

static const char *const fault_texts[] = {
    [DQW_FAULT_NONE] = "none",
    [DQW_FAULT_OVER_TEMPERATURE] = "over_temperature",
    [DQW_FAULT_DEMAGNETISATION] = "demagnetisation",
    [DQW_FAULT_TURN_SHORT] = "turn_short",
    [DQW_FAULT_PHASE_CONNECTION] = "phase_connection",
    [DQW_FAULT_CURRENT_OFFSET] = "current_offset",
    [DQW_FAULT_CURRENT_GAIN] = "current_gain",
    [DQW_FAULT_ENCODER_OFFSET] = "encoder_offset",
    [DQW_FAULT_BEARING_WEAR] = "bearing_wear",
    [DQW_FAULT_INVERTER_FAULT] = "inverter_fault",
    [DQW_FAULT_RESISTANCE_RISE] = "resistance_rise",
    [DQW_FAULT_VOLTAGE_SCALE] = "voltage_scale",
    [DQW_FAULT_UNKNOWN] = "unknown",
};
COMPLETE(fault_texts, DQW_FAULT_NAMES);

static const char *const stage_texts[] = {
    [DQW_STAGE_DOMAIN] = "domain knowledge",
    [DQW_STAGE_RANDOM] = "random learning",
    [DQW_STAGE_ORDINAL] = "ordinal learning",
    [DQW_STAGE_IN_SERVICE] = "in service",
};
COMPLETE(stage_texts, DQW_STAGE_IN_SERVICE + 1);

static const char *const why_texts[] = {
    [DQW_WHY_IN_SERVICE] = "in service",
    [DQW_WHY_NO_BLOCK] = "no block was learned yet: are samples refused, or does the background not run?",
    [DQW_WHY_NOISE] = "too few samples in a row to know the noise of currents and speed",
    [DQW_WHY_EXCITATION] = "currents and speed move too little to learn from",
    [DQW_WHY_MODULATION] = "which legs switch is being found: it needs currents and speeds that move",
    [DQW_WHY_R] = "R is not known yet: it needs current",
    [DQW_WHY_LQ] = "L_q is not known yet: i_q must move, or i_q and speed be there",
    [DQW_WHY_PSI] = "the flux is not known yet: it needs speed",
    [DQW_WHY_BLOCKS] = "R, L_q and the flux are known: some hundred blocks are still to be learned",
    [DQW_WHY_VOLTAGE] = "the voltage acts one period later, or earlier, than voltage_next says",
    [DQW_WHY_RESIDUAL] = "the residual is above the threshold: the model lacks something, or it still learns",
    [DQW_WHY_NOT_CONVERGED] = "back to domain knowledge: the coarse values did not settle",
    [DQW_WHY_THRESHOLD] = "back to domain knowledge: the residual stayed above the threshold",
    [DQW_WHY_LEFT_BAND] = "back to domain knowledge: the residual rose above the threshold in service",
    [DQW_WHY_RESTS] = "healthy values are being taken anew",
    [DQW_WHY_NAMING] = "something has changed and is being named",
    [DQW_WHY_PAUSE] = "nothing was learned for a while: a standstill, no good samples, or values that catch up",
    [DQW_WHY_NOT_ASKED] = "the configuration does not ask for it",
    [DQW_WHY_NOT_TAUGHT] = "the motion does not teach it",
    [DQW_WHY_SIGN] = "it came out at 0 or below, as no machine's is: a signal or the model is wrong",
    [DQW_WHY_OBSERVED] = "by its change alone: behind an observer it is the observer's own constant, not the machine's",
    [DQW_WHY_UNSETTLED] = "it is not known well enough for a healthy value to stand",
    [DQW_WHY_COARSE] = "in name only: what would be told is more than a fault makes of it",
};
COMPLETE(why_texts, DQW_WHYS);

static const char *text_of(const char *const table[], size_t length, long at)
{
    return (unsigned long)at < length && table[at] != NULL ? table[at] : "?";
}

const char *dqw_status_text(enum dqw_status status)
{
    // None but these is negated: the least long has no counterpart.
    return text_of(status_texts, LENGTH(status_texts),
                   status > DQW_OK || status < DQW_ERR_STORE_CONFIG ? -1 : -(long)status);
}

const char *dqw_parameter_text(enum dqw_monitor_channel channel)
{
    return text_of(parameter_texts, LENGTH(parameter_texts), (long)channel);
}

const char *dqw_fault_text(enum dqw_fault_name fault)
{
    return text_of(fault_texts, LENGTH(fault_texts), (long)fault);
}

const char *dqw_stage_text(enum dqw_stage_name stage)
{
    return text_of(stage_texts, LENGTH(stage_texts), (long)stage);
}

const char *dqw_why_text(enum dqw_why why)
{
    return text_of(why_texts, LENGTH(why_texts), (long)why);
}
