// The simulator's plant under a stranger's duties: no control, no sensors.
#ifndef DQW_BENCH_STRANGERS_OURS_H
#define DQW_BENCH_STRANGERS_OURS_H

#include "sim_stage.h"

typedef struct instant {
    double i_d_A, i_q_A, v_link_V, theta_e_rad, w_e_rad_s;
} instant;

typedef struct ours {
    dqw_sim_stage stage;
    double t_s, psi_d_Wb, psi_q_Wb, theta_e_rad, w_m_rad_s;
} ours;

/// At rest but for the scenario's speed_start_rad_s, without current, the link charged. Returns 0 or below; always end
/// with ours_free.
int ours_init(ours *o, const dqw_sim_scenario *s, double theta_e_rad);
void ours_free(ours *o);

/// One PWM period. Fills the instants at its middle and at its end; returns 0 or below.
int ours_period(ours *o, const double duty[3], instant *middle, instant *end);

#endif
