// A voltage vector that the inverter holds, as others see it.
#ifndef DQW_SIM_HOLD_H
#define DQW_SIM_HOLD_H

#include "sim_plant.h"

/// In the frame of the plant's integration. held: stationary, or where the plant's frame turns, in the rotor's.
void dqw_sim_hold_in_frame(const dqw_sim_plant *p, const double held[2], double *v_x_V, double *v_y_V);

/// Its mean over the period as the rotor sees it, which turns by turn_rad and has the speeds w0, w1 at both ends.
void dqw_sim_hold_mean(const dqw_sim_plant *p, const double held[2], double dt_s, double turn_rad, double w0, double w1,
                       double *v_d_V, double *v_q_V);

#endif
