// Where the drive believes its rotor to be, and how fast: encoder, observer, tracking loop.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dqw_sim.h"
#include "sim_dq.h"
#include "unity.h"

static dqw_sim_row *truth, *rows;

void setUp(void) { truth = rows = NULL; }
void tearDown(void) { free(truth), free(rows); }

static const double two_pi = 6.283185307179586;
static const double T = 1e-4;

static void again(const dqw_sim_scenario *s)
{
    free(rows);
    rows = simulate(s);
}

// Measured: 3e-13 rad, and of the speed 3e-12 rad/s.
static void test_encoder_off_its_axis(void)
{
    const double b = 500, w = 100, kept = exp(-b * T);
    dqw_sim_scenario s = open_loop(0, 48, w);
    s.sensing = (dqw_sim_sensing){
        .once_rad = 0.01, .once_phase_rad = 0.3, .twice_rad = -0.004, .twice_phase_rad = 1, .speed_bandwidth_rad_s = b};
    s.duration_s = 0.2;
    again(&s);
    for (size_t k = 0; k < count; ++k) {
        const double theta = w * rows[k].t_s, once = theta + 0.3, twice = 2 * theta + 1,
                     error = 0.01 * sin(once) - 0.004 * sin(twice);
        TEST_ASSERT_DOUBLE_WITHIN(1e-11, 0, remainder(rows[k].theta_m_rad - theta - error, two_pi));
        TEST_ASSERT_DOUBLE_WITHIN(1e-11, 0, remainder(rows[k].theta_e_rad - 4 * (theta + error), two_pi));
        if (rows[k].t_s < 0.1) continue;
        // From angle to speed, a double pole at e^-bT: (1 - kept)^2 z (z - 1) / (z - kept)^2 / T.
        double speed = w;
        for (int n = 1; n <= 2; ++n) {
            const double complex z = cexp(I * n * w * T), gain = cpow((1 - kept) / (z - kept), 2) * z * (z - 1) / T;
            speed += cimag(gain * (n == 1 ? 0.01 * cexp(I * once) : -0.004 * cexp(I * twice)));
        }
        TEST_ASSERT_DOUBLE_WITHIN(1e-10, speed, rows[k].w_m_rad_s);
    }
}

// A step of the speed, half of it in the period before: 1 - kept^m (1 + (1 - kept) m), which is the double pole's
// 1 - e^-bt (1 + bt) sampled. Measured: 1e-12 rad/s of 50, 0.2 of the pole's own; a loop as fast as the sampling
// follows in two.
static void test_tracking_loop(void)
{
    for (double b = 200; b < 1e6; b *= 20) {
        const double kept = exp(-b * T);
        dqw_sim_scenario s = open_loop(0, 0, 0);
        s.profile.speed_rad_s.step = 50, s.profile.speed_rad_s.t_step_s = 0.01;
        s.sensing.speed_bandwidth_rad_s = b, s.duration_s = 0.05;
        again(&s);
        for (size_t k = 0; k < count; ++k) {
            double speed = 0;
            for (int half = 0; half < 2; ++half) {
                const double m = (double)k - 99 - half;
                if (m > 0) speed += 25 * (1 - pow(kept, m) * (1 + (1 - kept) * m));
            }
            TEST_ASSERT_DOUBLE_WITHIN(1e-10, speed, rows[k].w_m_rad_s);
            const double t = rows[k].t_s - 0.01 + 0.5 * T;
            if (b < 300 && t > 0)
                TEST_ASSERT_DOUBLE_WITHIN(0.5, 50 * (1 - exp(-b * t) * (1 + b * t)), rows[k].w_m_rad_s);
        }
    }
}

static dqw_sim_scenario swinging(void)
{
    dqw_sim_scenario s = open_loop(0, 30, 60);
    s.profile.speed_rad_s.wave = 50, s.profile.speed_rad_s.wave_period_s = 0.03;
    s.profile.v_d_V.random = s.profile.v_q_V.random = 20;
    s.profile.v_d_V.random_hold_s = 2e-3, s.profile.v_q_V.random_hold_s = 3e-3;
    s.duration_s = 0.1;
    return s;
}

// A part of a period late: on the straight line to the sample before. Measured: 2e-15 rad.
static void test_angle_that_comes_late(void)
{
    dqw_sim_scenario s = swinging();
    truth = simulate(&s);
    for (double late = 0.25; late <= 1; late += 0.25) {
        s.sensing.angle_late_periods = late;
        again(&s);
        for (size_t k = 1; k < count; ++k) {
            const double step = remainder(truth[k].theta_m_rad - truth[k - 1].theta_m_rad, two_pi),
                         seen = truth[k].theta_m_rad - late * step;
            TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0, remainder(rows[k].theta_m_rad - seen, two_pi));
            TEST_ASSERT_DOUBLE_WITHIN(1e-11, 0, remainder(rows[k].theta_e_rad - 4 * seen, two_pi));
        }
    }
}

// By speed and by load; the load is the true current's, turned back here. Measured: 5e-16 rad.
static void test_observer_lags(void)
{
    dqw_sim_scenario s = swinging();
    truth = simulate(&s);
    s.sensing = (dqw_sim_sensing){
        .observer = true, .speed_bandwidth_rad_s = 400, .observer_lag_s = 2e-4, .observer_load_rad_A = 3e-3};
    again(&s);
    double most = 0;
    for (size_t k = 0; k < count; ++k) {
        const double error = remainder(rows[k].theta_e_rad - truth[k].theta_e_rad, two_pi),
                     i_q = cimag(turned(i_of(&rows[k]), error));
        TEST_ASSERT_DOUBLE_WITHIN(1e-11, -2e-4 * 4 * truth[k].w_m_rad_s - 3e-3 * i_q, error);
        most = fmax(most, fabs(3e-3 * i_q));
    }
    TEST_ASSERT_TRUE(most > 0.01);
}

// A frame that lags is a command turned back, in whichever frame it is held; so is what the log says. Measured: 4e-12
// A.
static void test_wrong_frame_turns_the_command(void)
{
    const double lag = 3e-4 * 4 * 100;
    for (int hold = 0; hold < 2; ++hold) {
        free(truth);
        const double complex v = turned(5 + 60 * I, -lag);
        dqw_sim_scenario s = open_loop(creal(v), cimag(v), 100);
        s.drive.hold = hold ? DQW_SIM_HOLD_DQ : DQW_SIM_HOLD_ABC;
        truth = simulate(&s);
        s.profile.v_d_V.value = 5, s.profile.v_q_V.value = 60;
        s.sensing = (dqw_sim_sensing){.observer = true, .speed_bandwidth_rad_s = 400, .observer_lag_s = 3e-4};
        again(&s);
        for (size_t k = 0; k < count; ++k) {
            TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0, cabs(turned(i_of(&truth[k]), lag) - i_of(&rows[k])));
            TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0, cabs(turned(v_of(&truth[k]), lag) - v_of(&rows[k])));
        }
    }
}

// 20 000 samples whose neighbours share e^-bT: the deviation is known to 0.7 %, a correlation to 1 %.
static void test_observer_noise(void)
{
    static dqw_sim_row last[20000];
    const double b = 4000;
    for (int fast = 0; fast < 2; ++fast) {
        const double w = fast ? 50 : 0, stated = 0.05 * 100 / (4 * w + 100);
        dqw_sim_scenario s = open_loop(0, 10, w);
        s.sensing = (dqw_sim_sensing){.observer = true,
                                      .speed_bandwidth_rad_s = 400,
                                      .observer_noise_rad = 0.05,
                                      .observer_corner_rad_s = 100,
                                      .observer_bandwidth_rad_s = b};
        s.duration_s = 2, s.rtol = 1e-6;
        again(&s);
        double square = 0, lagged[4] = {0};
        double before[4] = {0};
        for (size_t k = 0; k < count; ++k) {
            const double x = remainder(rows[k].theta_e_rad - 4 * w * rows[k].t_s, two_pi);
            square += x * x / (double)count;
            for (int n = 3; n > 0; --n) lagged[n] += x * before[n] / (double)count;
            before[3] = before[2], before[2] = before[1], before[1] = x;
        }
        if (getenv("DQW_SIM_VERBOSE"))
            printf("observer: sd %.4g of stated, correlations %.3f %.3f %.3f\n", sqrt(square) / stated,
                   lagged[1] / square, lagged[2] / square, lagged[3] / square);
        TEST_ASSERT_DOUBLE_WITHIN(0.03 * stated, stated, sqrt(square));
        for (int n = 1; n < 4; ++n) TEST_ASSERT_DOUBLE_WITHIN(0.04, exp(-b * n * T), lagged[n] / square);
        memcpy(last, rows, sizeof last);
        again(&s);
        TEST_ASSERT_EQUAL_MEMORY(last, rows, sizeof last);
        s.noise.seed = 5;
        again(&s);
        TEST_ASSERT_TRUE(last[0].theta_e_rad != rows[0].theta_e_rad && last[9].theta_e_rad != rows[9].theta_e_rad);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_encoder_off_its_axis);
    RUN_TEST(test_tracking_loop);
    RUN_TEST(test_angle_that_comes_late);
    RUN_TEST(test_observer_lags);
    RUN_TEST(test_wrong_frame_turns_the_command);
    RUN_TEST(test_observer_noise);
    return UNITY_END();
}
