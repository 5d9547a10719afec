// The classical Runge-Kutta method of order four in fixed steps between the edges, in CVODE's place for campaigns. A
// step is a fixed part of the plant's fastest time constant: its local error, (h / tau)^5 / 120, is 1e-8 of what moves.
#ifndef DQW_SIM_RK4_H
#define DQW_SIM_RK4_H

#include "sim_integrator.h"

/// As dqw_sim_integrator_watch. Returns 0, or -1 where the plant cannot be evaluated.
int dqw_sim_rk4(dqw_sim_integrator *g, double from_s, double to_s, double *reached_s, int ended[6]);

#endif
