// The standard drive of the paper's Figs 4 and 5: PI current loops with decoupling, PI speed loop, limits.
#ifndef DQW_SIM_CONTROL_H
#define DQW_SIM_CONTROL_H

#include "dqw_sim.h"

typedef struct dqw_sim_controller {
    double Ld_H, Lq_H, psi_Wb;  ///< what the controller takes the machine for
    double integral_d_V, integral_q_V, integral_speed_A;
} dqw_sim_controller;

/// What the sensors say at a sample.
typedef struct dqw_sim_measured {
    double t_s, i_d_A, i_q_A, w_m_rad_s, theta_e_rad, v_dc_V;
} dqw_sim_measured;

/// Shortens a voltage to what the link can give.
void dqw_sim_limit(const dqw_sim_drive *drive, double v_dc_V, double *v_d_V, double *v_q_V);

/// Voltage in the rotating frame for the period that begins at t_apply_s, within the voltage limit.
///
/// Current loops: zero of the PI on the winding's pole (gain bandwidth L, integral gain bandwidth R); decoupling by the
/// reference currents. Speed loop: gain bandwidth J / K_t, corner at a quarter of its bandwidth. All integrators are
/// held back by what the limits cut off. Random parts of the references come from `s->seed`.
void dqw_sim_controller_step(dqw_sim_controller *c, const dqw_sim_scenario *s, const dqw_sim_measured *m,
                             double t_apply_s, double *v_d_V, double *v_q_V);

/// Streams of the signals' random numbers.
enum {
    DQW_SIM_STREAM_SPEED,
    DQW_SIM_STREAM_I_D,
    DQW_SIM_STREAM_I_Q,
    DQW_SIM_STREAM_V_D,
    DQW_SIM_STREAM_V_Q,
    DQW_SIM_STREAM_LOAD,
    DQW_SIM_STREAMS
};

#endif
