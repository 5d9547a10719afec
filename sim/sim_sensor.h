// ADC and encoder steps, and the white noise of a log.
#ifndef DQW_SIM_SENSOR_H
#define DQW_SIM_SENSOR_H

#include "dqw_sim.h"

/// Quantises what the drive's sensors see at one sample: currents phase by phase, seen in the frame of the quantised angle.
/// Steps of 0 change nothing. v_d, v_q too, as the controller's number format rounds them.
void dqw_sim_sensor_quantise(const dqw_sim_noise *n, int pole_pairs, dqw_sim_row *row);

/// Adds the noise to a finished log and quantises it. Each channel has its own stream.
void dqw_sim_sensor_log(const dqw_sim_scenario *s, dqw_sim_row *rows, size_t count);

#endif
