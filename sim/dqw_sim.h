/// A complete permanent-magnet drive, simulated with CVODE: machine, inverter, control, sensors, log.
///
/// Conventions: amplitude-invariant Clarke (peak phase values), star, R and L phase-to-neutral, motor convention,
/// w_m mechanical, w_e = p w_m electrical, d axis on the magnet. Machine: (P6), (P7) in flux form,
///     v = R i + dpsi/dt + w_e J psi,   torque = 1.5 p (psi_d i_q - psi_q i_d).
/// Row k of a log: currents, speed, angle, temperatures and torque sampled at t_k, just before the inverter switches;
/// v_d, v_q the mean, from t_k to t_{k+1}, of the commanded voltage as seen in the rotating frame.
/// What real drives add (`inverter`, `sensing`, and the keys of `drive` and `machine` for it) is absent where it is 0.
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
    /// a third body, which iron loss then heats in the magnet's place; 0: none
    double housing_heat_J_K, winding_housing_W_K, magnet_housing_W_K, housing_ambient_W_K;
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
    dqw_sim_ramp iron_hysteresis_S_rad_s;  ///< adds this / hypot(w_e, corner) to iron_loss_S: a loss that goes with w_e
    double iron_hysteresis_corner_rad_s;
    double iron_loss_tau_s;             ///< the eddies' own time constant; needed where the inverter switches
    dqw_sim_ramp heat_W;                ///< from elsewhere, into the housing, or the winding where there is none
    dqw_sim_ramp winding_alpha_per_K;   ///< R = R_0 (1 + alpha (T - T_ref))
    dqw_sim_ramp magnet_beta_per_K;     ///< psi = psi_0 (1 + beta (T - T_ref))
    dqw_sim_ramp turn_short;            ///< fault: shorted fraction of phase a's turns, 0..1
    double turn_short_ohm;              ///< resistance of that short
    double turn_short_H;                ///< its leakage; needed where the inverter switches
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
    /// A magnet unlike the others: the d axis gains cos(theta_m + phase) of it, once a turn
    dqw_sim_ramp magnet_asymmetry_Wb;
    double magnet_asymmetry_phase_rad;
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

/// How the three legs share the voltage. Mean: no switching, the voltage itself acts.
enum dqw_sim_modulation {
    DQW_SIM_MODULATION_MEAN = 0,
    DQW_SIM_MODULATION_CENTRED = 1,       ///< both zero vectors alike: all legs switch
    DQW_SIM_MODULATION_CLAMPED_LOW = 2,   ///< the lowest leg rests on the negative rail
    DQW_SIM_MODULATION_CLAMPED_HIGH = 3,  ///< the highest leg rests on the positive rail
    DQW_SIM_MODULATION_CLAMPED_60 = 4     ///< the leg of the largest voltage rests, 60 degrees at a time
};

/// Which switch of a leg gives the dead time up. Both: each closes late. One: the other's pulse stays as commanded, and
/// the leg errs in one direction of the current alone, by twice as much.
enum dqw_sim_dead_side { DQW_SIM_DEAD_BOTH = 0, DQW_SIM_DEAD_UPPER = 1, DQW_SIM_DEAD_LOWER = 2 };

/// What carries the current against an open or closed switch's own direction outside of dead time.
enum dqw_sim_reverse { DQW_SIM_REVERSE_DIODE = 0, DQW_SIM_REVERSE_CHANNEL = 1 };

/// Three legs on a DC link, switched by a carrier whose valley is the sampling instant. See sim_inverter.h.
typedef struct dqw_sim_inverter {
    enum dqw_sim_modulation modulation;
    int carriers;        ///< PWM periods per control period; 0 counts as 1
    int compare_counts;  ///< steps of the compare value from 0 to 1; 0: none
    double dead_time_s;
    enum dqw_sim_dead_side dead_side;
    double node_F;  ///< capacitance at a leg's output, which the current must turn over within the dead time
    double switch_V, switch_ohm, diode_V, diode_ohm;  ///< drop V i / hypot(i, knee) + R i
    double knee_A;
    enum dqw_sim_reverse reverse;
    double source_ohm, link_F;   ///< drive.v_dc_V behind a resistance feeds the link's capacitor; both 0: ideal
    double ripple_V, ripple_Hz;  ///< sine on the source's voltage
} dqw_sim_inverter;

/// Which phases have a current sensor.
enum dqw_sim_phases { DQW_SIM_PHASES_ABC = 0, DQW_SIM_PHASES_AB = 1, DQW_SIM_PHASES_BC = 2, DQW_SIM_PHASES_CA = 3 };

/// What the drive takes currents, angle and speed from; its loops and its log see the same. See sim_encoder.h.
typedef struct dqw_sim_sensing {
    enum dqw_sim_phases phases;
    double late_periods;  ///< the currents are sampled this much after the angle, 0..below 1
    double filter_s;      ///< RC filter before the sampling
    double noise_A;       ///< white, on each sensor
    double once_rad, once_phase_rad, twice_rad, twice_phase_rad;  ///< encoder's eccentricity, mechanical
    double angle_late_periods;                                    ///< 0..1
    double speed_bandwidth_rad_s;  ///< the speed is a loop's that tracks the seen angle; 0: the shaft's
    bool observer;                 ///< no encoder: the angle lags and is noisy
    double observer_lag_s;         ///< the angle lags by this times w_e
    double observer_load_rad_A;    ///< and by this times i_q
    double observer_noise_rad;     ///< at rest; falls with corner / (|w_e| + corner), filtered at the bandwidth
    double observer_corner_rad_s, observer_bandwidth_rad_s;
} dqw_sim_sensing;

/// The log as a vendor's tool writes it, polled: means of currents and voltages since the last row, speed of the
/// instant.
typedef struct dqw_sim_polled {
    double rate_Hz;            ///< 0: not polled
    int queue_rows;            ///< currents and voltages come this many rows after the speed; as many zero rows first
    double jitter_s;           ///< of the host's stamps, standard deviation
    double lost_fraction;      ///< rows that never arrive
    double repeated_fraction;  ///< rows that repeat the last one's means
    double speed_noise_rad_s;  ///< of the instant speed
    double step_i_A, step_v_V, step_erpm, step_v_dc_V;  ///< on the wire
} dqw_sim_polled;

/// What of a voltage the log holds.
enum dqw_sim_logged {
    DQW_SIM_LOGGED_MEAN = 0,    ///< of the period that begins at t_k, as seen in the rotating frame
    DQW_SIM_LOGGED_DECIDED = 1  ///< as the controller decided it at t_k, in the frame of t_k; acts in the next period
};

enum dqw_sim_link { DQW_SIM_LINK_MEASURED = 0, DQW_SIM_LINK_NOMINAL = 1 };

/// Control and logging. One control period of delay between sampling and switching.
typedef struct dqw_sim_drive {
    double dt_s;    ///< control and PWM period
    double v_dc_V;  ///< voltage vector limited to v_dc / sqrt(3)
    double current_bandwidth_rad_s, speed_bandwidth_rad_s;
    double i_max_A;  ///< current references are limited to this magnitude
    enum dqw_sim_hold hold;
    bool unturned;        ///< the voltage is not turned ahead to the period in which it acts
    bool overmodulation;  ///< voltage vector limited to 2/3 v_dc, then to the hexagon, which the log does not know
    double compensation;  ///< part of the inverter's dead time that the controller gives back: 1 right
    double compensation_width_A;  ///< proportional below this phase current
    enum dqw_sim_link link;       ///< measured, or the nominal v_dc_V in control and log
    enum dqw_sim_logged logged;
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
    /// table[k] at k table_dt_s, straight lines between them, the last one from there on; the caller's, NULL: none
    const double *table;
    size_t table_rows;
    double table_dt_s;
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

/// RK4: no CVODE but a fixed step of order four between the edges, for campaigns. See sim_rk4.h.
enum dqw_sim_method { DQW_SIM_ADAMS = 0, DQW_SIM_BDF = 1, DQW_SIM_RK4 = 2 };

typedef struct dqw_sim_scenario {
    const char *name, *about;
    const char *
        regime;  ///< of the log: "dynamic", "steady", "standstill" or "mechanical"; where polled.rate_Hz is above 0, "polled"
    dqw_sim_machine machine;
    dqw_sim_nonideal nonideal;
    dqw_sim_inverter inverter;
    dqw_sim_sensing sensing;
    dqw_sim_drive drive;
    dqw_sim_polled polled;
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
    /// copper + iron = these two where there are heat capacities; what heat_W brings counts against the ambient
    double heat_stored_J, heat_ambient_J;
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

/// What a key takes, for a message: "a number", or "adams, bdf or rk4"; "" where there is no such key.
void dqw_sim_expected(const char *key, char *text, size_t size);

/// The name that a choice has in this scenario, "centred" of "inverter.modulation"; "" where the key is no choice.
void dqw_sim_chosen(const dqw_sim_scenario *s, const char *key, char *text, size_t size);

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

/// A run that its caller steps, with a controller of the caller's own in place of the drive's loops.
typedef struct dqw_sim_stepper dqw_sim_stepper;

/// What the caller decides for the period that begins: a voltage in the rotating frame of the angle that the sensors
/// saw last, limited as the drive's is; load_Nm and speed_rad_s (of an imposed shaft, at the period's end) are added to
/// the profile's.
typedef struct dqw_sim_decision {
    double v_d_V, v_q_V, load_Nm, speed_rad_s;
} dqw_sim_decision;

/// Begins a run; the scenario is copied, its tables stay the caller's. *seen: what the loops would see at the start.
/// Returns 0 or a negative dqw_sim_status, and then *out is NULL.
int dqw_sim_open(const dqw_sim_scenario *s, dqw_sim_stepper **out, dqw_sim_row *seen, char *why, size_t size);

/// One control period, from t_k to t_{k+1}. *seen: what the loops see of t_k, with the voltage's mean of the period as
/// the log has it: a drive decides by it what the next period applies. *logged: the same without quantisation and what
/// current sensors err by, as dqw_sim_close_log takes it. Past duration_s it goes on. Returns as dqw_sim_open.
int dqw_sim_step(dqw_sim_stepper *x, const dqw_sim_decision *decision, dqw_sim_row *seen, dqw_sim_row *logged,
                 char *why, size_t size);

/// Makes of the rows that steps logged what the drive's log would hold: noise, quantisation and sensors' errors.
void dqw_sim_log_of(const dqw_sim_stepper *x, dqw_sim_row *rows, size_t count);

/// Ends it; NULL is nothing.
void dqw_sim_close(dqw_sim_stepper *x);

/// One line for a status.
const char *dqw_sim_status_text(int status);

#ifdef __cplusplus
}
#endif
#endif
