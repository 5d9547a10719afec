// Vectors of a log as complex numbers d + j q, and a machine that no loop holds.
#ifndef DQW_TESTS_SIM_DQ_H
#define DQW_TESTS_SIM_DQ_H

#include <complex.h>

#include "sim_log.h"

static inline double complex i_of(const dqw_sim_row *row) { return row->i_d_A + row->i_q_A * I; }
static inline double complex v_of(const dqw_sim_row *row) { return row->v_d_V + row->v_q_V * I; }
static inline double complex turned(double complex x, double angle) { return x * cexp(I * angle); }

// A voltage in the rotor's frame at an imposed speed. No loop: what the sensors make of it changes nothing.
static inline dqw_sim_scenario open_loop(double v_d_V, double v_q_V, double speed_rad_s)
{
    dqw_sim_scenario s = *dqw_sim_scenario_find("servo_ideal");
    s.profile = (dqw_sim_profile){.control = DQW_SIM_CONTROL_VOLTAGE, .shaft = DQW_SIM_SHAFT_IMPOSED};
    s.profile.v_d_V.value = v_d_V, s.profile.v_q_V.value = v_q_V, s.profile.speed_rad_s.value = speed_rad_s;
    s.machine.Lq_H = s.machine.Ld_H;
    s.duration_s = 0.02, s.rtol = 1e-9;
    return s;
}

#endif
