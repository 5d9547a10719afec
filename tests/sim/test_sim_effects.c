// What the machine and its inverter lack, each effect against another form of its law: a resistor network, Runge-Kutta
// on currents.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "dqw_sim.h"
#include "sim_curve.h"
#include "unity.h"

static dqw_sim_row *rows;
static size_t count;
static dqw_sim_report report;
static char path[64];

void setUp(void)
{
    rows = NULL;
    strcpy(path, "/tmp/dqw_sim_curve_XXXXXX");
    const int file = mkstemp(path);
    TEST_ASSERT_TRUE(file >= 0);
    close(file);
}
void tearDown(void)
{
    free(rows);
    unlink(path);
}

static const dqw_sim_row *end_of(const dqw_sim_scenario *s)
{
    free(rows);
    count = dqw_sim_rows(s);
    rows = calloc(count ? count : 1, sizeof *rows);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, dqw_sim_run(s, rows, count, &report, NULL, NULL), report.message);
    return &rows[count - 1];
}

// The servo at an imposed speed; voltages from the start, or currents until all has settled.
static dqw_sim_scenario servo(enum dqw_sim_control control, double d, double q, double speed_rad_s)
{
    dqw_sim_scenario s = *dqw_sim_scenario_find("servo_ideal");
    s.profile = (dqw_sim_profile){.control = control, .shaft = DQW_SIM_SHAFT_IMPOSED};
    s.profile.speed_rad_s.value = speed_rad_s;
    if (control == DQW_SIM_CONTROL_VOLTAGE)
        s.profile.v_d_V.value = d, s.profile.v_q_V.value = q;
    else
        s.profile.i_d_A.value = d, s.profile.i_q_A.value = q;
    s.drive.hold = DQW_SIM_HOLD_DQ;
    s.duration_s = 0.1, s.rtol = 1e-10;
    return s;
}

static void test_skin_effect_raises_resistance_with_speed_squared(void)
{
    for (int speed = -100; speed <= 150; speed += 50) {
        dqw_sim_scenario s = servo(DQW_SIM_CONTROL_CURRENT, 3, 0, speed);
        s.nonideal.skin_effect_s2_rad2.value = 2e-6;
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, 3 * 0.9 * (1 + 2e-6 * 16.0 * speed * speed), end_of(&s)->v_d_V);
    }
}

// Star of three unequal resistors at standstill, by its neutral's voltage.
static void test_unequal_phases_are_a_resistor_network(void)
{
    const double extra[][2] = {{0.3, 0}, {0, 0.4}, {-0.2, 0.5}, {0.25, -0.3}};
    for (int k = 0; k < 4; ++k) {
        dqw_sim_scenario s = servo(DQW_SIM_CONTROL_VOLTAGE, 5, -3, 0);
        s.nonideal.phase_resistance_a_ohm.value = extra[k][0], s.nonideal.phase_resistance_b_ohm.value = extra[k][1];
        s.nonideal.phase_connection_ohm.value = 0.05;
        const double v[3] = {5, -2.5 + sqrt(0.75) * -3, -2.5 - sqrt(0.75) * -3};
        const double R[3] = {0.95 + extra[k][0], 0.9 + extra[k][1], 0.9};
        double conductance = 0, neutral = 0, i[3];
        for (int x = 0; x < 3; ++x) conductance += 1 / R[x], neutral += v[x] / R[x];
        for (int x = 0; x < 3; ++x) i[x] = (v[x] - neutral / conductance) / R[x];
        const dqw_sim_row *end = end_of(&s);
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, (2 * i[0] - i[1] - i[2]) / 3, end->i_d_A);
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, (i[1] - i[2]) / sqrt(3), end->i_q_A);
    }
}

typedef struct truth {
    double w_e, d6, q6, phase6, d12, q12, phase12, disturbance_V, disturbance_rad_s;
} truth;

// Plain servo with extra flux linkage, states i_d, i_q; v in the stationary frame, or (turning) in the rotor's.
static void slope(const truth *x, bool turning, const double v[2], double t, const double i[2], double di[2])
{
    const double theta = x->w_e * t, c = turning ? 1 : cos(theta), s = turning ? 0 : sin(theta);
    const double six = 6 * theta + x->phase6, twelve = 12 * theta + x->phase12;
    const double h_d = x->d6 * cos(six) + x->d12 * cos(twelve), h_q = x->q6 * sin(six) + x->q12 * sin(twelve);
    const double dh_d = -x->w_e * (6 * x->d6 * sin(six) + 12 * x->d12 * sin(twelve)),
                 dh_q = x->w_e * (6 * x->q6 * cos(six) + 12 * x->q12 * cos(twelve));
    const double v_d = c * v[0] + s * v[1] + x->disturbance_V * sin(x->disturbance_rad_s * t);
    const double v_q = c * v[1] - s * v[0] - x->disturbance_V * cos(x->disturbance_rad_s * t);
    di[0] = (v_d - 0.9 * i[0] + x->w_e * (2.8e-3 * i[1] + h_q) - dh_d) / 2.2e-3;
    di[1] = (v_q - 0.9 * i[1] - x->w_e * (2.2e-3 * i[0] + 0.12 + h_d) - dh_q) / 2.8e-3;
}

static void runge_kutta(const truth *x, bool turning, const double v[2], double t, double span, double i[2])
{
    const int steps = 20;
    const double h = span / steps;
    for (int n = 0; n < steps; ++n, t += h) {
        double k1[2], k2[2], k3[2], k4[2], y[2];
        slope(x, turning, v, t, i, k1);
        for (int j = 0; j < 2; ++j) y[j] = i[j] + 0.5 * h * k1[j];
        slope(x, turning, v, t + 0.5 * h, y, k2);
        for (int j = 0; j < 2; ++j) y[j] = i[j] + 0.5 * h * k2[j];
        slope(x, turning, v, t + 0.5 * h, y, k3);
        for (int j = 0; j < 2; ++j) y[j] = i[j] + h * k3[j];
        slope(x, turning, v, t + h, y, k4);
        for (int j = 0; j < 2; ++j) i[j] += h / 6 * (k1[j] + 2 * k2[j] + 2 * k3[j] + k4[j]);
    }
}

// Random voltages at a constant speed, so that the angle is w t.
static dqw_sim_scenario stirred(double speed_rad_s)
{
    dqw_sim_scenario s = servo(DQW_SIM_CONTROL_VOLTAGE, 0, 480e-3 * speed_rad_s, speed_rad_s);
    s.profile.v_d_V.random = s.profile.v_q_V.random = 20, s.profile.v_d_V.random_hold_s = 7e-4,
    s.profile.v_q_V.random_hold_s = 5e-4;
    return s;
}

static void expect_replay(const truth *x)
{
    double most = 0;
    for (size_t k = 0; k + 1 < count; ++k) {
        const double v[2] = {rows[k].v_d_V, rows[k].v_q_V};
        double i[2] = {rows[k].i_d_A, rows[k].i_q_A};
        runge_kutta(x, true, v, rows[k].t_s, 1e-4, i);
        TEST_ASSERT_DOUBLE_WITHIN(2e-7, i[0], rows[k + 1].i_d_A);
        TEST_ASSERT_DOUBLE_WITHIN(2e-7, i[1], rows[k + 1].i_q_A);
        most = fmax(most, fabs(i[1]));
    }
    TEST_ASSERT_TRUE(most > 3);
}

static void test_flux_harmonics_induce_in_the_rotor_frame(void)
{
    dqw_sim_scenario s = stirred(120);
    dqw_sim_nonideal *x = &s.nonideal;
    x->flux_harmonic_6d_Wb.value = 1e-3, x->flux_harmonic_6q_Wb.value = -7e-4, x->flux_harmonic_6_phase_rad = 0.4;
    x->flux_harmonic_12d_Wb.value = 2e-4, x->flux_harmonic_12q_Wb.value = 3e-4, x->flux_harmonic_12_phase_rad = -1;
    end_of(&s);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0, hypot(rows[0].i_d_A, rows[0].i_q_A));
    const truth with = {.w_e = 480, .d6 = 1e-3, .q6 = -7e-4, .phase6 = 0.4, .d12 = 2e-4, .q12 = 3e-4, .phase12 = -1};
    expect_replay(&with);
}

// Torque at given currents is the change of the co-energy with the angle: d/dtheta of (psi + h)'i beside the part of
// plain flux.
static void test_flux_harmonics_ripple_the_torque(void)
{
    dqw_sim_scenario s = stirred(120);
    s.nonideal.flux_harmonic_6d_Wb.value = 1e-3, s.nonideal.flux_harmonic_6q_Wb.value = -7e-4;
    end_of(&s);
    double ripple = 0;
    for (size_t k = 0; k < count; ++k) {
        const double i_d = rows[k].i_d_A, i_q = rows[k].i_q_A, at[3] = {-1e-4, 0, 1e-4};
        // Stationary: the same vector of current, the linkage turning past it.
        double linked[3];
        for (int n = 0; n < 3; ++n) {
            const double theta = rows[k].theta_e_rad + at[n], h_d = 0.12 + 1e-3 * cos(6 * theta),
                         h_q = -7e-4 * sin(6 * theta);
            const double c = cos(at[n]), sn = sin(at[n]), d = c * i_d + sn * i_q, q = c * i_q - sn * i_d;
            linked[n] = h_d * d + h_q * q + 0.5 * (2.2e-3 * d * d + 2.8e-3 * q * q);
        }
        const double torque = 6 * (linked[2] - linked[0]) / 2e-4, smooth = 6 * (0.12 - 0.6e-3 * i_d) * i_q;
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, torque, rows[k].torque_Nm);
        ripple = fmax(ripple, fabs(torque - smooth));
    }
    TEST_ASSERT_TRUE(ripple > 0.05);
}

// The log says what was meant; this replay holds the last vectors for the late part of each period.
static void test_delay_applies_the_last_voltage_for_its_share(void)
{
    const double late[] = {0, 0.35, 0.999, 1, 1.6, 2};
    for (int n = 0; n < 6; ++n) {
        dqw_sim_scenario s = stirred(150);
        s.drive.hold = DQW_SIM_HOLD_ABC;
        s.nonideal.delay_periods.value = late[n];
        end_of(&s);
        const truth plain = {.w_e = 600};
        const double half = 0.5 * 600 * 1e-4, shrink = sin(half) / half;
        const int whole = (int)late[n];
        for (size_t k = 2; k + 1 < count; ++k) {
            double held[3][2], i[2] = {rows[k].i_d_A, rows[k].i_q_A};
            for (size_t b = 0; b < 3; ++b) {
                const double angle = 600 * rows[k - b].t_s + half;
                held[b][0] = (cos(angle) * rows[k - b].v_d_V - sin(angle) * rows[k - b].v_q_V) / shrink;
                held[b][1] = (sin(angle) * rows[k - b].v_d_V + cos(angle) * rows[k - b].v_q_V) / shrink;
            }
            const double part = late[n] - whole, t = rows[k].t_s;
            if (part > 0) runge_kutta(&plain, false, held[whole + 1], t, part * 1e-4, i);
            runge_kutta(&plain, false, held[whole], t + part * 1e-4, (1 - part) * 1e-4, i);
            TEST_ASSERT_DOUBLE_WITHIN(2e-7, i[0], rows[k + 1].i_d_A);
            TEST_ASSERT_DOUBLE_WITHIN(2e-7, i[1], rows[k + 1].i_q_A);
        }
    }
}

static void test_disturbance_is_in_the_currents_and_not_in_the_log(void)
{
    dqw_sim_scenario s = stirred(120);
    s.nonideal.disturbance_V.value = 2, s.nonideal.disturbance_Hz = 37;
    end_of(&s);
    const truth with = {.w_e = 480, .disturbance_V = 2, .disturbance_rad_s = 2 * 3.14159265358979324 * 37};
    expect_replay(&with);
}

static void write_text(const char *text)
{
    FILE *file = fopen(path, "w");
    TEST_ASSERT_NOT_NULL(file);
    fputs(text, file);
    fclose(file);
}

// Current along phase a: i in a, -i/2 in b and c, as for dead time.
static void test_measured_inverter_curve_replaces_dead_time(void)
{
    write_text("v_V,note,i_A\n0.5,x,0.5\n2.0,x,1\n3.0,x,4\n");
    const struct {
        double i, at_i, at_half;
    } points[] = {
        {0.5, 0.5, 0.25}, {0.8, 1.4, 0.4}, {3, 8.0 / 3, 2 + 0.5 / 3}, {12, 3, 3}, {-3, -8.0 / 3, -2 - 0.5 / 3}};
    for (int k = 0; k < 5; ++k) {
        dqw_sim_scenario s = servo(DQW_SIM_CONTROL_CURRENT, points[k].i, 0, 0);
        strcpy(s.nonideal.inverter_curve, path);
        s.drive.i_max_A = 20;
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.9 * points[k].i + 2.0 / 3 * (points[k].at_i + points[k].at_half),
                                  end_of(&s)->v_d_V);
    }
}

static void test_curve_of_both_signs_is_made_odd(void)
{
    write_text("i_A,v_V\n-2,-1.5\n-1,-1\n0,0.1\n1,1.2\n2,1.5\n");
    dqw_sim_curve curve;
    char message[320];
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, dqw_sim_curve_read(path, &curve, message, sizeof message), message);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.1, dqw_sim_curve_at(&curve, 1));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, -1.1, dqw_sim_curve_at(&curve, -1));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0, dqw_sim_curve_at(&curve, 0));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.5, dqw_sim_curve_at(&curve, 99));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.55, dqw_sim_curve_at(&curve, 0.5));
}

static void test_bad_curves_are_refused_by_line(void)
{
    const char *const bad[][2] = {{"", "2 are needed"},
                                  {"i_A\n1\n", "no column v_V"},
                                  {"i_A,v_V\n1,2\n", "1 points"},
                                  {"i_A,v_V\n1,2\n1,3\n", ":3: i_A = 1 does not ascend"},
                                  {"i_A,v_V\n1,2\n2,x\n", ":3: v_V is 'x'"},
                                  {"i_A,v_V\n1,2\n2\n", ":3: 1 fields"},
                                  {"i_A,v_V\n0,2\n2,3\n", "jumps"},
                                  {"i_A,v_V\n-2,-1\n-1,-0.5\n", "positive current"}};
    for (size_t k = 0; k < sizeof bad / sizeof *bad; ++k) {
        write_text(bad[k][0]);
        dqw_sim_scenario s = servo(DQW_SIM_CONTROL_CURRENT, 1, 0, 0);
        strcpy(s.nonideal.inverter_curve, path);
        free(rows);
        rows = calloc(dqw_sim_rows(&s), sizeof *rows);
        TEST_ASSERT_EQUAL_INT(DQW_SIM_ERR_MAP, dqw_sim_run(&s, rows, dqw_sim_rows(&s), &report, NULL, NULL));
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(report.message, bad[k][1]), report.message);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(report.message, path), report.message);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_skin_effect_raises_resistance_with_speed_squared);
    RUN_TEST(test_unequal_phases_are_a_resistor_network);
    RUN_TEST(test_flux_harmonics_induce_in_the_rotor_frame);
    RUN_TEST(test_flux_harmonics_ripple_the_torque);
    RUN_TEST(test_delay_applies_the_last_voltage_for_its_share);
    RUN_TEST(test_disturbance_is_in_the_currents_and_not_in_the_log);
    RUN_TEST(test_measured_inverter_curve_replaces_dead_time);
    RUN_TEST(test_curve_of_both_signs_is_made_odd);
    RUN_TEST(test_bad_curves_are_refused_by_line);
    return UNITY_END();
}
