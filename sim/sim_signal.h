// Values of references, excitations and ramps at a time.
#ifndef DQW_SIM_SIGNAL_H
#define DQW_SIM_SIGNAL_H

#include "dqw_sim.h"

/// The signal at t_s. `stream` separates the random parts of different signals.
double dqw_sim_signal_at(const dqw_sim_signal *g, double t_s, uint64_t seed, uint64_t stream);

/// The ramp at t_s.
double dqw_sim_ramp_at(const dqw_sim_ramp *r, double t_s);

#endif
