// Each non-ideality and fault against its own law, computed here another way.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "dqw_sim.h"
#include "sim_log.h"
#include "sim_flux.h"
#include "sim_keys.h"
#include "sim_signal.h"
#include "unity.h"

static dqw_sim_row *rows;

void setUp(void) { rows = NULL; }
void tearDown(void) { free(rows); }

static const dqw_sim_row *end_of(const dqw_sim_scenario *s)
{
    free(rows);
    rows = simulate(s);
    return &rows[count - 1];
}

static void test_ramp_is_zero_then_straight_then_flat(void)
{
    const dqw_sim_ramp ramp = {8, 1, 3}, step = {8, 1, 1}, always = {.value = 8};
    const double t[] = {0, 0.999, 1, 1.5, 2, 3, 99}, wanted[] = {0, 0, 0, 2, 4, 8, 8};
    for (int k = 0; k < 7; ++k) TEST_ASSERT_EQUAL_DOUBLE(wanted[k], dqw_sim_ramp_at(&ramp, t[k]));
    TEST_ASSERT_EQUAL_DOUBLE(0, dqw_sim_ramp_at(&step, 0.999));
    TEST_ASSERT_EQUAL_DOUBLE(8, dqw_sim_ramp_at(&step, 1));
    TEST_ASSERT_EQUAL_DOUBLE(8, dqw_sim_ramp_at(&always, 0));
}

// Every non-ideality set, but not before the run ends: bit for bit the ideal drive.
static void test_what_has_not_begun_changes_nothing(void)
{
    dqw_sim_scenario s = *dqw_sim_scenario_find("servo_ideal");
    s.duration_s = 0.05;
    s.machine.coulomb_Nm = 0.1, s.machine.coulomb_width_rad_s = 1;  // what is unlike by direction is of this
    end_of(&s);
    dqw_sim_row *ideal = rows;
    rows = NULL;
    const dqw_sim_ramp later = {0.1, 1, 2};
    for (size_t k = 0; k < dqw_sim_field_count(); ++k) {
        const dqw_sim_field *f = dqw_sim_field_at(k);
        if (f->kind == DQW_SIM_FIELD_RAMP) memcpy((char *)&s + f->offset, &later, sizeof later);
    }
    dqw_sim_nonideal *x = &s.nonideal;
    // Excludes turn_short.
    x->phase_resistance_b_ohm.value = 0;
    x->dead_time_width_A = 1, x->turn_short_ohm = 1, x->cogging_order = 6, x->stribeck_width_rad_s = 1,
    x->disturbance_Hz = x->hum_Hz = 50, x->iron_hysteresis_corner_rad_s = 100;
    end_of(&s);
    const int same = memcmp(ideal, rows, count * sizeof *rows);
    free(ideal);
    TEST_ASSERT_EQUAL_INT(0, same);
}

// Current along phase a: i in a, -i/2 in b and c; the drop's alpha component adds to what the drive commands.
static double dead_time_drop(double V, double width, double i)
{
    return 2.0 / 3 * V * (tanh(i / width) + tanh(i / (2 * width)));
}

static void test_dead_time_takes_its_voltage_from_each_phase(void)
{
    dqw_sim_scenario s = settled(3, 0, 0);
    s.nonideal.dead_time_V = (dqw_sim_ramp){4, 0, 0};
    s.nonideal.dead_time_width_A = 0.8;
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 3 * 0.9 + dead_time_drop(4, 0.8, 3), end_of(&s)->v_d_V);
    // Along beta: nothing in a, opposite in b and c.
    s.profile.i_d_A.value = 0, s.profile.i_q_A.value = -3;
    const dqw_sim_row *end = end_of(&s);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, -3 * 0.9 - 2 / sqrt(3) * 4 * tanh(3 * sqrt(0.75) / 0.8), end->v_q_V);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0, end->v_d_V);
    // Half way up its ramp.
    s = settled(3, 0, 0);
    s.nonideal.dead_time_V = (dqw_sim_ramp){4, 0.1 - 1e-4 + 0.5e-4 - 10, 0.1 - 1e-4 + 0.5e-4 + 10};
    s.nonideal.dead_time_width_A = 0.8;
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 3 * 0.9 + dead_time_drop(2, 0.8, 3), end_of(&s)->v_d_V);
}

static void test_temperatures_change_resistance_and_magnet(void)
{
    dqw_sim_scenario s = settled(2, 0, 0);
    s.machine.temp_start_C = 105;
    s.nonideal.winding_alpha_per_K.value = 0.004;
    const dqw_sim_row *end = end_of(&s);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 2 * 0.9 * 1.32, end->v_d_V);
    TEST_ASSERT_EQUAL_DOUBLE(105, end->temp_winding_C);
    s = settled(0, 0, 100);
    s.machine.temp_start_C = 105;
    s.nonideal.magnet_beta_per_K.value = -0.001;
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 400 * 0.12 * 0.92, end_of(&s)->v_q_V);
    // Winding and magnet apart: each follows its own temperature.
    s = settled(2, 0, 0);
    s.machine.winding_heat_J_K = 20, s.machine.magnet_heat_J_K = 1e6, s.machine.winding_ambient_W_K = 1;
    s.machine.temp_start_C = 105, s.duration_s = 1;
    s.nonideal.winding_alpha_per_K.value = 0.004;
    end = end_of(&s);
    TEST_ASSERT_TRUE(end->temp_winding_C < 102.5 && end->temp_magnet_C > 104.9);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 2 * 0.9 * (1 + 0.004 * (end->temp_winding_C - 25)), end->v_d_V);
}

// Constant current, constant resistance: C dT/dt = P - G (T - T_ambient) has a closed form. Measured: 2e-6 K.
static void test_winding_heats_by_its_closed_form(void)
{
    dqw_sim_scenario s = settled(8, 0, 0);
    s.machine.winding_heat_J_K = 50, s.machine.magnet_heat_J_K = 100, s.machine.winding_ambient_W_K = 1,
    s.machine.temp_ambient_C = 20;
    s.profile.control = DQW_SIM_CONTROL_VOLTAGE, s.profile.i_d_A.value = 0, s.profile.v_d_V.value = 7.2;
    s.drive.dt_s = 0.05, s.duration_s = 100, s.method = DQW_SIM_BDF;
    end_of(&s);
    const double power = 1.5 * 0.9 * 64;
    for (size_t k = 0; k < count; ++k) {
        // The current's own rise, tau = L/R, costs (3/2) tau of full heating.
        const double t = rows[k].t_s - (k ? 1.5 * 2.2e-3 / 0.9 : 0);
        TEST_ASSERT_DOUBLE_WITHIN(1e-4,
                                  20 + power + (25 - 20 - power) * exp(-t / 50) -
                                      (k ? 5 * (exp(-rows[k].t_s / 50) - exp(-t / 50)) * -1 : 0),
                                  rows[k].temp_winding_C);
        TEST_ASSERT_EQUAL_DOUBLE(25, rows[0].temp_magnet_C);
    }
}

// Two linear equations in the magnetising current, solved here: v = R i + e, i = i_m + G e, e = j w psi(i_m).
static void test_iron_loss_is_a_resistance_across_the_induced_voltage(void)
{
    dqw_sim_scenario s = settled(0, 0, 150);
    s.profile.control = DQW_SIM_CONTROL_VOLTAGE;
    s.profile.v_d_V.value = -8, s.profile.v_q_V.value = 75;
    s.nonideal.iron_loss_S.value = 1.0 / 80;
    const double R = 0.9, G = 1.0 / 80, w = 600, Ld = 2.2e-3, Lq = 2.8e-3, psi = 0.12, g = 1 + R * G;
    // -8 = R m_d - g w Lq m_q,  75 = R m_q + g w (Ld m_d + psi)
    const double det = R * R + g * w * Lq * g * w * Ld, rest = 75 - g * w * psi;
    const double m_d = (-8 * R + g * w * Lq * rest) / det, m_q = (R * rest + 8 * g * w * Ld) / det;
    const dqw_sim_row *end = end_of(&s);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, m_d - G * w * Lq * m_q, end->i_d_A);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, m_q + G * w * (Ld * m_d + psi), end->i_q_A);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 6 * (psi + (Ld - Lq) * m_d) * m_q, end->torque_Nm);
}

// Direct current along phase a: the shorted turns are in parallel with their short, then b and c in parallel.
static void test_turn_short_at_standstill_is_a_resistor_network(void)
{
    dqw_sim_scenario s = settled(0, 0, 0);
    s.profile.control = DQW_SIM_CONTROL_VOLTAGE, s.profile.v_d_V.value = 5, s.profile.v_q_V.value = 3;
    s.nonideal.turn_short.value = 0.2, s.nonideal.turn_short_ohm = 0.1;
    const double R = 0.9, R_a = 0.8 * R + 0.2 * R * 0.1 / (0.2 * R + 0.1);
    const dqw_sim_row *end = end_of(&s);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 5 / (2.0 / 3 * (R_a + R / 2)), end->i_d_A);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 3 / R, end->i_q_A);
}

// While the current rises the coupled turns act as a resistor across phase a: at the first sample after the edge the
// current is already there, before the inductance has let anything through. 1/R_p = (2/3) mu^2 / (r_f + mu R (1 - 2 mu
// / 3)).
static void test_turn_short_conducts_at_once(void)
{
    dqw_sim_scenario s = settled(0, 0, 0);
    s.profile.control = DQW_SIM_CONTROL_VOLTAGE, s.profile.v_d_V.value = 5;
    s.nonideal.turn_short.value = 0.2, s.nonideal.turn_short_ohm = 0.1;
    s.drive.dt_s = 1e-5, s.duration_s = 2e-3, s.rtol = 1e-12;
    end_of(&s);
    const double across = 2.0 / 3 * 0.04 / (0.1 + 0.2 * 0.9 * (1 - 0.4 / 3));
    for (size_t k = 1; k < count; ++k)
        TEST_ASSERT_DOUBLE_WITHIN(1e-7, 5 * across - 5 / 0.9 * expm1(-0.9 / 2.2e-3 * rows[k].t_s), rows[k].i_d_A);
}

static void test_bad_connection_adds_its_resistance_to_phase_a_alone(void)
{
    dqw_sim_scenario s = settled(4, 2, 0);
    s.nonideal.phase_connection_ohm = (dqw_sim_ramp){0.3, 0.01, 0.02};
    const dqw_sim_row *end = end_of(&s);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 4 * (0.9 + 2.0 / 3 * 0.3), end->v_d_V);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 2 * 0.9, end->v_q_V);
}

// A bad connection at speed: its voltage turns against the rotor, a mean and a part at twice the angle.
static void test_bad_connection_at_speed_shows_at_twice_the_angle(void)
{
    dqw_sim_scenario s = settled(0, 0, 50);
    s.profile.control = DQW_SIM_CONTROL_VOLTAGE, s.profile.v_q_V.value = 30;
    s.nonideal.phase_connection_ohm.value = 0.3;
    s.duration_s = 0.3;
    end_of(&s);
    // The last two turns: second harmonic of i_q in the electrical angle, against everything else.
    double c = 0, sn = 0, mean = 0, square = 0, n = 0;
    for (size_t k = count - 628; k < count; ++k, n += 1) mean += rows[k].i_q_A;
    mean /= n;
    for (size_t k = count - 628; k < count; ++k) {
        const double x = rows[k].i_q_A - mean;
        c += 2 * x * cos(2 * rows[k].theta_e_rad) / n, sn += 2 * x * sin(2 * rows[k].theta_e_rad) / n,
            square += x * x / n;
    }
    TEST_ASSERT_TRUE(square > 1e-4);
    TEST_ASSERT_DOUBLE_WITHIN(0.02 * square, square, 0.5 * (c * c + sn * sn));
}

static void test_demagnetisation_takes_its_share_of_the_flux(void)
{
    dqw_sim_scenario s = settled(0, 0, 100);
    s.nonideal.demagnetisation = (dqw_sim_ramp){0.2, 0.01, 0.03};
    end_of(&s);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 400 * 0.12, rows[90].v_q_V);
    // On the ramp the falling flux induces 0.12 * 0.2 / 0.02 s = 1.2 V on the d axis, and the loops lag by some ms.
    TEST_ASSERT_DOUBLE_WITHIN(0.5, 400 * 0.12 * 0.9, rows[200].v_q_V);
    TEST_ASSERT_DOUBLE_WITHIN(1e-5, 400 * 0.12 * 0.8, rows[count - 1].v_q_V);
}

// Coasting: Coulomb friction far above its width falls straight, viscous friction exponentially.
static void test_bearing_wear_brakes(void)
{
    dqw_sim_scenario s = *dqw_sim_scenario_find("servo_ideal");
    s.profile = (dqw_sim_profile){.control = DQW_SIM_CONTROL_CURRENT, .speed_start_rad_s = 100};
    s.drive.hold = DQW_SIM_HOLD_DQ;
    s.duration_s = 0.5;
    s.machine.psi_Wb = 1e-6, s.machine.B_Nms_rad = 0;  // no torque from currents that are a little off zero
    s.machine.coulomb_width_rad_s = 1;
    s.nonideal.bearing_Nm = (dqw_sim_ramp){0.2, 0.1, 0.1};
    const dqw_sim_row *end = end_of(&s);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 100, rows[1000].w_m_rad_s);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 100 - 0.2 / 2e-3 * (end->t_s - 0.1), end->w_m_rad_s);
    s.nonideal.bearing_Nm.value = 0, s.nonideal.bearing_B_Nms_rad.value = 5e-3;
    end = end_of(&s);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, 100 * exp(-2.5 * end->t_s), end->w_m_rad_s);
}

static dqw_sim_flux traction_law(void)
{
    dqw_sim_flux f;
    TEST_ASSERT_TRUE(dqw_sim_flux_init(&f, 0.2e-3, 0.5e-3, 0.07, 4e4, 6e4, 5e4));
    return f;
}

// Currents are the gradient of the energy, by central differences; L at zero current is what the plate says.
static void test_saturation_law_has_one_energy(void)
{
    const dqw_sim_flux f = traction_law();
    const double h = 1e-6;
    for (int j = 0; j < 9; ++j)
        for (int k = 0; k < 8; ++k) {
            const double d = -0.05 + 0.03 * j, q = -0.15 + 0.05 * k;
            double i_d, i_q, up, down, slope, unused;
            TEST_ASSERT_TRUE(dqw_sim_flux_currents(&f, 0.07, d, q, &i_d, &i_q));
            dqw_sim_flux_energy(&f, 0.07, d + h, q, &up, &unused),
                dqw_sim_flux_energy(&f, 0.07, d - h, q, &down, &unused);
            TEST_ASSERT_DOUBLE_WITHIN(1e-5, (up - down) / (2 * h), i_d);
            dqw_sim_flux_energy(&f, 0.07, d, q + h, &up, &unused),
                dqw_sim_flux_energy(&f, 0.07, d, q - h, &down, &unused);
            TEST_ASSERT_DOUBLE_WITHIN(1e-5, (up - down) / (2 * h), i_q);
            dqw_sim_flux_energy(&f, 0.07 + h, d, q, &up, &unused),
                dqw_sim_flux_energy(&f, 0.07 - h, d, q, &down, &unused);
            dqw_sim_flux_energy(&f, 0.07, d, q, &unused, &slope);
            TEST_ASSERT_DOUBLE_WITHIN(1e-5, (up - down) / (2 * h), slope);
        }
    double a, b, c, e;
    dqw_sim_flux_currents(&f, 0.07, 0.07 + h, 0, &a, &b), dqw_sim_flux_currents(&f, 0.07, 0.07 - h, 0, &c, &e);
    TEST_ASSERT_DOUBLE_WITHIN(1e-8, 0.2e-3, 2 * h / (a - c));
    dqw_sim_flux_currents(&f, 0.07, 0.07, h, &a, &b), dqw_sim_flux_currents(&f, 0.07, 0.07, -h, &c, &e);
    TEST_ASSERT_DOUBLE_WITHIN(1e-8, 0.5e-3, 2 * h / (b - e));
    dqw_sim_flux_currents(&f, 0.07, 0.07, 0, &a, &b);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0, hypot(a, b));
}

// The iron of the traction motor does saturate, and negative i_d relieves it.
static void test_saturation_bends_the_curves(void)
{
    const dqw_sim_flux f = traction_law();
    double i_d, i_q, less;
    dqw_sim_flux_currents(&f, 0.07, 0.07, 0.1, &i_d, &i_q);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.1 / 0.5e-3 + 6e4 * 1e-3, i_q);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 5e4 * 0.07 * 0.01, i_d);
    dqw_sim_flux_currents(&f, 0.07, 0.03, 0.1, &i_d, &less);
    TEST_ASSERT_TRUE(less < i_q);
}

static void test_saturation_that_is_not_convex_is_refused(void)
{
    dqw_sim_flux f;
    TEST_ASSERT_FALSE(dqw_sim_flux_init(&f, 0.2e-3, 0.5e-3, 0.07, 4e5, 6e4, 0));
    TEST_ASSERT_FALSE(dqw_sim_flux_init(&f, 0.2e-3, 0.5e-3, 0.07, 0, 0, 1e3));
    TEST_ASSERT_FALSE(dqw_sim_flux_init(&f, 0.2e-3, 0.5e-3, 0.07, -1, 0, 0));
    dqw_sim_scenario s = *dqw_sim_scenario_find("servo_ideal");
    s.nonideal.saturation_dd_A_Wb3 = (dqw_sim_ramp){1e6, 0, 2};
    dqw_sim_report report;
    count = dqw_sim_rows(&s);
    rows = calloc(count, sizeof *rows);
    TEST_ASSERT_EQUAL_INT(DQW_SIM_ERR_SCENARIO, dqw_sim_run(&s, rows, count, &report, NULL, NULL));
    TEST_ASSERT_NOT_NULL(strstr(report.message, "invertible at t = "));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_ramp_is_zero_then_straight_then_flat);
    RUN_TEST(test_what_has_not_begun_changes_nothing);
    RUN_TEST(test_dead_time_takes_its_voltage_from_each_phase);
    RUN_TEST(test_temperatures_change_resistance_and_magnet);
    RUN_TEST(test_winding_heats_by_its_closed_form);
    RUN_TEST(test_iron_loss_is_a_resistance_across_the_induced_voltage);
    RUN_TEST(test_turn_short_at_standstill_is_a_resistor_network);
    RUN_TEST(test_turn_short_conducts_at_once);
    RUN_TEST(test_bad_connection_adds_its_resistance_to_phase_a_alone);
    RUN_TEST(test_bad_connection_at_speed_shows_at_twice_the_angle);
    RUN_TEST(test_demagnetisation_takes_its_share_of_the_flux);
    RUN_TEST(test_bearing_wear_brakes);
    RUN_TEST(test_saturation_law_has_one_energy);
    RUN_TEST(test_saturation_bends_the_curves);
    RUN_TEST(test_saturation_that_is_not_convex_is_refused);
    return UNITY_END();
}
