// What sensors make of the truth: wrong gains, offsets and angle, ADC and encoder steps, and the noise and faults of a
// log.
#ifndef DQW_SIM_SENSOR_H
#define DQW_SIM_SENSOR_H

#include "dqw_sim.h"

/// (E38): gains, offsets and angle as they are at the row's time; its voltage turns into the frame that the drive
/// believes in.
void dqw_sim_sensor_mistake(const dqw_sim_scenario *s, dqw_sim_row *row);

/// Quantises what the drive's sensors see at one sample: currents phase by phase, seen in the frame of the quantised
/// angle.
/// Steps of 0 change nothing. v_d, v_q too, as the controller's number format rounds them.
void dqw_sim_sensor_quantise(const dqw_sim_scenario *s, dqw_sim_row *row);

/// White noise of the k-th sample's current sensors, which loops and log share.
void dqw_sim_sensor_white(const dqw_sim_scenario *s, long k, double *i_alpha_A, double *i_beta_A);

/// Seed of all that sensors draw, apart from that of the excitation, which takes the scenario's as it is.
uint64_t dqw_sim_sensor_seed(const dqw_sim_scenario *s);

/// Streams of what is drawn at each sample; those of the log's noise are its columns' places.
enum { DQW_SIM_STREAM_SENSOR = 40, DQW_SIM_STREAM_OBSERVER = 43 };

/// Turns a log of the truth into what the drive logs: (E38), hum, noise, clipping, steps, dropped samples. Each has its
/// own stream.
void dqw_sim_sensor_log(const dqw_sim_scenario *s, dqw_sim_row *rows, size_t count);

#endif
