// The table of named scenarios.
#include <string.h>

#include "dqw_sim.h"

// clang-format off
#define NOISE(x) .noise = {.i = x, .v = x, .w = x, .theta = x, .v_dc = x, .temp = x, .torque = x}

// A 1.5 kW servo motor. Friction is viscous alone, so that the plain model is the truth.
#define SERVO_PLATE .pole_pairs = 4, .R_ohm = 0.9, .Ld_H = 2.2e-3, .Lq_H = 2.8e-3, .psi_Wb = 0.12, .J_kgm2 = 2e-3, .B_Nms_rad = 1e-3, \
                    .temp_ref_C = 25, .temp_ambient_C = 25, .temp_start_C = 25
#define SERVO_DRIVE .dt_s = 1e-4, .v_dc_V = 320, .current_bandwidth_rad_s = 1500, .speed_bandwidth_rad_s = 60, .i_max_A = 15
// Currents drawn anew every few ms, a binary voltage of 0.5 ms on each axis, speed to and fro.
#define SERVO_PROFILE .speed_rad_s = {.wave = 180, .wave_period_s = 0.5}, .i_d_A = {.random = 4, .random_hold_s = 5e-3}, \
                      .i_q_A = {.random = 4, .random_hold_s = 7e-3}, .v_d_V = {.binary = 10, .binary_hold_s = 5e-4}, \
                      .v_q_V = {.binary = 10, .binary_hold_s = 5e-4}
#define SERVO .machine = {SERVO_PLATE}, .drive = {SERVO_DRIVE}, .profile = {SERVO_PROFILE}, .regime = "dynamic", .rtol = 1e-8, .seed = 1

// A small joint motor: loads of a few ampere, reversals, an angle without noise.
#define JOINT .machine = {.pole_pairs = 4, .R_ohm = 0.5, .Ld_H = 1.0e-3, .Lq_H = 1.4e-3, .psi_Wb = 0.020, .J_kgm2 = 3e-4, .B_Nms_rad = 1e-4, \
                          .temp_ref_C = 25, .temp_ambient_C = 25, .temp_start_C = 25}, \
              .drive = {.dt_s = 5e-5, .v_dc_V = 24, .current_bandwidth_rad_s = 2000, .speed_bandwidth_rad_s = 80, .i_max_A = 6}, \
              .profile = {.speed_rad_s = {.wave = 90, .wave_period_s = 0.7}, .i_d_A = {.random = 3, .random_hold_s = 0.037}, \
                          .load_Nm = {.random = 0.35, .random_hold_s = 0.051}, .v_d_V = {.binary = 0.8, .binary_hold_s = 3e-4}, \
                          .v_q_V = {.binary = 0.8, .binary_hold_s = 3e-4}}, \
              .regime = "dynamic", .rtol = 1e-8, .seed = 1

#define TRACTION_MACHINE .machine = {.pole_pairs = 4, .R_ohm = 0.012, .Ld_H = 0.20e-3, .Lq_H = 0.50e-3, .psi_Wb = 0.070, .J_kgm2 = 0.06, \
                                     .B_Nms_rad = 0.02, .temp_ref_C = 25, .temp_ambient_C = 25, .temp_start_C = 25}
#define TRACTION_DRIVE .drive = {.dt_s = 1e-4, .v_dc_V = 350, .current_bandwidth_rad_s = 1200, .speed_bandwidth_rad_s = 30, .i_max_A = 300}
#define TRACTION_PROFILE .profile = {.speed_rad_s = {.value = 120, .wave = 100, .wave_period_s = 0.8}, \
                                     .i_d_A = {.value = -80, .random = 80, .random_hold_s = 5e-3}, .i_q_A = {.random = 80, .random_hold_s = 7e-3}, \
                                     .v_d_V = {.binary = 10, .binary_hold_s = 5e-4}, .v_q_V = {.binary = 10, .binary_hold_s = 5e-4}}
#define TRACTION TRACTION_MACHINE, TRACTION_DRIVE, TRACTION_PROFILE, .duration_s = 2, .regime = "dynamic", .rtol = 5e-9, .seed = 1

// Four drives as they are built. Each inverter has dead time, an output's capacitance, drops, a link that gives way;
// each machine warms up, and its iron loses.
#define WARM .temp_ref_C = 25, .temp_ambient_C = 25, .temp_start_C = 25
#define S320_BUILT .pole_pairs = 4, .R_ohm = 0.9, .Ld_H = 2.2e-3, .Lq_H = 2.8e-3, .psi_Wb = 0.12, .J_kgm2 = 2e-3, .B_Nms_rad = 1e-3, WARM, \
                    .winding_heat_J_K = 120, .magnet_heat_J_K = 250, .housing_heat_J_K = 800, .winding_housing_W_K = 2, .magnet_housing_W_K = 0.3, \
                    .housing_ambient_W_K = 1.2
#define S320_LOSSES .winding_alpha_per_K = {.value = 0.0039}, .magnet_beta_per_K = {.value = -0.0011}, .iron_loss_S = {.value = 1e-3}, \
                     .iron_hysteresis_S_rad_s = {.value = 0.4}, .iron_hysteresis_corner_rad_s = 50, .iron_loss_tau_s = 5e-5
#define S320_LEGS .dead_time_s = 1.5e-6, .node_F = 3e-10, .switch_V = 0.9, .switch_ohm = 0.03, .diode_V = 0.8, .diode_ohm = 0.02, .knee_A = 0.1, \
                   .compare_counts = 7500, .source_ohm = 0.4, .link_F = 5e-4, .ripple_V = 4, .ripple_Hz = 300
#define S320_LOOPS .dt_s = 1e-4, .v_dc_V = 320, .current_bandwidth_rad_s = 1500, .speed_bandwidth_rad_s = 60, .i_max_A = 15
#define S320_WORK .load_Nm = {.random = 3, .random_hold_s = 0.051}, .i_d_A = {.random = 3, .random_hold_s = 0.037}
#define S320_ADC .step_i_A = 0.01, .step_v_dc_V = 0.2

#define J24_BUILT .pole_pairs = 4, .R_ohm = 0.5, .Ld_H = 1.0e-3, .Lq_H = 1.4e-3, .psi_Wb = 0.020, .J_kgm2 = 3e-4, .B_Nms_rad = 1e-4, WARM, \
                    .winding_heat_J_K = 25, .magnet_heat_J_K = 60, .housing_heat_J_K = 150, .winding_housing_W_K = 0.6, .magnet_housing_W_K = 0.1, \
                    .housing_ambient_W_K = 0.3
#define J24_LOSSES .winding_alpha_per_K = {.value = 0.0039}, .magnet_beta_per_K = {.value = -0.0011}, .iron_loss_S = {.value = 2e-3}, \
                     .iron_hysteresis_S_rad_s = {.value = 0.5}, .iron_hysteresis_corner_rad_s = 50, .iron_loss_tau_s = 5e-5
#define J24_LEGS .dead_time_s = 3e-7, .node_F = 5e-10, .switch_ohm = 0.02, .diode_V = 0.75, .diode_ohm = 0.01, .knee_A = 0.05, \
                   .reverse = DQW_SIM_REVERSE_CHANNEL, .compare_counts = 4200, .source_ohm = 0.1, .link_F = 4e-4
#define J24_LOOPS .dt_s = 5e-5, .v_dc_V = 24, .current_bandwidth_rad_s = 2000, .speed_bandwidth_rad_s = 80, .i_max_A = 6
#define J24_WORK .load_Nm = {.random = 0.35, .random_hold_s = 0.051}, .i_d_A = {.random = 2, .random_hold_s = 0.037}
#define J24_ADC .step_i_A = 0.005, .step_v_dc_V = 0.02

// A hub motor: many poles, slow, a small flux of its own in the rotor's frame.
#define H48_BUILT .pole_pairs = 15, .R_ohm = 0.24, .Ld_H = 520e-6, .Lq_H = 650e-6, .psi_Wb = 0.0243, .J_kgm2 = 0.02, .B_Nms_rad = 2e-3, WARM, \
                  .winding_heat_J_K = 200, .magnet_heat_J_K = 400, .housing_heat_J_K = 1500, .winding_housing_W_K = 2, .magnet_housing_W_K = 1, \
                  .housing_ambient_W_K = 2
#define H48_LOSSES .winding_alpha_per_K = {.value = 0.0039}, .magnet_beta_per_K = {.value = -0.0012}, .iron_loss_S = {.value = 2e-3}, \
                   .iron_hysteresis_S_rad_s = {.value = 0.8}, .iron_hysteresis_corner_rad_s = 50, .iron_loss_tau_s = 5e-5
#define H48_LEGS .dead_time_s = 2e-7, .node_F = 1e-9, .switch_ohm = 0.004, .diode_V = 0.75, .diode_ohm = 0.004, .knee_A = 0.05, \
                 .reverse = DQW_SIM_REVERSE_CHANNEL, .compare_counts = 3000, .source_ohm = 0.1, .link_F = 1e-3
#define H48_LOOPS .dt_s = 5e-5, .v_dc_V = 48, .current_bandwidth_rad_s = 1500, .speed_bandwidth_rad_s = 20, .i_max_A = 20
#define H48_WORK .load_Nm = {.random = 4, .random_hold_s = 0.11}, .i_d_A = {.random = 4, .random_hold_s = 0.037}
#define H48_ADC .step_i_A = 0.02, .step_v_dc_V = 0.03

// Small and fast: a few windings, microhenries, currents that ripple by amperes.
#define F22_BUILT .pole_pairs = 14, .R_ohm = 0.014, .Ld_H = 10e-6, .Lq_H = 15e-6, .psi_Wb = 1.456e-3, .J_kgm2 = 1.5e-4, .B_Nms_rad = 3e-5, WARM, \
                   .winding_heat_J_K = 20, .magnet_heat_J_K = 60, .housing_heat_J_K = 100, .winding_housing_W_K = 1.5, .magnet_housing_W_K = 0.5, \
                   .housing_ambient_W_K = 1.5
#define F22_LOSSES .winding_alpha_per_K = {.value = 0.0039}, .magnet_beta_per_K = {.value = -0.0012}, .iron_loss_S = {.value = 0.03}, \
                    .iron_hysteresis_S_rad_s = {.value = 60}, .iron_hysteresis_corner_rad_s = 200, .iron_loss_tau_s = 2e-5
#define F22_LEGS .dead_time_s = 9e-8, .node_F = 1e-9, .switch_ohm = 0.0015, .diode_V = 0.75, .diode_ohm = 0.002, .knee_A = 0.1, \
                  .reverse = DQW_SIM_REVERSE_CHANNEL, .compare_counts = 2940, .source_ohm = 0.02, .link_F = 9.4e-4
#define F22_LOOPS .dt_s = 3.5e-5, .v_dc_V = 22, .current_bandwidth_rad_s = 2500, .speed_bandwidth_rad_s = 60, .i_max_A = 50
#define F22_WORK .load_Nm = {.random = 0.5, .random_hold_s = 0.051}, .i_d_A = {.random = 8, .random_hold_s = 0.037}
#define F22_ADC .step_i_A = 0.08, .step_v_dc_V = 0.015

// What is built around them, by kind: its modulation, what it senses with (noise in ampere), what it makes of that.
#define CLAMPED_ABOUT "lowest leg rests; encoder, three sensors, dead time not compensated"
#define CLAMPED_LEGS .modulation = DQW_SIM_MODULATION_CLAMPED_LOW
#define CLAMPED_SENSING(sensor_A, per_A) .noise_A = sensor_A, .filter_s = 1e-6, .speed_bandwidth_rad_s = 600
#define CLAMPED_LOOPS(width)
#define CLAMPED_WRONG(sensor_A)
#define CLAMPED_ANGLE , .step_theta_m_rad = 6.283185307179586 / 16384
#define CLAMPED_SPEED(top) .wave = top, .wave_period_s = 0.7

#define COMPENSATED_ABOUT "centred; encoder, three sensors, 1.2 times the dead time given back"
#define COMPENSATED_LEGS .modulation = DQW_SIM_MODULATION_CENTRED
#define COMPENSATED_SENSING(sensor_A, per_A) CLAMPED_SENSING(sensor_A, per_A)
#define COMPENSATED_LOOPS(width) , .compensation = 1.2, .compensation_width_A = width
#define COMPENSATED_WRONG(sensor_A)
#define COMPENSATED_ANGLE CLAMPED_ANGLE
#define COMPENSATED_SPEED(top) CLAMPED_SPEED(top)

#define OBSERVER_ABOUT "centred; an observer that lags with speed and load, two sensors, sampled late; upper switch gives the dead time"
#define OBSERVER_LEGS .modulation = DQW_SIM_MODULATION_CENTRED, .dead_side = DQW_SIM_DEAD_UPPER
#define OBSERVER_SENSING(sensor_A, per_A) .noise_A = sensor_A, .filter_s = 2e-6, .late_periods = 0.03, .phases = DQW_SIM_PHASES_AB, .observer = true, \
    .observer_lag_s = 1.5e-5, .observer_load_rad_A = per_A, .observer_noise_rad = 0.05, .observer_corner_rad_s = 100, .observer_bandwidth_rad_s = 500, \
    .speed_bandwidth_rad_s = 300
#define OBSERVER_LOOPS(width)
#define OBSERVER_WRONG(sensor_A)
#define OBSERVER_ANGLE
#define OBSERVER_SPEED(top) .value = top, .wave = 0.5 * top, .wave_period_s = 0.7

#define CHEAP_ABOUT "lowest leg rests; eccentric encoder a period late, two sensors 1 % apart, nominal link, log of the decided voltage"
#define CHEAP_LEGS .modulation = DQW_SIM_MODULATION_CLAMPED_LOW, .dead_side = DQW_SIM_DEAD_LOWER
#define CHEAP_SENSING(sensor_A, per_A) .noise_A = 2 * sensor_A, .filter_s = 2e-6, .late_periods = 0.03, .phases = DQW_SIM_PHASES_AB, .once_rad = 0.004, \
    .twice_rad = 0.0015, .angle_late_periods = 1, .speed_bandwidth_rad_s = 300
#define CHEAP_LOOPS(width) , .link = DQW_SIM_LINK_NOMINAL, .logged = DQW_SIM_LOGGED_DECIDED
#define CHEAP_WRONG(sensor_A) , .current_gain_a = {.value = 0.01}, .current_offset_alpha_A = {.value = 3 * sensor_A}
#define CHEAP_ANGLE , .step_theta_m_rad = 6.283185307179586 / 4096
#define CHEAP_SPEED(top) CLAMPED_SPEED(top)

#define DRIVE(kind, suffix, KIND, who, X, top, sensor_A, width, per_A)                                                                 \
    {.name = "drive_" kind suffix, .about = who ", " KIND##_ABOUT, .machine = {X##_BUILT}, .nonideal = {X##_LOSSES KIND##_WRONG(sensor_A)}, \
     .inverter = {X##_LEGS, KIND##_LEGS}, .sensing = {KIND##_SENSING(sensor_A, per_A)}, .drive = {X##_LOOPS KIND##_LOOPS(width)},       \
     .profile = {X##_WORK, .speed_rad_s = {KIND##_SPEED(top)}}, .noise = {X##_ADC KIND##_ANGLE}, .duration_s = 2, .regime = "dynamic", \
     .rtol = 2e-6, .seed = 1}
#define DRIVES(suffix, who, X, top, sensor_A, width, per_A)                                                                            \
    DRIVE("clamped", suffix, CLAMPED, who, X, top, sensor_A, width, per_A),                                                             \
        DRIVE("compensated", suffix, COMPENSATED, who, X, top, sensor_A, width, per_A),                                                 \
        DRIVE("observer", suffix, OBSERVER, who, X, top, sensor_A, width, per_A),                                                       \
        DRIVE("cheap", suffix, CHEAP, who, X, top, sensor_A, width, per_A)

static const dqw_sim_scenario table[] = {
    {.name = "paper_step",
     .about = "the paper's machine: 301 samples at 0.1 ms of a step of speed and load, +-2 V random binary on each axis, no noise",
     .machine = {.pole_pairs = 4, .R_ohm = 0.37, .Ld_H = 0.326e-3, .Lq_H = 0.326e-3, .psi_Wb = 0.020, .J_kgm2 = 4e-5, .B_Nms_rad = 2e-5,
                 .temp_ref_C = 25, .temp_ambient_C = 25, .temp_start_C = 25},
     // Slow loops and long holds leave currents that last: R is in them, and the loops would take them away.
     .drive = {.dt_s = 1e-4, .v_dc_V = 24, .current_bandwidth_rad_s = 150, .speed_bandwidth_rad_s = 100, .i_max_A = 12},
     .profile = {.speed_rad_s = {.step = 100, .t_step_s = 1e-3}, .load_Nm = {.step = 0.8, .t_step_s = 1e-3},
                 .v_d_V = {.binary = 2, .binary_hold_s = 4e-3}, .v_q_V = {.binary = 2, .binary_hold_s = 2e-3}},
     .duration_s = 0.0301, .regime = "dynamic", .rtol = 1e-8, .seed = 1},
    {.name = "servo",
     .about = "servo, 320 V, 2.2/2.8 mH: speed to and fro, re-drawn currents, random binary voltages; 1 % noise on every channel",
     SERVO, NOISE(0.01), .duration_s = 2},
    {.name = "servo_ideal", .about = "the servo without noise: the plain model is the exact truth", SERVO, .duration_s = 2},
    {.name = "robot_joint",
     .about = "robot joint, 21 pole pairs, 50 uH, 48 V, a few Nm: speed to and fro under a load step, 1 % noise",
     .machine = {.pole_pairs = 21, .R_ohm = 0.10, .Ld_H = 50e-6, .Lq_H = 50e-6, .psi_Wb = 0.0040, .J_kgm2 = 1e-3, .B_Nms_rad = 5e-4,
                 .temp_ref_C = 25, .temp_ambient_C = 25, .temp_start_C = 25},
     .drive = {.dt_s = 1e-4, .v_dc_V = 48, .current_bandwidth_rad_s = 1500, .speed_bandwidth_rad_s = 60, .i_max_A = 40},
     .profile = {.speed_rad_s = {.wave = 40, .wave_period_s = 0.5}, .i_d_A = {.random = 10, .random_hold_s = 5e-3},
                 .i_q_A = {.random = 10, .random_hold_s = 7e-3}, .v_d_V = {.binary = 1, .binary_hold_s = 3e-4},
                 .v_q_V = {.binary = 1, .binary_hold_s = 3e-4}, .load_Nm = {.step = 1.5, .t_step_s = 1}},
     NOISE(0.01), .duration_s = 2, .regime = "dynamic", .rtol = 3e-8, .seed = 1},
    {.name = "joint_24v",
     .about = "robot joint, 4 pole pairs, 1.0/1.4 mH, 24 V, 20 kHz: speed to and fro, i_d and load re-drawn, +-0.8 V random binary on each axis; 1 % noise",
     JOINT, .noise = {.i = 0.01, .v = 0.01, .w = 0.01}, .duration_s = 2},
    {.name = "traction_ipm",
     .about = "interior-magnet traction motor, 350 V, 300 A, L_q/L_d = 2.5, whose iron saturates (d, q and cross); no noise",
     TRACTION,
     .nonideal = {.saturation_dd_A_Wb3 = {.value = 4e4}, .saturation_qq_A_Wb3 = {.value = 6e4}, .saturation_dq_A_Wb3 = {.value = 5e4}}},
    {.name = "traction_ipm_linear", .about = "the traction motor without saturation; no noise", TRACTION},
    {.name = "standstill",
     .about = "servo with its rotor locked: settled levels of i_d from -8 to 8 A, one row per level, 1 % noise",
     .machine = {SERVO_PLATE}, .drive = {SERVO_DRIVE, .log_every = 200, .log_window = 10},
     .profile = {.control = DQW_SIM_CONTROL_CURRENT, .shaft = DQW_SIM_SHAFT_IMPOSED,
                 .i_d_A = {.wave = 8, .wave_period_s = 0.82, .shape = DQW_SIM_SHAPE_STAIRS, .levels = 41}},
     NOISE(0.01), .duration_s = 1.64, .regime = "standstill", .rtol = 1e-8, .seed = 1},
    {.name = "coast_friction",
     .about = "servo's mechanical side at 1 kHz: torque steps and coasting against viscous and 0.1 Nm Coulomb friction, 1 % noise",
     .machine = {SERVO_PLATE, .coulomb_Nm = 0.1, .coulomb_width_rad_s = 1}, .drive = {SERVO_DRIVE, .log_every = 10},
     .profile = {.control = DQW_SIM_CONTROL_CURRENT, .speed_start_rad_s = -150,
                 .i_q_A = {.wave = 1.5, .wave_period_s = 1, .shape = DQW_SIM_SHAPE_SQUARE, .random = 1.5, .random_hold_s = 0.1}},
     NOISE(0.01), .duration_s = 10, .regime = "mechanical", .rtol = 2e-9, .seed = 1},
    {.name = "heating",
     .about = "servo on a load machine for ten minutes: winding and magnet heat up by tens of kelvin; settled rows every 2 s, 0.1 % noise",
     .machine = {SERVO_PLATE, .winding_heat_J_K = 120, .magnet_heat_J_K = 400, .winding_magnet_W_K = 1.5, .winding_ambient_W_K = 0.8,
                 .magnet_ambient_W_K = 1.0},
     .nonideal = {.winding_alpha_per_K = {.value = 0.0039}, .magnet_beta_per_K = {.value = -0.0011}},
     .drive = {.dt_s = 0.01, .v_dc_V = 320, .current_bandwidth_rad_s = 15, .i_max_A = 15, .hold = DQW_SIM_HOLD_DQ, .log_every = 200, .log_window = 20},
     .profile = {.control = DQW_SIM_CONTROL_CURRENT, .shaft = DQW_SIM_SHAFT_IMPOSED,
                 .speed_rad_s = {.value = 100, .random = 60, .random_hold_s = 2}, .i_d_A = {.value = -1, .random = 4, .random_hold_s = 2},
                 .i_q_A = {.value = 6, .random = 4, .random_hold_s = 2}},
     NOISE(0.001), .duration_s = 600, .regime = "steady", .rtol = 1e-7, .method = DQW_SIM_BDF, .seed = 1},
    {.name = "fault_turn_short",
     .about = "servo, fault: 0 to 5 % of phase a's turns short themselves from 1 s to 3 s; 1 % noise",
     SERVO, NOISE(0.01), .nonideal = {.turn_short = {0.05, 1, 3}, .turn_short_ohm = 0.05}, .duration_s = 4},
    {.name = "fault_demagnetisation",
     .about = "servo, fault: the magnet loses 0 to 10 % of its flux from 1 s to 3 s; 1 % noise",
     SERVO, NOISE(0.01), .nonideal = {.demagnetisation = {0.10, 1, 3}}, .duration_s = 4},
    {.name = "fault_phase_connection",
     .about = "servo, fault: a bad connection adds 0 to 0.4 ohm to phase a from 1 s to 3 s; 1 % noise",
     SERVO, NOISE(0.01), .nonideal = {.phase_connection_ohm = {0.4, 1, 3}}, .duration_s = 4},
    {.name = "fault_bearing",
     .about = "servo, fault: a worn bearing adds 0 to 0.8 Nm Coulomb and 1e-3 Nms/rad viscous friction from 14 s to 15 s; 1 % noise",
     .machine = {SERVO_PLATE, .coulomb_width_rad_s = 1}, .drive = {SERVO_DRIVE}, .profile = {SERVO_PROFILE}, NOISE(0.01),
     .nonideal = {.bearing_Nm = {0.8, 14, 15}, .bearing_B_Nms_rad = {1e-3, 14, 15}}, .duration_s = 30, .regime = "dynamic", .rtol = 1e-8, .seed = 1},
    {.name = "effect_dead_time",
     .about = "servo on an inverter that takes 4 V from each phase (dead time, 0.15 A wide); 1 % noise",
     SERVO, NOISE(0.01), .nonideal = {.dead_time_V = {.value = 4}, .dead_time_width_A = 0.15}, .duration_s = 2},
    {.name = "effect_angle_offset",
     .about = "servo whose encoder is 0.05 rad (electrical) off; 1 % noise",
     SERVO, NOISE(0.01), .nonideal = {.angle_offset_rad = {.value = 0.05}}, .duration_s = 2},
    {.name = "effect_friction",
     .about = "servo's mechanical side at 1 kHz: 0.1 Nm Coulomb friction, 0.03 Nm apart by direction, 0.08 Nm more near rest, cogging; 1 % noise",
     .machine = {SERVO_PLATE, .coulomb_Nm = 0.1, .coulomb_width_rad_s = 1}, .drive = {SERVO_DRIVE, .log_every = 10},
     .nonideal = {.friction_asymmetry_Nm = {.value = 0.03}, .stribeck_Nm = {.value = 0.08}, .stribeck_width_rad_s = 8, .cogging_Nm = {.value = 0.05},
                  .cogging_order = 12},
     .profile = {.control = DQW_SIM_CONTROL_CURRENT, .speed_start_rad_s = -50,
                 .i_q_A = {.wave = 0.8, .wave_period_s = 1, .shape = DQW_SIM_SHAPE_SQUARE, .random = 0.8, .random_hold_s = 0.1}},
     NOISE(0.01), .duration_s = 10, .regime = "mechanical", .rtol = 1e-9, .seed = 1},
    DRIVES("", "servo 320 V", S320, 150, 0.02, 0.3, 4e-3),
    DRIVES("_joint", "robot joint 24 V", J24, 90, 0.01, 0.1, 1e-2),
    DRIVES("_hub", "hub motor 48 V, 15 pole pairs", H48, 45, 0.03, 0.2, 3e-3),
    DRIVES("_fast", "small and fast 22 V, 10 and 15 uH", F22, 300, 0.08, 0.5, 1e-3),
};
// clang-format on

enum { SCENARIOS = sizeof table / sizeof *table };

size_t dqw_sim_scenario_count(void) { return SCENARIOS; }

const dqw_sim_scenario *dqw_sim_scenario_at(size_t index) { return index < SCENARIOS ? &table[index] : NULL; }

const dqw_sim_scenario *dqw_sim_scenario_find(const char *name)
{
    for (size_t i = 0; name && i < SCENARIOS; ++i)
        if (strcmp(table[i].name, name) == 0) return &table[i];
    return NULL;
}
