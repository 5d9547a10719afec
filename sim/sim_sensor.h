// What sensors make of the truth: wrong gains, offsets and angle, ADC and encoder steps, and the noise and faults of a
// log.
#ifndef DQW_SIM_SENSOR_H
#define DQW_SIM_SENSOR_H

#include "dqw_sim.h"

/// (E38): gains, offsets and angle as they are at the row's time; its voltage turns into the frame that the drive
/// believes in.
void dqw_sim_sensor_mistake(const dqw_sim_nonideal *x, int pole_pairs, dqw_sim_row *row);

/// Quantises what the drive's sensors see at one sample: currents phase by phase, seen in the frame of the quantised
/// angle.
/// Steps of 0 change nothing. v_d, v_q too, as the controller's number format rounds them.
void dqw_sim_sensor_quantise(const dqw_sim_noise *n, int pole_pairs, dqw_sim_row *row);

/// Turns a log of the truth into what the drive logs: (E38), hum, noise, clipping, steps, dropped samples. Each has its
/// own stream.
void dqw_sim_sensor_log(const dqw_sim_scenario *s, dqw_sim_row *rows, size_t count);

#endif
