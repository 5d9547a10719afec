// Noise, seeds, quantisation.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "dqw_sim.h"
#include "sim_log.h"
#include "sim_random.h"
#include "unity.h"

static dqw_sim_row *clean, *noisy;

void setUp(void) { clean = noisy = NULL; }
void tearDown(void) { free(clean), free(noisy); }

static double at(const dqw_sim_row *row, size_t column) { return ((const double *)(const void *)row)[column]; }
enum { V_D = 1, V_Q, I_D, I_Q, SPEED, THETA_E, THETA_M, V_DC, WINDING, MAGNET, TORQUE };
static const size_t noisy_columns[] = {V_D, V_Q, I_D, I_Q, SPEED, TORQUE};

static dqw_sim_scenario servo(double noise)
{
    dqw_sim_scenario s = *dqw_sim_scenario_find("servo_ideal");
    s.noise = (dqw_sim_noise){
        .i = noise, .v = noise, .w = noise, .theta = noise, .v_dc = noise, .temp = noise, .torque = noise};
    s.duration_s = 0.5;
    return s;
}

static double sd_of(const dqw_sim_row *log, size_t column)
{
    double mean = 0, square = 0;
    for (size_t k = 0; k < count; ++k) mean += at(&log[k], column) / (double)count;
    for (size_t k = 0; k < count; ++k) square += pow(at(&log[k], column) - mean, 2) / (double)count;
    return sqrt(square);
}

// 5000 rows: the standard deviation itself is known to 1 %. Four of its own deviations.
static void test_noise_has_the_stated_standard_deviation(void)
{
    dqw_sim_scenario s = servo(0);
    clean = simulate(&s);
    s = servo(0.05);
    noisy = simulate(&s);
    for (size_t c = 0; c < sizeof noisy_columns / sizeof *noisy_columns; ++c) {
        const size_t column = noisy_columns[c];
        double mean = 0, square = 0;
        for (size_t k = 0; k < count; ++k) {
            const double e = at(&noisy[k], column) - at(&clean[k], column);
            mean += e / (double)count, square += e * e / (double)count;
        }
        const double stated = 0.05 * sd_of(clean, column);
        TEST_ASSERT_TRUE(stated > 0);
        TEST_ASSERT_DOUBLE_WITHIN(0.04 * stated, stated, sqrt(square));
        TEST_ASSERT_DOUBLE_WITHIN(4 * stated / sqrt((double)count), 0, mean);
    }
    // A constant channel has no deviation, so no noise; time never has any.
    for (size_t k = 0; k < count; ++k) {
        TEST_ASSERT_EQUAL_DOUBLE(320, noisy[k].v_dc_V);
        TEST_ASSERT_EQUAL_DOUBLE(clean[k].t_s, noisy[k].t_s);
        TEST_ASSERT_TRUE(noisy[k].theta_e_rad >= 0 && noisy[k].theta_e_rad < 6.2831853071795865);
    }
}

// White in time, and from channel to channel: every correlation within 4.5 / sqrt(n) for lags 1 to 5.
static void test_noise_is_white_and_channels_are_independent(void)
{
    dqw_sim_scenario s = servo(0);
    clean = simulate(&s);
    s = servo(0.05);
    noisy = simulate(&s);
    const size_t columns = sizeof noisy_columns / sizeof *noisy_columns;
    for (size_t a = 0; a < columns; ++a)
        for (size_t b = 0; b < columns; ++b)
            for (size_t lag = a == b; lag <= 5; ++lag) {
                double cross = 0, one = 0, two = 0;
                for (size_t k = 0; k + lag < count; ++k) {
                    const double x = at(&noisy[k], noisy_columns[a]) - at(&clean[k], noisy_columns[a]);
                    const double y = at(&noisy[k + lag], noisy_columns[b]) - at(&clean[k + lag], noisy_columns[b]);
                    cross += x * y, one += x * x, two += y * y;
                }
                TEST_ASSERT_DOUBLE_WITHIN(4.5 / sqrt((double)count), 0, cross / sqrt(one * two));
            }
}

// 200 000 draws: mean, variance, kurtosis, and the share beyond two deviations (4.55 %).
static void test_generator_is_normal(void)
{
    double mean = 0, square = 0, fourth = 0, beyond = 0, squares = 0, last = 0;
    const double n = 200000;
    for (uint64_t k = 0; k < 200000; ++k) {
        const double x = dqw_sim_random_normal(7, 3, k);
        mean += x / n, square += x * x / n, fourth += x * x * x * x / n, beyond += (fabs(x) > 2) / n;
        squares += (x * x - 1) * (last * last - 1) / n, last = x;
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.01, 0, mean);
    TEST_ASSERT_DOUBLE_WITHIN(0.015, 1, square);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 3, fourth);
    TEST_ASSERT_DOUBLE_WITHIN(0.002, 0.0455, beyond);
    TEST_ASSERT_DOUBLE_WITHIN(0.02, 0, squares);
}

static void test_seeds(void)
{
    dqw_sim_scenario s = servo(0.01);
    s.duration_s = 0.05;
    clean = simulate(&s);
    noisy = simulate(&s);
    TEST_ASSERT_EQUAL_INT(0, memcmp(clean, noisy, count * sizeof *clean));
    free(noisy);
    // The noise's own seed leaves the excitation alone.
    s.noise.seed = 1;
    noisy = simulate(&s);
    const double noise = sd_of(clean, V_D) * 0.01;
    double change = 0;
    for (size_t k = 0; k < count; ++k) change = fmax(change, fabs(noisy[k].v_d_V - clean[k].v_d_V));
    TEST_ASSERT_TRUE(change > noise && change < 10 * noise);
    free(noisy);
    // The scenario's seed does not.
    s.noise.seed = 0, s.seed = 2;
    noisy = simulate(&s);
    change = 0;
    for (size_t k = 0; k < count; ++k) change = fmax(change, fabs(noisy[k].v_d_V - clean[k].v_d_V));
    TEST_ASSERT_TRUE(change > 100 * noise);
}

static double off_grid(double x, double step) { return fabs(x / step - floor(x / step + 0.5)); }

static void test_quantisation(void)
{
    dqw_sim_scenario s = servo(0.01);
    s.duration_s = 0.1;
    s.noise.step_i_A = 0.05, s.noise.step_v_V = 0.5, s.noise.step_w_rad_s = 0.25, s.noise.step_torque_Nm = 0.1,
    s.noise.step_temp_C = 0.5;
    s.noise.step_v_dc_V = 3;
    noisy = simulate(&s);
    double phase = 0;
    for (size_t k = 0; k < count; ++k) {
        const dqw_sim_row *r = &noisy[k];
        const double c = cos(r->theta_e_rad), sn = sin(r->theta_e_rad);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0, off_grid(r->v_d_V, 0.5));
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0, off_grid(r->v_q_V, 0.5));
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0, off_grid(r->w_m_rad_s, 0.25));
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0, off_grid(r->torque_Nm, 0.1));
        TEST_ASSERT_EQUAL_DOUBLE(321, r->v_dc_V);
        TEST_ASSERT_TRUE(isfinite(c + sn));
        phase = fmax(phase, fabs(r->i_d_A));
    }
    TEST_ASSERT_TRUE(phase > 1);
}

// Phase by phase: at a noise-free angle, i_b - i_c = sqrt(3) beta and 2 i_a - i_b - i_c = 3 alpha are multiples of the
// step.
static void test_currents_are_quantised_in_each_phase(void)
{
    dqw_sim_scenario s = servo(0);
    s.duration_s = 0.1, s.noise.step_i_A = 0.05;
    noisy = simulate(&s);
    s.noise.step_i_A = 0;
    clean = simulate(&s);
    double worst = 0, most = 0;
    for (size_t k = 0; k < count; ++k) {
        const double beta = sin(noisy[k].theta_e_rad) * noisy[k].i_d_A + cos(noisy[k].theta_e_rad) * noisy[k].i_q_A;
        const double off = off_grid(sqrt(3) * beta, 0.05);
        const double alpha = cos(noisy[k].theta_e_rad) * noisy[k].i_d_A - sin(noisy[k].theta_e_rad) * noisy[k].i_q_A;
        worst = fmax(worst, fmax(off, off_grid(3 * alpha, 0.05)));
        most = fmax(most, fabs(beta));
    }
    TEST_ASSERT_TRUE(most > 2);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0, worst);
    // The loops see it too: the trajectory is another one, near the clean one.
    double apart = 0;
    for (size_t k = 0; k < count; ++k) apart = fmax(apart, fabs(noisy[k].v_d_V - clean[k].v_d_V));
    TEST_ASSERT_TRUE(apart > 0.01 && apart < 2);
}

static void test_encoder_steps(void)
{
    dqw_sim_scenario s = servo(0);
    const double step = 6.283185307179586 / 4096;
    s.duration_s = 0.1, s.noise.step_theta_m_rad = step;
    noisy = simulate(&s);
    for (size_t k = 0; k < count; ++k) {
        const double off = off_grid(noisy[k].theta_m_rad, step);
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0, fmin(off, 1 - off));
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0,
                                  remainder(noisy[k].theta_e_rad - 4 * noisy[k].theta_m_rad, 6.283185307179586));
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_noise_has_the_stated_standard_deviation);
    RUN_TEST(test_noise_is_white_and_channels_are_independent);
    RUN_TEST(test_generator_is_normal);
    RUN_TEST(test_seeds);
    RUN_TEST(test_quantisation);
    RUN_TEST(test_currents_are_quantised_in_each_phase);
    RUN_TEST(test_encoder_steps);
    return UNITY_END();
}
