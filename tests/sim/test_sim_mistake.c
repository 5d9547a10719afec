// Sensors that are wrong: what the log says beside what is true, and what the control loops make of it.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "dqw_sim.h"
#include "sim_log.h"
#include "unity.h"

static dqw_sim_row *truth, *rows;

void setUp(void) { truth = rows = NULL; }
void tearDown(void) { free(truth), free(rows); }

// Voltages only: no loop reacts, so that truth is the same run without the mistake.
static dqw_sim_scenario open_loop(void)
{
    dqw_sim_scenario s = *dqw_sim_scenario_find("servo_ideal");
    s.profile = (dqw_sim_profile){.control = DQW_SIM_CONTROL_VOLTAGE,
                                  .shaft = DQW_SIM_SHAFT_IMPOSED,
                                  .speed_rad_s = {.value = 60, .wave = 30, .wave_period_s = 0.05}};
    s.profile.v_q_V.value = 30, s.profile.v_d_V.random = s.profile.v_q_V.random = 20;
    s.profile.v_d_V.random_hold_s = 2e-3, s.profile.v_q_V.random_hold_s = 3e-3;
    s.duration_s = 0.1;
    return s;
}

// A phase current lies along its phase's axis: 2/3 of the sum of three turned phases, in the frame of the angle that
// the row says.
static void dq_of_phases(const double phase[3], double theta, double *d, double *q)
{
    *d = *q = 0;
    for (int x = 0; x < 3; ++x) {
        *d += 2.0 / 3 * phase[x] * cos(theta - x * 2.0943951023931955);
        *q -= 2.0 / 3 * phase[x] * sin(theta - x * 2.0943951023931955);
    }
}
static void phases_of_row(const dqw_sim_row *row, double phase[3])
{
    for (int x = 0; x < 3; ++x) {
        const double angle = row->theta_e_rad - x * 2.0943951023931955;
        phase[x] = row->i_d_A * cos(angle) - row->i_q_A * sin(angle);
    }
}

static void test_gains_and_offsets_of_the_phase_sensors(void)
{
    dqw_sim_scenario s = open_loop();
    truth = simulate(&s);
    s.nonideal.current_gain_a.value = 0.03, s.nonideal.current_gain_b.value = -0.02,
    s.nonideal.current_gain_c.value = 0.01;
    s.nonideal.current_offset_alpha_A = (dqw_sim_ramp){0.2, 0.02, 0.06}, s.nonideal.current_offset_beta_A.value = -0.1;
    rows = simulate(&s);
    for (size_t k = 0; k < count; ++k) {
        double phase[3], d, q;
        phases_of_row(&truth[k], phase);
        // An offset of alpha, beta as offsets of phases without a common part.
        const double alpha = 0.2 * fmin(fmax((truth[k].t_s - 0.02) / 0.04, 0), 1), beta = -0.1;
        phase[0] = 1.03 * phase[0] + alpha;
        phase[1] = 0.98 * phase[1] - alpha / 2 + beta * sqrt(0.75);
        phase[2] = 1.01 * phase[2] - alpha / 2 - beta * sqrt(0.75);
        dq_of_phases(phase, truth[k].theta_e_rad, &d, &q);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, d, rows[k].i_d_A);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, q, rows[k].i_q_A);
        TEST_ASSERT_TRUE(rows[k].v_d_V == truth[k].v_d_V && rows[k].theta_e_rad == truth[k].theta_e_rad);
    }
}

// The loops hold what the sensors say: the log shows the reference, the voltage what truly flows.
static void test_loops_believe_the_sensors(void)
{
    dqw_sim_scenario s = settled(3, -2, 0);
    s.nonideal.current_offset_alpha_A.value = 0.5, s.nonideal.current_offset_beta_A.value = 0.25;
    rows = simulate(&s);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 3, rows[count - 1].i_d_A);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, -2, rows[count - 1].i_q_A);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.9 * 2.5, rows[count - 1].v_d_V);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.9 * -2.25, rows[count - 1].v_q_V);
    free(rows);
    s = settled(3, 0, 0);
    s.nonideal.current_gain_a.value = 0.06;
    rows = simulate(&s);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.9 * 3 / 1.04, rows[count - 1].v_d_V);
}

// Settled in a frame that is delta ahead: true currents are the believed ones turned back, and so is what the log says
// of the voltage.
static void test_wrong_angle_turns_currents_and_voltages(void)
{
    const double delta = 0.1, c = cos(delta), sn = sin(delta);
    dqw_sim_scenario s = settled(-2, 5, 100);
    s.nonideal.angle_offset_rad.value = delta;
    rows = simulate(&s);
    const double i_d = c * -2 - sn * 5, i_q = sn * -2 + c * 5;
    const double v_d = 0.9 * i_d - 400 * 2.8e-3 * i_q, v_q = 0.9 * i_q + 400 * (2.2e-3 * i_d + 0.12);
    const dqw_sim_row *end = &rows[count - 1];
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, -2, end->i_d_A);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 5, end->i_q_A);
    TEST_ASSERT_DOUBLE_WITHIN(1e-5, c * v_d + sn * v_q, end->v_d_V);
    TEST_ASSERT_DOUBLE_WITHIN(1e-5, c * v_q - sn * v_d, end->v_q_V);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0, remainder(end->theta_e_rad - 400 * end->t_s - delta, 6.283185307179586));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0, remainder(4 * end->theta_m_rad - end->theta_e_rad, 6.283185307179586));
}

// Aiming delta ahead is commanding a turned voltage with the right angle, in whichever frame it is held.
static void test_wrong_angle_is_a_turned_command(void)
{
    const double delta = -0.2, c = cos(delta), sn = sin(delta);
    for (int hold = DQW_SIM_HOLD_ABC; hold <= DQW_SIM_HOLD_DQ; ++hold) {
        free(truth), free(rows);
        dqw_sim_scenario s = open_loop();
        s.drive.hold = hold == DQW_SIM_HOLD_ABC ? DQW_SIM_HOLD_ABC : DQW_SIM_HOLD_DQ;
        s.profile.v_d_V = (dqw_sim_signal){.value = c * 5 - sn * 30},
        s.profile.v_q_V = (dqw_sim_signal){.value = sn * 5 + c * 30};
        truth = simulate(&s);
        s.profile.v_d_V.value = 5, s.profile.v_q_V.value = 30, s.nonideal.angle_offset_rad.value = delta;
        rows = simulate(&s);
        for (size_t k = 0; k < count; ++k) {
            TEST_ASSERT_DOUBLE_WITHIN(1e-6, c * truth[k].i_d_A + sn * truth[k].i_q_A, rows[k].i_d_A);
            TEST_ASSERT_DOUBLE_WITHIN(1e-6, c * truth[k].i_q_A - sn * truth[k].i_d_A, rows[k].i_q_A);
            TEST_ASSERT_DOUBLE_WITHIN(1e-6, c * truth[k].v_d_V + sn * truth[k].v_q_V, rows[k].v_d_V);
            TEST_ASSERT_DOUBLE_WITHIN(1e-6, c * truth[k].v_q_V - sn * truth[k].v_d_V, rows[k].v_q_V);
        }
    }
}

static void test_voltage_offset_is_in_the_log_alone(void)
{
    dqw_sim_scenario s = *dqw_sim_scenario_find("servo_ideal");
    s.duration_s = 0.05;
    truth = simulate(&s);
    s.nonideal.voltage_offset_d_V.value = 0.7, s.nonideal.voltage_offset_q_V.value = -0.4;
    rows = simulate(&s);
    for (size_t k = 0; k < count; ++k) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.7, rows[k].v_d_V - truth[k].v_d_V);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, -0.4, rows[k].v_q_V - truth[k].v_q_V);
        rows[k].v_d_V = truth[k].v_d_V, rows[k].v_q_V = truth[k].v_q_V;
    }
    TEST_ASSERT_EQUAL_MEMORY(truth, rows, count * sizeof *rows);
}

// Clipping and hum: the loops do not see them.
static void test_clipped_and_humming_sensors(void)
{
    dqw_sim_scenario s = *dqw_sim_scenario_find("servo_ideal");
    s.duration_s = 0.1;
    truth = simulate(&s);
    s.nonideal.clip_A = 2.5, s.nonideal.hum_A.value = 0.3, s.nonideal.hum_Hz = 50;
    rows = simulate(&s);
    size_t clipped = 0;
    for (size_t k = 0; k < count; ++k) {
        double phase[3], d, q;
        phases_of_row(&truth[k], phase);
        const double hum = 0.3 * sin(314.15926535897932 * truth[k].t_s);
        // A star's Clarke sees phase a's hum without its third in common.
        const double share[3] = {2.0 / 3, -1.0 / 3, -1.0 / 3};
        for (int x = 0; x < 3; ++x) {
            phase[x] += share[x] * hum;
            clipped += fabs(phase[x]) > 2.5;
            phase[x] = fmax(-2.5, fmin(2.5, phase[x]));
        }
        dq_of_phases(phase, truth[k].theta_e_rad, &d, &q);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, d, rows[k].i_d_A);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, q, rows[k].i_q_A);
        TEST_ASSERT_TRUE(rows[k].v_d_V == truth[k].v_d_V && rows[k].w_m_rad_s == truth[k].w_m_rad_s);
    }
    TEST_ASSERT_TRUE(clipped > count / 20 && clipped < 2 * count);
}

// 2000 rows, a tenth dropped: 200, and four times its deviation of 13.4.
static void test_dropped_rows_repeat_the_last_currents(void)
{
    dqw_sim_scenario s = *dqw_sim_scenario_find("servo");
    s.duration_s = 0.2;
    truth = simulate(&s);
    s.nonideal.dropped_fraction = 0.1;
    rows = simulate(&s);
    int dropped = 0;
    for (size_t k = 0; k < count; ++k) {
        const bool own = rows[k].i_d_A == truth[k].i_d_A && rows[k].i_q_A == truth[k].i_q_A;
        TEST_ASSERT_TRUE(own || (k && rows[k].i_d_A == rows[k - 1].i_d_A && rows[k].i_q_A == rows[k - 1].i_q_A));
        TEST_ASSERT_TRUE(rows[k].v_d_V == truth[k].v_d_V && rows[k].w_m_rad_s == truth[k].w_m_rad_s);
        dropped += !own;
    }
    TEST_ASSERT_INT_WITHIN(54, 200, dropped);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_gains_and_offsets_of_the_phase_sensors);
    RUN_TEST(test_loops_believe_the_sensors);
    RUN_TEST(test_wrong_angle_turns_currents_and_voltages);
    RUN_TEST(test_wrong_angle_is_a_turned_command);
    RUN_TEST(test_voltage_offset_is_in_the_log_alone);
    RUN_TEST(test_clipped_and_humming_sensors);
    RUN_TEST(test_dropped_rows_repeat_the_last_currents);
    return UNITY_END();
}
