// A scenario run into a log of its own, for tests of the simulator.
#ifndef DQW_TESTS_SIM_LOG_H
#define DQW_TESTS_SIM_LOG_H

#include <stdlib.h>

#include "dqw_sim.h"
#include "unity.h"

/// Rows of the last log.
static size_t count;

/// The whole log; the caller frees it.
static inline dqw_sim_row *simulate(const dqw_sim_scenario *s)
{
    dqw_sim_report report;
    count = dqw_sim_rows(s);
    dqw_sim_row *log = calloc(count ? count : 1, sizeof *log);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, dqw_sim_run(s, log, count, &report, NULL, NULL), report.message);
    return log;
}

/// The servo at an imposed speed, its currents held in the frame that the drive believes in, until all has settled.
static inline dqw_sim_scenario settled(double i_d_A, double i_q_A, double speed_rad_s)
{
    dqw_sim_scenario s = *dqw_sim_scenario_find("servo_ideal");
    s.profile = (dqw_sim_profile){.control = DQW_SIM_CONTROL_CURRENT, .shaft = DQW_SIM_SHAFT_IMPOSED};
    s.profile.i_d_A.value = i_d_A, s.profile.i_q_A.value = i_q_A, s.profile.speed_rad_s.value = speed_rad_s;
    s.drive.hold = DQW_SIM_HOLD_DQ;
    s.duration_s = 0.1, s.rtol = 1e-10;
    return s;
}

#endif
