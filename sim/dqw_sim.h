/// A complete permanent-magnet drive, simulated with CVODE: machine, inverter, control, sensors, log.
///
/// Conventions: amplitude-invariant Clarke (peak phase values), star, R and L phase-to-neutral, motor convention,
/// w_m mechanical, w_e = p w_m electrical, d axis on the magnet. Machine: (P6), (P7) in flux form,
///     v = R i + dpsi/dt + w_e J psi,   torque = 1.5 p (psi_d i_q - psi_q i_d).
/// Row k of a log: currents, speed, angle, temperatures and torque sampled at t_k, just before the inverter switches;
/// v_d, v_q the mean, from t_k to t_{k+1}, of the commanded voltage as seen in the rotating frame.
#ifndef DQW_SIM_H
#define DQW_SIM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// What a function returns: 0, or one of these.
enum dqw_sim_status {
    DQW_SIM_OK = 0,
    DQW_SIM_ERR_KEY = -1,       ///< no such key
    DQW_SIM_ERR_VALUE = -2,     ///< the text is not a value of this key's kind
    DQW_SIM_ERR_SCENARIO = -3,  ///< unphysical or contradictory scenario
    DQW_SIM_ERR_CAPACITY = -4,  ///< fewer rows offered than the run writes
    DQW_SIM_ERR_MAP = -5,     ///< flux map or inverter curve unreadable or malformed; map not a grid, or not invertible
    DQW_SIM_ERR_SOLVER = -6,  ///< CVODE gave up (the message says when and why)
    DQW_SIM_ERR_MEMORY = -7,
    DQW_SIM_ERR_ABORTED = -8  ///< the progress callback asked to stop
};

/// One logged row: what the drive's sensors say (noise and quantisation in).
typedef struct dqw_sim_row {
    double t_s, v_d_V, v_q_V, i_d_A, i_q_A, w_m_rad_s, theta_e_rad, theta_m_rad, v_dc_V;
    double temp_winding_C, temp_magnet_C, torque_Nm;
} dqw_sim_row;

/// The healthy machine. Ld, Lq: differential inductances at zero current and reference temperature.
typedef struct dqw_sim_machine {
    int pole_pairs;
    double R_ohm, Ld_H, Lq_H, psi_Wb;
    double J_kgm2, B_Nms_rad;
    double coulomb_Nm, coulomb_width_rad_s;  ///< torque_Nm * tanh(w_m / width)
    double temp_ref_C;                       ///< R_ohm and psi_Wb hold here
    double temp_ambient_C, temp_start_C;
    double winding_heat_J_K, magnet_heat_J_K;  ///< heat capacities; both 0: temperatures stay at temp_start_C
    double winding_magnet_W_K, winding_ambient_W_K, magnet_ambient_W_K;
    char flux_map[256];  ///< CSV i_d_A,i_q_A,psi_d_Wb,psi_q_Wb; replaces Ld, Lq, psi and the saturation law; "": none
} dqw_sim_machine;

/// 0 before t_start_s, then a straight line to `value` at t_end_s, then `value`. Both times 0: `value` from the start.
typedef struct dqw_sim_ramp {
    double value, t_start_s, t_end_s;
} dqw_sim_ramp;

/// Everything that the ideal drive lacks. All zero: the ideal machine on the ideal inverter.
typedef struct dqw_sim_nonideal {
    dqw_sim_ramp dead_time_V;  ///< (E32): phase x loses V tanh(i_x / width), zero sequence removed
    double dead_time_width_A;
    dqw_sim_ramp saturation_dd_A_Wb3, saturation_qq_A_Wb3, saturation_dq_A_Wb3;  ///< quartic energy, see sim_flux.h
    dqw_sim_ramp iron_loss_S;                                                    ///< 1/R_fe, across the induced voltage
    dqw_sim_ramp winding_alpha_per_K;                                            ///< R = R_0 (1 + alpha (T - T_ref))
    dqw_sim_ramp magnet_beta_per_K;                                              ///< psi = psi_0 (1 + beta (T - T_ref))
    dqw_sim_ramp turn_short;            ///< fault: shorted fraction of phase a's turns, 0..1
    double turn_short_ohm;              ///< resistance of that short
    dqw_sim_ramp demagnetisation;       ///< fault: lost fraction of the magnet's flux, 0..1
    dqw_sim_ramp phase_connection_ohm;  ///< fault: extra resistance in series with phase a
    dqw_sim_ramp bearing_Nm;            ///< fault: extra Coulomb friction (the machine's coulomb_width_rad_s)
    dqw_sim_ramp bearing_B_Nms_rad;     ///< fault: extra viscous friction
    dqw_sim_ramp skin_effect_s2_rad2;   ///< (E35): R (1 + k w_e^2)
    /// phase a, b: the healthy one plus this, which may be negative
    dqw_sim_ramp phase_resistance_a_ohm, phase_resistance_b_ohm;
    /// (E36): rotor-frame flux linkage gains d cos(n theta_e + phase), q sin(n theta_e + phase), n = 6, 12
    dqw_sim_ramp flux_harmonic_6d_Wb, flux_harmonic_6q_Wb, flux_harmonic_12d_Wb, flux_harmonic_12q_Wb;
    double flux_harmonic_6_phase_rad, flux_harmonic_12_phase_rad;
    dqw_sim_ramp delay_periods;  ///< (E37): the inverter switches this late, 0..2; the log's voltage is what was meant
    /// (E38): what the control loops and the log take for the phase currents: (1 + gain) i, then the offset
    dqw_sim_ramp current_gain_a, current_gain_b, current_gain_c, current_offset_alpha_A, current_offset_beta_A;
    dqw_sim_ramp angle_offset_rad;  ///< (E38): the drive's electrical angle is the true one plus this
    dqw_sim_ramp voltage_offset_d_V, voltage_offset_q_V;  ///< the log's voltage is the commanded one plus this
    dqw_sim_ramp stribeck_Nm;  ///< (E39): more friction near rest; smoothed as Coulomb friction is
    double stribeck_width_rad_s;
    /// (E39): Coulomb friction is this much more at positive speed, and less at negative
    dqw_sim_ramp friction_asymmetry_Nm;
    dqw_sim_ramp cogging_Nm;  ///< (E39): torque cogging_Nm sin(order theta_m + phase)
    int cogging_order;
    double cogging_phase_rad;
    char inverter_curve
        [256];  ///< CSV i_A,v_V: each phase's measured loss, see sim_curve.h; replaces dead_time_V; "": none
    // Not of the catalogue of effects: what a tracer must not give one of its names.
    dqw_sim_ramp disturbance_V;  ///< added to the applied voltage, not to the log's: d as sin, q a quarter turn later
    double disturbance_Hz;
    dqw_sim_ramp hum_A;  ///< mains hum on phase a's current sensor, in the log alone
    double hum_Hz;
    double clip_A;            ///< the log's phase currents end here; 0: nowhere
    double dropped_fraction;  ///< of the log's rows repeat the last row's currents, drawn by the seed, 0..1
} dqw_sim_nonideal;

/// In which frame the inverter holds its voltage over a period.
enum dqw_sim_hold {
    DQW_SIM_HOLD_ABC = 0,  ///< stationary: one PWM period per control period, as a real inverter does
    DQW_SIM_HOLD_DQ = 1    ///< rotating: the mean of many PWM periods, for control periods of milliseconds
};

/// Inverter, control and logging. One control period of delay between sampling and switching.
typedef struct dqw_sim_drive {
    double dt_s;    ///< control and PWM period
    double v_dc_V;  ///< voltage vector limited to v_dc / sqrt(3)
    double current_bandwidth_rad_s, speed_bandwidth_rad_s;
    double i_max_A;  ///< current references are limited to this magnitude
    enum dqw_sim_hold hold;
    int log_every;  ///< control periods per row; 0 counts as 1
    /// of these, the last so many are averaged in v_d, v_q, and the row samples at their start; 0: all
    int log_window;
} dqw_sim_drive;

enum dqw_sim_control { DQW_SIM_CONTROL_SPEED = 0, DQW_SIM_CONTROL_CURRENT = 1, DQW_SIM_CONTROL_VOLTAGE = 2 };
enum dqw_sim_shaft {
    DQW_SIM_SHAFT_FREE = 0,    ///< inertia, friction and load torque decide the speed
    DQW_SIM_SHAFT_IMPOSED = 1  ///< a load machine imposes profile.speed_rad_s (0: locked rotor)
};
enum dqw_sim_shape {
    DQW_SIM_SHAPE_SINE = 0,
    DQW_SIM_SHAPE_SQUARE = 1,
    DQW_SIM_SHAPE_TRIANGLE = 2,
    DQW_SIM_SHAPE_STAIRS = 3
};

/// A reference or excitation: the sum of its parts, each absent where its size is 0.
typedef struct dqw_sim_signal {
    double value;
    double step, t_step_s;       ///< added from t_step_s on
    double wave, wave_period_s;  ///< amplitude and period of `shape`, which starts at 0 (stairs: at -wave)
    enum dqw_sim_shape shape;
    int levels;                    ///< stairs: this many equal levels from -wave to +wave per period
    double random, random_hold_s;  ///< uniform in +-random, drawn anew every hold
    double binary, binary_hold_s;  ///< +-binary, sign drawn anew every hold
} dqw_sim_signal;

/// What the drive is asked to do.
typedef struct dqw_sim_profile {
    enum dqw_sim_control control;
    enum dqw_sim_shaft shaft;
    double speed_start_rad_s;
    dqw_sim_signal speed_rad_s;   ///< reference (control = speed) or imposed speed (shaft = imposed)
    dqw_sim_signal i_d_A, i_q_A;  ///< references; with speed control i_q_A is added to the speed loop's demand
    dqw_sim_signal v_d_V, v_q_V;  ///< added to the current loops' voltage; with control = voltage, the voltage
    dqw_sim_signal load_Nm;       ///< against positive torque
} dqw_sim_profile;

/// White noise as a fraction of each signal's standard deviation over the log, and ADC steps (0: none). Noise is added
/// to the log; the control loops see the quantised but noise-free signals. Currents are quantised phase by phase.
typedef struct dqw_sim_noise {
    double i, v, w, theta, v_dc, temp, torque;
    double step_i_A, step_v_V, step_w_rad_s, step_theta_m_rad, step_v_dc_V, step_temp_C, step_torque_Nm;
    uint64_t seed;  ///< changes the noise alone; the scenario's seed changes noise and excitation
} dqw_sim_noise;

enum dqw_sim_method { DQW_SIM_ADAMS = 0, DQW_SIM_BDF = 1 };

typedef struct dqw_sim_scenario {
    const char *name, *about;
    const char *regime;  ///< of the log: "dynamic", "steady", "standstill" or "mechanical"
    dqw_sim_machine machine;
    dqw_sim_nonideal nonideal;
    dqw_sim_drive drive;
    dqw_sim_profile profile;
    dqw_sim_noise noise;
    double duration_s;
    double rtol;  ///< local error per step, relative to each state's base (flux, speed, angle, temperature)
    enum dqw_sim_method method;
    bool balance;  ///< integrate the energies of the report as well
    uint64_t seed;
} dqw_sim_scenario;

/// How a run went. Energies in joule, over the whole run, where the scenario's `balance` is set, (E34):
///     electrical = copper + iron + mechanical + (stored_end - stored_start) + magnet.
typedef struct dqw_sim_report {
    double electrical_J;  ///< in at the machine's terminals
    double copper_J;      ///< winding, shorted turns and their short, bad connection
    double iron_J;
    double mechanical_J;                  ///< air-gap torque times speed
    double stored_start_J, stored_end_J;  ///< magnetic
    double magnet_J;  ///< work on the magnet and the iron as they change in time (temperature, ramps)
    /// mechanical = kinetic + friction + load (and cogging) where the shaft is free
    double kinetic_J, friction_J, load_J;
    double heat_stored_J, heat_ambient_J;  ///< copper + iron = these two where there are heat capacities
    long periods, steps, rhs_evaluations, error_test_failures;
    double map_rms_Wb, map_max_Wb;  ///< flux map minus its projection on one co-energy
    double map_curl;                ///< RMS of L_dq - L_qd over RMS of the cross terms' mean size
    double Ld_H, Lq_H, psi_Wb;      ///< the plant's at zero current and start (from the map where there is one)
    char message[320];              ///< one line on an error, else ""
} dqw_sim_report;

/// Named scenarios. `at`: NULL past the end; `find`: NULL where there is none. O(1), O(n).
size_t dqw_sim_scenario_count(void);
const dqw_sim_scenario *dqw_sim_scenario_at(size_t index);
const dqw_sim_scenario *dqw_sim_scenario_find(const char *name);

/// Sets one field by its path: "duration_s", "machine.R_ohm", "nonideal.dead_time_V", "nonideal.turn_short.t_start_s",
/// "profile.i_d_A.random"; "noise" is every channel's noise fraction, "noise_i" = "noise.i" and so on.
/// Returns 0, DQW_SIM_ERR_KEY or DQW_SIM_ERR_VALUE (then nothing is changed). O(number of keys).
int dqw_sim_set(dqw_sim_scenario *s, const char *key, const char *value);

/// Every key that dqw_sim_set knows, one by one; NULL past the end.
const char *dqw_sim_key_at(size_t index);

/// Rows that a run of this scenario writes; 0 where the scenario is invalid.
size_t dqw_sim_rows(const dqw_sim_scenario *s);

/// Simulates, and writes dqw_sim_rows(s) rows. `report`, `progress` may be NULL; progress(ctx, 0..1) is called about
/// a hundred times, and a nonzero answer stops the run. Returns 0 or a negative dqw_sim_status; report->message says
/// why.
/// Cost: some 5 to 15 microseconds a control period. Thread safe; the same scenario gives the same rows.
int dqw_sim_run(const dqw_sim_scenario *s, dqw_sim_row *rows, size_t capacity, dqw_sim_report *report,
                int (*progress)(void *ctx, double fraction), void *ctx);

/// One line for a status.
const char *dqw_sim_status_text(int status);

#ifdef __cplusplus
}
#endif
#endif
