// Refuses scenarios that are not a machine.
#ifndef DQW_SIM_CHECK_H
#define DQW_SIM_CHECK_H

#include "dqw_sim.h"

/// Returns 0 or DQW_SIM_ERR_SCENARIO, and then names the field and what it must be in message.
int dqw_sim_check(const dqw_sim_scenario *s, char *message, size_t size);

/// Control periods of a run; only for a checked scenario.
long dqw_sim_periods(const dqw_sim_scenario *s);

/// Rows at the drive's rate, polled or not; only for a checked scenario.
size_t dqw_sim_drive_rows(const dqw_sim_scenario *s);

#endif
