// Three bodies that heat each other, losses of the iron, branches of the stator with a current of their own.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dqw_sim.h"
#include "sim_dq.h"
#include "unity.h"

static dqw_sim_row *truth, *rows;
static dqw_sim_report report;

void setUp(void) { truth = rows = NULL; }
void tearDown(void) { free(truth), free(rows); }

static const double R = 0.9;

static void again(const dqw_sim_scenario *s)
{
    free(rows);
    count = dqw_sim_rows(s);
    rows = calloc(count ? count : 1, sizeof *rows);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, dqw_sim_run(s, rows, count, &report, NULL, NULL), report.message);
}

// Relative to what was turned over.
static double imbalance(void)
{
    const dqw_sim_report *r = &report;
    const double out = r->copper_J + r->iron_J + r->mechanical_J + (r->stored_end_J - r->stored_start_J) + r->magnet_J;
    const double turnover = r->copper_J + r->iron_J + fabs(r->mechanical_J);
    TEST_ASSERT_TRUE(turnover > 0.01);
    if (getenv("DQW_SIM_VERBOSE"))
        printf("imbalance %.1e of %.3g J; copper %.3g, iron %.3g, magnet %.3g, mechanical %.3g J\n",
               (r->electrical_J - out) / turnover, turnover, r->copper_J, r->iron_J, r->magnet_J, r->mechanical_J);
    return (r->electrical_J - out) / turnover;
}

// At rest; heat_W from elsewhere into the housing.
static dqw_sim_scenario warming(double v_d_V, double heat_W, double duration_s)
{
    dqw_sim_scenario s = open_loop(v_d_V, 0, 0);
    s.machine.winding_heat_J_K = 60, s.machine.magnet_heat_J_K = 40, s.machine.housing_heat_J_K = 300;
    s.machine.winding_magnet_W_K = 2, s.machine.winding_housing_W_K = 12, s.machine.magnet_housing_W_K = 3;
    s.machine.winding_ambient_W_K = 0.5, s.machine.magnet_ambient_W_K = 0.2, s.machine.housing_ambient_W_K = 6;
    s.machine.temp_ambient_C = 20, s.machine.temp_start_C = 20;
    s.nonideal.heat_W.value = heat_W;
    s.drive.dt_s = 0.25, s.duration_s = duration_s, s.method = DQW_SIM_BDF, s.balance = true;
    return s;
}

// C dT/dt = P - K T above ambient, all at the ambient before. Winding, magnet, housing.
static const double conductance[3][3] = {{14.5, -2, -12}, {-2, 5.2, -3}, {-12, -3, 21}};
static const double capacity[3] = {60, 40, 300};

static void solve(const double power[3], double kelvin[3])
{
    double a[3][4];
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 4; ++j) a[i][j] = j < 3 ? conductance[i][j] : power[i];
    for (int n = 0; n < 3; ++n)
        for (int i = 0; i < 3; ++i) {
            const double f = i == n ? 0 : a[i][n] / a[n][n];
            for (int j = 0; j < 4; ++j) a[i][j] -= f * a[n][j];
        }
    for (int i = 0; i < 3; ++i) kelvin[i] = a[i][3] / a[i][i];
}

// The three rates of decay: roots of det(K - rate C), by bisection between where they must be.
static double secular(double rate)
{
    double m[3][3];
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) m[i][j] = conductance[i][j] - (i == j ? rate * capacity[i] : 0);
    return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
           m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

static void rates_of(double rate[3])
{
    int found = 0;
    for (double low = 0; low < 0.5 && found < 3; low += 1e-3) {
        double a = low, b = low + 1e-3;
        if ((secular(a) > 0) == (secular(b) > 0)) continue;
        for (int n = 0; n < 60; ++n) {
            const double middle = 0.5 * (a + b);
            if ((secular(a) > 0) == (secular(middle) > 0))
                a = middle;
            else
                b = middle;
        }
        rate[found++] = a;
    }
    TEST_ASSERT_EQUAL_INT(3, found);
}

// T = T_end - sum c_n v_n e^(-rate_n t): each mode v_n by its two lower equations, c_n by orthogonality under C.
static void transient(const double end[3], double t_s, int modes, double kelvin[3])
{
    double rate[3];
    rates_of(rate);
    memcpy(kelvin, end, 3 * sizeof *kelvin);
    for (int n = 0; n < modes; ++n) {
        const double b = conductance[1][1] - rate[n] * capacity[1], c = conductance[2][2] - rate[n] * capacity[2],
                     det = b * c - 9;
        const double v[3] = {1, (2 * c + 3 * 12) / det, (12 * b + 3 * 2) / det};
        double part = 0, size = 0;
        for (int i = 0; i < 3; ++i) part += capacity[i] * v[i] * end[i], size += capacity[i] * v[i] * v[i];
        for (int i = 0; i < 3; ++i) kelvin[i] -= part / size * v[i] * exp(-rate[n] * t_s);
    }
}

// With current and without; one time constant alone would be 26 K off, and 0.3 K. Measured: 2e-4 K, 7e-6 K at the end,
// heat 2e-9 J of 640 kJ.
static void test_three_bodies(void)
{
    for (int from_elsewhere = 0; from_elsewhere < 2; ++from_elsewhere) {
        const double v = from_elsewhere ? 0 : 18, heat = 30;
        dqw_sim_scenario s = warming(v, heat, 1000);
        again(&s);
        double end[3], kelvin[3], one[3], most = 0;
        const double power[3] = {1.5 * v * v / R, 0, heat};
        solve(power, end);
        for (size_t k = 0; k < count; ++k) {
            // The current's own rise costs (3/2) L/R of full heating.
            const double t = fmax(0, rows[k].t_s - (v > 0 ? 1.5 * 2.2e-3 / R : 0));
            transient(end, t, 3, kelvin), transient(end, t, 1, one);
            TEST_ASSERT_DOUBLE_WITHIN(1e-3, 20 + kelvin[0], rows[k].temp_winding_C);
            TEST_ASSERT_DOUBLE_WITHIN(1e-3, 20 + kelvin[1], rows[k].temp_magnet_C);
            most = fmax(most, fabs(one[0] - kelvin[0]));
        }
        TEST_ASSERT_TRUE(most > 0.05 * end[0]);
        TEST_ASSERT_DOUBLE_WITHIN(2e-5, end[0], rows[count - 1].temp_winding_C - 20);
        TEST_ASSERT_DOUBLE_WITHIN(2e-5, end[1], rows[count - 1].temp_magnet_C - 20);
        double stored = 0;
        transient(end, 1000, 3, kelvin);
        for (int i = 0; i < 3; ++i) stored += capacity[i] * kelvin[i];
        TEST_ASSERT_DOUBLE_WITHIN(1e-3, stored, report.heat_stored_J);
        const double made = report.copper_J + report.iron_J;
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, made, report.heat_stored_J + report.heat_ambient_J);
    }
}

// No current at the terminals: what brakes is the iron. e = j w psi / (1 + j w L G), loss 1.5 G |e|^2.
// Measured: 2e-12 W of 28 and more; eddies go with w^2 to 4e-5, hysteresis with w to 2e-3, which the corner takes.
static void test_losses_of_the_iron(void)
{
    double loss[3][2];
    for (int kind = 0; kind < 3; ++kind)
        for (int twice = 0; twice < 2; ++twice) {
            dqw_sim_scenario s = settled(0, 0, twice ? 200 : 100);
            const double w = twice ? 800 : 400, G = (kind != 1 ? 1.0 / 500 : 0) + (kind != 0 ? 1.5 / hypot(w, 20) : 0);
            s.machine.Lq_H = 2.2e-3, s.balance = true;
            if (kind != 1) s.nonideal.iron_loss_S.value = 1.0 / 500;
            if (kind != 0) s.nonideal.iron_hysteresis_S_rad_s.value = 1.5, s.nonideal.iron_hysteresis_corner_rad_s = 20;
            again(&s);
            const double before = report.iron_J;
            s.duration_s = 0.15;
            again(&s);
            loss[kind][twice] = (report.iron_J - before) / 0.05;
            const double complex e = I * w * 0.12 / (1 + I * w * 2.2e-3 * G);
            TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.5 * G * cabs(e) * cabs(e), loss[kind][twice]);
            TEST_ASSERT_DOUBLE_WITHIN(1e-10, -1.5 * G * cabs(e) * cabs(e), rows[count - 1].torque_Nm * w / 4);
        }
    TEST_ASSERT_DOUBLE_WITHIN(2e-4, 4, loss[0][1] / loss[0][0]);
    TEST_ASSERT_DOUBLE_WITHIN(5e-3, 2, loss[1][1] / loss[1][0]);
}

static dqw_sim_scenario branched(double tau_s)
{
    dqw_sim_scenario s = *dqw_sim_scenario_find("servo_ideal");
    s.nonideal.iron_loss_S.value = 1.0 / 80, s.nonideal.iron_hysteresis_S_rad_s.value = 2,
    s.nonideal.iron_hysteresis_corner_rad_s = 50, s.nonideal.iron_loss_tau_s = tau_s;
    s.nonideal.turn_short.value = 0.1, s.nonideal.turn_short_ohm = 0.1, s.nonideal.turn_short_H = 0.19 * tau_s;
    s.nonideal.dead_time_V.value = 4, s.nonideal.dead_time_width_A = 0.5;
    s.nonideal.phase_connection_ohm.value = 0.2;
    s.profile.i_d_A.value = -4;
    s.method = DQW_SIM_BDF, s.duration_s = 0.02;
    return s;
}

// Eddies and shorted turns whose time constant is short are those without one; what is left goes with it.
// Measured: 5.5e-3 A at 2 us, half of that to 1 % at 1 us.
static void test_branches_that_are_fast_are_the_circuit(void)
{
    for (int hold = 0; hold < 2; ++hold) {
        double worst[2] = {0, 0};
        dqw_sim_scenario s = branched(0);
        s.drive.hold = hold ? DQW_SIM_HOLD_DQ : DQW_SIM_HOLD_ABC;
        free(truth), truth = simulate(&s);
        for (int half = 0; half < 2; ++half) {
            s = branched(half ? 1e-6 : 2e-6);
            s.drive.hold = hold ? DQW_SIM_HOLD_DQ : DQW_SIM_HOLD_ABC;
            again(&s);
            for (size_t k = 0; k < count; ++k) worst[half] = fmax(worst[half], cabs(i_of(&rows[k]) - i_of(&truth[k])));
        }
        if (getenv("DQW_SIM_VERBOSE")) printf("branches: %.3g A apart, half as slow %.3g\n", worst[0], worst[1]);
        TEST_ASSERT_DOUBLE_WITHIN(0.011, 0, worst[0]);
        TEST_ASSERT_DOUBLE_WITHIN(0.05, 2, worst[0] / worst[1]);
    }
}

// Where the branches are slow, ramp, legs switch, and everything heats. Measured: 2e-9; heat 2e-12 J.
static void test_balance_with_branches(void)
{
    for (int switches = 0; switches < 2; ++switches) {
        dqw_sim_scenario s = branched(1e-4);
        s.machine.winding_heat_J_K = s.machine.magnet_heat_J_K = s.machine.housing_heat_J_K = 2;
        s.machine.winding_housing_W_K = s.machine.magnet_housing_W_K = s.machine.housing_ambient_W_K = 5;
        s.nonideal.heat_W.value = 20, s.nonideal.winding_alpha_per_K.value = 4e-3;
        s.nonideal.magnet_beta_per_K.value = -1e-3;
        s.nonideal.magnet_asymmetry_Wb.value = 5e-3;
        s.nonideal.iron_loss_S = (dqw_sim_ramp){0.02, 0.005, 0.015};
        s.nonideal.turn_short = (dqw_sim_ramp){0.1, 0.002, 0.015};
        s.profile.speed_start_rad_s = -100;
        s.balance = true, s.method = DQW_SIM_ADAMS, s.rtol = 1e-10;
        if (switches) {
            s.nonideal.dead_time_V.value = 0, s.duration_s = 0.01;
            s.inverter.modulation = DQW_SIM_MODULATION_CENTRED, s.inverter.dead_time_s = 1e-6;
        }
        again(&s);
        TEST_ASSERT_DOUBLE_WITHIN(2e-8, 0, imbalance());
        const double made = report.copper_J + report.iron_J;
        TEST_ASSERT_DOUBLE_WITHIN(1e-9 * made, made, report.heat_stored_J + report.heat_ambient_J);
        TEST_ASSERT_TRUE(report.iron_J > 0.02 * made && fabs(report.stored_end_J - report.stored_start_J) > 1e-3);
    }
}

// Once a turn of the shaft: psi_d gains A cos a, a = theta_m + phase, so that with Ld = Lq = L and s = +-1
//     i = (v - j w psi) / (R + j w L) - sum over s of A/2 (j w + j s w_m) e^(j s a) / (R + (j w + j s w_m) L).
// Measured: 2e-8 A, 1e-8 Nm; balance 1e-11.
static void test_unlike_magnet(void)
{
    const double w_m = 100, w = 400, A = 6e-3, L = 2.2e-3;
    dqw_sim_scenario s = open_loop(0, 55, w_m);
    s.drive.hold = DQW_SIM_HOLD_DQ, s.duration_s = 0.2, s.rtol = 1e-10, s.balance = true;
    s.nonideal.magnet_asymmetry_Wb.value = A, s.nonideal.magnet_asymmetry_phase_rad = 0.7;
    again(&s);
    double swing = 0;
    for (size_t k = count / 2; k < count; ++k) {
        const double a = w_m * rows[k].t_s + 0.7;
        const double complex steady = (55 * I - I * w * 0.12) / (R + I * w * L);
        double complex i = steady;
        for (int sign = -1; sign <= 1; sign += 2) {
            const double complex rate = I * (w + sign * w_m);
            i -= 0.5 * A * rate * cexp(I * sign * a) / (R + rate * L);
        }
        TEST_ASSERT_DOUBLE_WITHIN(1e-7, 0, cabs(i - i_of(&rows[k])));
        // A fourth of the slope by theta_e: four pole pairs.
        const double torque = 6 * ((0.12 + A * cos(a)) * cimag(i) - A / 4 * sin(a) * creal(i));
        TEST_ASSERT_DOUBLE_WITHIN(1e-7, torque, rows[k].torque_Nm);
        swing = fmax(swing, cabs(i - steady));
    }
    TEST_ASSERT_TRUE(swing > 1);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0, imbalance());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_three_bodies);
    RUN_TEST(test_losses_of_the_iron);
    RUN_TEST(test_branches_that_are_fast_are_the_circuit);
    RUN_TEST(test_balance_with_branches);
    RUN_TEST(test_unlike_magnet);
    return UNITY_END();
}
