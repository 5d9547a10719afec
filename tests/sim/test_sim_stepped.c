// A run that its caller steps: the same voltages give the same rows as a run in one piece; a winding answers as it
// must.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "dqw_sim.h"
#include "unity.h"

enum { ROWS = 300 };
static char why[400];

void setUp(void) { why[0] = 0; }
void tearDown(void) {}

static dqw_sim_scenario resting(void)
{
    dqw_sim_scenario s = *dqw_sim_scenario_find("drive_compensated");
    const dqw_sim_signal none = {.value = 0};
    s.profile.control = DQW_SIM_CONTROL_VOLTAGE;
    s.profile.shaft = DQW_SIM_SHAFT_IMPOSED;
    s.profile.speed_rad_s = s.profile.v_d_V = s.profile.v_q_V = none;
    s.profile.speed_rad_s.value = 40;
    s.duration_s = ROWS * s.drive.dt_s;
    return s;
}

static void test_stepped_is_as_run(void)
{
    double v_d[ROWS], v_q[ROWS];
    for (int k = 0; k < ROWS; ++k) v_d[k] = 6 * sin(0.37 * k), v_q[k] = 20 + 8 * cos(0.23 * k);
    dqw_sim_scenario s = resting();
    s.profile.v_d_V.table = v_d, s.profile.v_q_V.table = v_q;
    s.profile.v_d_V.table_rows = s.profile.v_q_V.table_rows = ROWS;
    s.profile.v_d_V.table_dt_s = s.profile.v_q_V.table_dt_s = s.drive.dt_s;
    static dqw_sim_row whole[ROWS], stepped[ROWS];
    TEST_ASSERT_EQUAL_INT(ROWS, dqw_sim_rows(&s));
    TEST_ASSERT_EQUAL_INT(DQW_SIM_OK, dqw_sim_run(&s, whole, ROWS, NULL, NULL, NULL));

    const dqw_sim_scenario still = resting();
    dqw_sim_stepper *x;
    dqw_sim_row seen;
    TEST_ASSERT_EQUAL_INT_MESSAGE(DQW_SIM_OK, dqw_sim_open(&still, &x, &seen, why, sizeof why), why);
    for (int k = 0; k < ROWS; ++k) {
        const dqw_sim_decision d = {v_d[k], v_q[k], 0, 0};
        TEST_ASSERT_EQUAL_INT_MESSAGE(DQW_SIM_OK, dqw_sim_step(x, &d, &seen, &stepped[k], why, sizeof why), why);
    }
    dqw_sim_log_of(x, stepped, ROWS);
    dqw_sim_close(x);
    TEST_ASSERT_EQUAL_MEMORY(whole, stepped, sizeof whole);
}

// i = V/R (1 - exp(-t R/L)) in a winding at rest.
static void test_a_winding_at_rest(void)
{
    dqw_sim_scenario s = *dqw_sim_scenario_find("servo_ideal");
    const dqw_sim_signal none = {.value = 0};
    s.profile.control = DQW_SIM_CONTROL_VOLTAGE;
    s.profile.shaft = DQW_SIM_SHAFT_IMPOSED;
    s.profile.speed_rad_s = s.profile.v_d_V = s.profile.v_q_V = none;
    dqw_sim_stepper *x;
    dqw_sim_row seen, logged;
    TEST_ASSERT_EQUAL_INT_MESSAGE(DQW_SIM_OK, dqw_sim_open(&s, &x, &seen, why, sizeof why), why);
    const dqw_sim_decision d = {3, 0, 0, 0};
    for (int k = 0; k < ROWS; ++k) {
        TEST_ASSERT_EQUAL_INT_MESSAGE(DQW_SIM_OK, dqw_sim_step(x, &d, &seen, &logged, why, sizeof why), why);
        const double expected = 3 / s.machine.R_ohm * (1 - exp(-seen.t_s * s.machine.R_ohm / s.machine.Ld_H));
        TEST_ASSERT_DOUBLE_WITHIN(1e-5, expected, seen.i_d_A);
    }
    dqw_sim_close(x);
}

static void test_what_is_refused(void)
{
    dqw_sim_stepper *x = NULL;
    dqw_sim_row seen, logged;
    dqw_sim_scenario s = resting();
    s.drive.log_every = 2;
    TEST_ASSERT_EQUAL_INT(DQW_SIM_ERR_SCENARIO, dqw_sim_open(&s, &x, &seen, why, sizeof why));
    TEST_ASSERT_NULL(x);
    TEST_ASSERT_NOT_NULL(strstr(why, "log_every"));
    s = resting();
    strcpy(s.machine.flux_map, "/nowhere/map.csv");
    TEST_ASSERT_EQUAL_INT(DQW_SIM_ERR_MAP, dqw_sim_open(&s, &x, &seen, why, sizeof why));
    TEST_ASSERT_EQUAL_INT(DQW_SIM_ERR_SCENARIO, dqw_sim_open(NULL, &x, &seen, why, sizeof why));
    s = resting();
    TEST_ASSERT_EQUAL_INT_MESSAGE(DQW_SIM_OK, dqw_sim_open(&s, &x, &seen, why, sizeof why), why);
    const dqw_sim_decision bad = {NAN, 0, 0, 0}, good = {1, 0, 0, 0};
    TEST_ASSERT_EQUAL_INT(DQW_SIM_ERR_VALUE, dqw_sim_step(x, &bad, &seen, &logged, why, sizeof why));
    TEST_ASSERT_EQUAL_INT_MESSAGE(DQW_SIM_OK, dqw_sim_step(x, &good, &seen, &logged, why, sizeof why), why);
    TEST_ASSERT_EQUAL_DOUBLE(0, logged.t_s);
    dqw_sim_close(x);
    dqw_sim_close(NULL);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_stepped_is_as_run);
    RUN_TEST(test_a_winding_at_rest);
    RUN_TEST(test_what_is_refused);
    return UNITY_END();
}
