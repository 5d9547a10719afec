// A 48 V drive whose controller knows its voltage to 0.1 V: what is wrong with it, and how it is driven. For tests and
// benches.
#ifndef DRIVE_48V_H
#define DRIVE_48V_H

#include "either_monitor.h"
#include "joint.h"

/// What is wrong: in the rotor's frame, or what the inverter takes from each phase, whose vector is 4/pi of it.
typedef struct voltage_error {
    const char *text;
    double d_V, q_V, dead_V;
    bool told;  ///< dead time is learned
} voltage_error;

static const voltage_error drive_48v_errors[] = {
    {"none", 0, 0, 0, false},
    {"0.1 V on d", 0.1, 0, 0, false},
    {"0.1 V on q", 0, 0.1, 0, false},
    {"0.1 V on both, backwards", -0.0707, -0.0707, 0, false},
    {"0.1 V of dead time, learned", 0, 0, 0.1, true},
    {"0.1 V of dead time, not told", 0, 0, 0.1, false},
};
enum { DRIVE_48V_ERRORS = sizeof drive_48v_errors / sizeof drive_48v_errors[0] };

/// Length of the vector by which the voltage is off, unseen, V.
static inline double drive_48v_off_V(const voltage_error *e)
{
    return e->told ? 0.0 : hypot(e->d_V, e->q_V) + 1.2732 * e->dead_V;
}

/// How it is driven: means, and how far it moves around them. Speed as a sine of 2 s, currents drawn anew.
typedef struct driven {
    const char *text;
    double w_rad_s, w_wave_rad_s, i_d_A, i_d_random_A, i_q_A, i_q_random_A, binary_V;
    bool angle;
} driven;

/// The currents' random parts are uniform: their RMS over the square root of three.
static inline dqw_sim_scenario drive_48v(const voltage_error *e, const driven *how, int seed, double duration_s)
{
    dqw_sim_scenario s = joint_scenario(seed, 0.005, duration_s);
    s.method = DQW_SIM_RK4;
    s.machine.pole_pairs = 15;
    s.machine.R_ohm = 0.24;
    s.machine.Ld_H = 520e-6;
    s.machine.Lq_H = 650e-6;
    s.machine.psi_Wb = 0.012;
    s.drive.v_dc_V = 48;
    s.drive.i_max_A = 30;
    s.drive.current_bandwidth_rad_s = 1500;
    s.profile = (dqw_sim_profile){
        .control = DQW_SIM_CONTROL_CURRENT,
        .shaft = DQW_SIM_SHAFT_IMPOSED,
        .speed_rad_s = {.value = how->w_rad_s, .wave = how->w_wave_rad_s, .wave_period_s = 2},
        .i_d_A = {.value = how->i_d_A, .random = how->i_d_random_A, .random_hold_s = 0.037},
        .i_q_A = {.value = how->i_q_A, .random = how->i_q_random_A, .random_hold_s = 0.11},
        .v_d_V = {.binary = how->binary_V, .binary_hold_s = 3e-4},
        .v_q_V = {.binary = how->binary_V, .binary_hold_s = 3e-4},
    };
    s.nonideal.voltage_offset_d_V.value = e->d_V;
    s.nonideal.voltage_offset_q_V.value = e->q_V;
    s.nonideal.dead_time_V.value = e->dead_V;
    s.nonideal.dead_time_width_A = 0.2;
    return s;
}

static inline dqw_monitor_config drive_48v_monitor(const voltage_error *e, const driven *how, const dqw_sim_scenario *s)
{
    dqw_monitor_config c = {.estimator = joint_in_service(&s->machine, e->told ? 0.2 : 0.0)};
    c.estimator.v_base_V = 27.0f;
    c.estimator.i_base_A = 15.0f;
    c.estimator.w_base_rad_s = 80.0f;
    c.estimator.angle = c.estimator.encoder_offset = how->angle;
    return c;
}

/// Root mean squares over a log.
typedef struct drive_48v_rms {
    double i_A, w_Ld_i_d_V, w_Lq_i_q_V;
} drive_48v_rms;

static inline drive_48v_rms drive_48v_measure(const joint_log *log, const dqw_sim_machine *m)
{
    drive_48v_rms r = {0, 0, 0};
    for (size_t k = 0; k < log->count; k++) {
        const dqw_sim_row *x = &log->row[k];
        const double w_e = m->pole_pairs * x->w_m_rad_s;
        r.i_A += (x->i_d_A * x->i_d_A + x->i_q_A * x->i_q_A) / (double)log->count;
        r.w_Ld_i_d_V += pow(w_e * m->Ld_H * x->i_d_A, 2) / (double)log->count;
        r.w_Lq_i_q_V += pow(w_e * m->Lq_H * x->i_q_A, 2) / (double)log->count;
    }
    const drive_48v_rms root = {sqrt(r.i_A), sqrt(r.w_Ld_i_d_V), sqrt(r.w_Lq_i_q_V)};
    return root;
}

/// The whole log through a monitor; returns its events.
static inline int drive_48v_watch(either_monitor *m, const dqw_monitor_config *c, const joint_log *log)
{
    int events = 0;
    for (size_t k = 0; k < log->count; k++) {
        const dqw_sample x = joint_sample(&log->row[k]);
        dqw_monitor_change e;
        events += either_step(m, c, &x, &e);
    }
    return events;
}

#endif
