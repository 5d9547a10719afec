// The simulated drive against closed forms.
#include <complex.h>
#include <math.h>
#include <stdlib.h>

#include "dqw_sim.h"
#include "unity.h"

static dqw_sim_row *rows;
static size_t count;

void setUp(void) { rows = NULL; }
void tearDown(void) { free(rows); }

static void simulate(const dqw_sim_scenario *s)
{
    dqw_sim_report report;
    count = dqw_sim_rows(s);
    rows = calloc(count ? count : 1, sizeof *rows);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, dqw_sim_run(s, rows, count, &report, NULL, NULL), report.message);
}

// The servo with its rotor held at zero angle, or at a constant speed, and constant voltages from the start.
static dqw_sim_scenario voltage_step(double v_d_V, double v_q_V, double speed_rad_s)
{
    dqw_sim_scenario s = *dqw_sim_scenario_find("servo_ideal");
    s.profile = (dqw_sim_profile){.control = DQW_SIM_CONTROL_VOLTAGE, .shaft = DQW_SIM_SHAFT_IMPOSED};
    s.profile.speed_rad_s.value = speed_rad_s;
    s.profile.v_d_V.value = v_d_V, s.profile.v_q_V.value = v_q_V;
    s.duration_s = 0.02;
    s.rtol = 1e-11;
    return s;
}

// Locked rotor, no back-EMF: each axis is R and L alone. Measured: 8e-10 A of 11 A.
static void test_step_of_voltage_on_a_locked_rotor_is_an_rl_step(void)
{
    const dqw_sim_scenario s = voltage_step(10, 7, 0);
    simulate(&s);
    const dqw_sim_machine *m = &s.machine;
    for (size_t k = 0; k < count; ++k) {
        const double t = rows[k].t_s, i_d = 10 / m->R_ohm * -expm1(-m->R_ohm / m->Ld_H * t);
        const double i_q = 7 / m->R_ohm * -expm1(-m->R_ohm / m->Lq_H * t);
        TEST_ASSERT_DOUBLE_WITHIN(1e-8, i_d, rows[k].i_d_A);
        TEST_ASSERT_DOUBLE_WITHIN(1e-8, i_q, rows[k].i_q_A);
        TEST_ASSERT_DOUBLE_WITHIN(1e-8, 1.5 * m->pole_pairs * (m->psi_Wb + (m->Ld_H - m->Lq_H) * i_d) * i_q,
                                  rows[k].torque_Nm);
        TEST_ASSERT_EQUAL_DOUBLE(0, rows[k].theta_e_rad);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, 10, rows[k].v_d_V);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, 7, rows[k].v_q_V);
    }
}

// Constant speed, constant dq voltage, L_d = L_q: i = (v - j w psi) / (R + j w L) (1 - exp(-(R/L + j w) t)). Measured:
// 5e-9 A.
static void test_step_of_voltage_at_speed_is_a_complex_exponential(void)
{
    dqw_sim_scenario s = voltage_step(-20, 60, 100);
    s.machine.Lq_H = s.machine.Ld_H;
    s.drive.hold = DQW_SIM_HOLD_DQ;
    simulate(&s);
    const double R = s.machine.R_ohm, L = s.machine.Ld_H, w = 100 * s.machine.pole_pairs;
    for (size_t k = 0; k < count; ++k) {
        const double complex i = (-20 + 60 * I - I * w * s.machine.psi_Wb) / (R + I * w * L) *
                                 (1 - cexp(-(R / L + I * w) * rows[k].t_s));
        TEST_ASSERT_DOUBLE_WITHIN(3e-8, creal(i), rows[k].i_d_A);
        TEST_ASSERT_DOUBLE_WITHIN(3e-8, cimag(i), rows[k].i_q_A);
    }
}

static dqw_sim_scenario free_shaft(double v_q_V, double B_Nms_rad)
{
    dqw_sim_scenario s = voltage_step(0, v_q_V, 0);
    s.profile.shaft = DQW_SIM_SHAFT_FREE;
    s.drive.hold = DQW_SIM_HOLD_DQ;
    s.machine.J_kgm2 = 2e-4, s.machine.B_Nms_rad = B_Nms_rad;
    s.duration_s = 0.6;
    return s;
}

// Without friction the motor runs up until its back-EMF is the voltage: w_m = v_q / (p psi). Measured: 1e-9 of it.
static void test_no_load_speed(void)
{
    const dqw_sim_scenario s = free_shaft(60, 0);
    simulate(&s);
    const dqw_sim_row *end = &rows[count - 1];
    TEST_ASSERT_DOUBLE_WITHIN(1.25e-6, 125, end->w_m_rad_s);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0, end->i_q_A);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0, end->torque_Nm);
}

// With friction: v_q = R i_q + w_e (L_d i_d + psi), 0 = R i_d - w_e L_q i_q, torque = B w.
static void test_steady_state_of_voltage_and_torque(void)
{
    const dqw_sim_scenario s = free_shaft(60, 0.05);
    simulate(&s);
    const dqw_sim_machine *m = &s.machine;
    const dqw_sim_row *end = &rows[count - 1];
    const double w_e = m->pole_pairs * end->w_m_rad_s;
    TEST_ASSERT_TRUE(end->i_q_A > 1 && end->i_d_A > 1);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 60, m->R_ohm * end->i_q_A + w_e * (m->Ld_H * end->i_d_A + m->psi_Wb));
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0, m->R_ohm * end->i_d_A - w_e * m->Lq_H * end->i_q_A);
    TEST_ASSERT_DOUBLE_WITHIN(1e-8, m->B_Nms_rad * end->w_m_rad_s, end->torque_Nm);
}

// The speed loop settles on its reference and carries load and all friction. Measured: 4e-9 rad/s, 2e-9 Nm.
static void test_speed_loop_settles_and_torque_carries_load_and_friction(void)
{
    dqw_sim_scenario s = *dqw_sim_scenario_find("servo_ideal");
    s.profile = (dqw_sim_profile){.speed_rad_s = {.value = 50, .step = 50, .t_step_s = 0.1},
                                  .load_Nm = {.step = 2, .t_step_s = 0.3}};
    s.machine.coulomb_Nm = 0.2, s.machine.coulomb_width_rad_s = 1;
    s.drive.hold = DQW_SIM_HOLD_DQ;  // no ripple at the sampling instants
    s.duration_s = 1.5;
    simulate(&s);
    const dqw_sim_row *end = &rows[count - 1];
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 100, end->w_m_rad_s);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 2 + 0.2 + 100 * s.machine.B_Nms_rad, end->torque_Nm);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0, end->i_d_A);
}

// A demand beyond the inverter: the commanded vector stays within v_dc / sqrt(3), the current reference within i_max,
// and the integrators do not wind up: the overshoot stays below the 13.5 % of the same loop without limits. Measured:
// 35 rad/s of 300, and the current a twentieth above its limit.
static void test_limits_and_anti_windup(void)
{
    dqw_sim_scenario s = *dqw_sim_scenario_find("servo_ideal");
    s.profile = (dqw_sim_profile){.speed_rad_s = {.value = 150, .step = -300, .t_step_s = 0.5}};
    s.duration_s = 1;
    simulate(&s);
    double most_V = 0, most_A = 0, overshoot = 0;
    for (size_t k = 0; k < count; ++k) {
        most_V = fmax(most_V, hypot(rows[k].v_d_V, rows[k].v_q_V));
        most_A = fmax(most_A, hypot(rows[k].i_d_A, rows[k].i_q_A));
        if (rows[k].t_s > 0.5) overshoot = fmax(overshoot, -150 - rows[k].w_m_rad_s);
    }
    TEST_ASSERT_TRUE(most_V <= 320 / sqrt(3) * (1 + 1e-12));
    TEST_ASSERT_DOUBLE_WITHIN(0.75, 15.75, most_A);
    TEST_ASSERT_DOUBLE_WITHIN(5.5, 35, overshoot);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, -150, rows[count - 1].w_m_rad_s);
}

static void test_voltage_and_current_are_limited(void)
{
    dqw_sim_scenario s = voltage_step(-300, 400, 0);
    s.drive.hold = DQW_SIM_HOLD_DQ;
    simulate(&s);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, -0.6 * 320 / sqrt(3), rows[5].v_d_V);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.8 * 320 / sqrt(3), rows[5].v_q_V);
    // The d current goes first, the q current takes what is left of 15 A.
    s.profile = (dqw_sim_profile){.control = DQW_SIM_CONTROL_CURRENT,
                                  .shaft = DQW_SIM_SHAFT_IMPOSED,
                                  .i_d_A = {.value = -9},
                                  .i_q_A = {.value = 40}};
    s.duration_s = 0.1;
    free(rows);
    simulate(&s);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, -9, rows[count - 1].i_d_A);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 12, rows[count - 1].i_q_A);
}

// An imposed speed is there at every sample, and the angle is its integral: 60 rad/s sin(2 pi t / T).
static void test_imposed_speed(void)
{
    dqw_sim_scenario s = voltage_step(0, 0, 0);
    s.profile.speed_rad_s = (dqw_sim_signal){.wave = 60, .wave_period_s = 0.05};
    simulate(&s);
    for (size_t k = 0; k < count; ++k) {
        const double t = rows[k].t_s, turn = 60 * 0.05 / 6.283185307179586 * (1 - cos(6.283185307179586 * t / 0.05));
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, 60 * sin(6.283185307179586 * t / 0.05), rows[k].w_m_rad_s);
        // The slope is a polygon: its area falls short by (2 pi dt / T)^2 / 12 of the angle.
        TEST_ASSERT_DOUBLE_WITHIN(2e-5, 0, remainder(rows[k].theta_m_rad - turn, 6.283185307179586));
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_step_of_voltage_on_a_locked_rotor_is_an_rl_step);
    RUN_TEST(test_step_of_voltage_at_speed_is_a_complex_exponential);
    RUN_TEST(test_no_load_speed);
    RUN_TEST(test_steady_state_of_voltage_and_torque);
    RUN_TEST(test_speed_loop_settles_and_torque_carries_load_and_friction);
    RUN_TEST(test_limits_and_anti_windup);
    RUN_TEST(test_voltage_and_current_are_limited);
    RUN_TEST(test_imposed_speed);
    return UNITY_END();
}
