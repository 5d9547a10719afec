// The simulated joint of the monitors' tests: 1 % noise, dead time and Coulomb friction; healthy until ONSET_S, then a
// fault.
#ifndef FAULTY_JOINT_H
#define FAULTY_JOINT_H

#include "dqw_fault.h"
#include "dqw_sim.h"
#include "dqw_test.h"

#define DT_S 5e-5
#define ONSET_S 2.0
#define GROWS_S 0.1
#define DEAD_TIME_V 0.24
#define LOG_S 3.5
enum { ROWS = 110001 };

static inline bool quick(void) { return scaled(10) == 1; }

static dqw_sim_row rows[ROWS];
static int row_count;

static inline dqw_sim_scenario joint(double duration_s)
{
    dqw_sim_scenario s = *dqw_sim_scenario_find("joint_24v");
    s.seed = 1;
    s.duration_s = duration_s;
    s.method = DQW_SIM_RK4;
    s.nonideal.dead_time_V.value = DEAD_TIME_V;
    s.nonideal.dead_time_width_A = 0.05;
    s.nonideal.turn_short_ohm = 0.05;
    s.machine.coulomb_Nm = 0.02;
    s.machine.coulomb_width_rad_s = 1;
    return s;
}

static inline void simulate(const dqw_sim_scenario *s)
{
    dqw_sim_report report;
    row_count = (int)dqw_sim_rows(s);
    TEST_ASSERT_TRUE(row_count > 0 && row_count <= ROWS);
    TEST_ASSERT_EQUAL_INT_MESSAGE(DQW_SIM_OK, dqw_sim_run(s, rows, (size_t)row_count, &report, NULL, NULL),
                                  report.message);
}

// An ohm more in line for the first 0.1 s, as where a link charges.
static inline void simulate_a_link_that_charges(void)
{
    const dqw_sim_scenario s = joint(2.0);
    simulate(&s);
    for (int k = 0; k < 2000; k++) {
        rows[k].v_d_V += 1.0 * rows[k].i_d_A;
        rows[k].v_q_V += 1.0 * rows[k].i_q_A;
    }
}

typedef struct fault {
    const char *text, *key;  ///< the simulator's; NULL: dead time or R of all phases
    double size;
    enum dqw_fault_name name;
    double delay_s;  ///< measured, of the monitor in float
} fault;

static inline void set(dqw_sim_scenario *s, const char *key, const char *part, double x)
{
    char path[80];
    char text[40];
    (void)snprintf(path, sizeof path, "%s%s", key, part);
    (void)snprintf(text, sizeof text, "%.9g", x);
    TEST_ASSERT_EQUAL_INT_MESSAGE(DQW_SIM_OK, dqw_sim_set(s, path, text), path);
}

static const fault faults[] = {
    {"demagnetisation", "nonideal.demagnetisation", 0.03, DQW_FAULT_DEMAGNETISATION, 1.0},
    {"turn short", "nonideal.turn_short", 0.03, DQW_FAULT_TURN_SHORT, 0.77},
    {"phase connection", "nonideal.phase_connection_ohm", 0.05, DQW_FAULT_PHASE_CONNECTION, 0.77},
    {"current offset", "nonideal.current_offset_alpha_A", 0.2, DQW_FAULT_CURRENT_OFFSET, 0.95},
    {"current gain", "nonideal.current_gain_a", 0.1, DQW_FAULT_CURRENT_GAIN, 0.9},
    {"encoder offset", "nonideal.angle_offset_rad", 0.05, DQW_FAULT_ENCODER_OFFSET, 1.2},
    {"inverter", NULL, 0.48, DQW_FAULT_INVERTER_FAULT, 0.75},
    {"R of all phases", NULL, 0.1, DQW_FAULT_RESISTANCE_RISE, 1.2}};
enum { FAULTS = sizeof faults / sizeof faults[0] };

// Its rows. Returns the row of a joint between two logs, 0 where there is none.
static inline int simulate_fault(const fault *f)
{
    dqw_sim_scenario s = joint(LOG_S);
    int joined = 0;
    if (f->name == DQW_FAULT_INVERTER_FAULT) {
        // A ramp starts at zero: two logs of the same references are joined.
        s.nonideal.dead_time_V.value = DEAD_TIME_V;
        static dqw_sim_row before[ROWS];
        s.duration_s = ONSET_S;
        simulate(&s);
        memcpy(before, rows, sizeof rows);
        joined = row_count;
        s.nonideal.dead_time_V.value = f->size;
        s.duration_s = LOG_S;
        simulate(&s);
        memcpy(rows, before, (size_t)joined * sizeof rows[0]);
    } else if (f->key == NULL) {
        // One kelvin above the reference, so that alpha is the part by which R grows.
        s.machine.temp_start_C = s.machine.temp_ref_C + 1;
        s.nonideal.winding_alpha_per_K = (dqw_sim_ramp){f->size, ONSET_S, ONSET_S + GROWS_S};
        simulate(&s);
    } else {
        set(&s, f->key, ".t_end_s", ONSET_S + GROWS_S);
        set(&s, f->key, ".t_start_s", ONSET_S);
        set(&s, f->key, "", f->size);
        simulate(&s);
    }
    return joined;
}

#endif
