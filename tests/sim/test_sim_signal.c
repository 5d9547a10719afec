// References and excitations: each part of a signal against its description.
#include <math.h>

#include "dqw_sim.h"
#include "sim_signal.h"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

static double at(const dqw_sim_signal *g, double t_s) { return dqw_sim_signal_at(g, t_s, 1, 0); }

static void test_constant_and_step(void)
{
    const dqw_sim_signal g = {.value = 2, .step = 3, .t_step_s = 0.5};
    TEST_ASSERT_EQUAL_DOUBLE(2, at(&g, 0));
    TEST_ASSERT_EQUAL_DOUBLE(2, at(&g, 0.4999));
    TEST_ASSERT_EQUAL_DOUBLE(5, at(&g, 0.5));
    // 5000 periods of 0.1 ms, as the drive counts them.
    TEST_ASSERT_EQUAL_DOUBLE(5, at(&g, 5000 * 1e-4));
}

static void check_wave(enum dqw_sim_shape shape, const double wanted[8])
{
    const dqw_sim_signal g = {.value = 10, .wave = 4, .wave_period_s = 0.8, .shape = shape, .levels = 5};
    for (int k = 0; k < 24; ++k) TEST_ASSERT_DOUBLE_WITHIN(1e-6, 10 + wanted[k % 8], at(&g, 0.1 * k));
}

static void test_waves(void)
{
    const double h = 4 * sqrt(0.5);
    check_wave(DQW_SIM_SHAPE_SINE, (const double[]){0, h, 4, h, 0, -h, -4, -h});
    check_wave(DQW_SIM_SHAPE_SQUARE, (const double[]){4, 4, 4, 4, -4, -4, -4, -4});
    check_wave(DQW_SIM_SHAPE_TRIANGLE, (const double[]){0, 2, 4, 2, 0, -2, -4, -2});
    check_wave(DQW_SIM_SHAPE_STAIRS, (const double[]){-4, -4, -2, -2, 0, 2, 2, 4});
}

static void test_table(void)
{
    static const double table[] = {1, 3, -2};
    const dqw_sim_signal g = {.value = 10, .table = table, .table_rows = 3, .table_dt_s = 0.1};
    const double wanted[][2] = {{0, 11}, {0.05, 12}, {0.1, 13}, {0.125, 11.75}, {0.2, 8}, {0.3, 8}, {1e9, 8}};
    for (size_t k = 0; k < sizeof wanted / sizeof *wanted; ++k)
        TEST_ASSERT_DOUBLE_WITHIN(1e-7, wanted[k][1], at(&g, wanted[k][0]));
    // At a row's own time to the last digit, however that time was summed.
    for (int k = 0; k < 3; ++k) {
        double t_s = 0;
        for (int n = 0; n < k; ++n) t_s += 0.1;
        TEST_ASSERT_TRUE(at(&g, t_s) == 10 + table[k] && at(&g, k * 0.1) == 10 + table[k]);
    }
}

// Held for its time, uniform in +-3 over many holds: mean 0, deviation 3 / sqrt(3); another stream is another signal.
static void test_random_is_uniform_and_held(void)
{
    const dqw_sim_signal g = {.random = 3, .random_hold_s = 5e-3};
    double mean = 0, square = 0, most = 0, cross = 0;
    enum { N = 20000 };
    for (int k = 0; k < N; ++k) {
        const double x = at(&g, 5e-3 * k), y = dqw_sim_signal_at(&g, 5e-3 * k, 1, 1);
        for (int j = 1; j < 50; j += 12) TEST_ASSERT_EQUAL_DOUBLE(x, at(&g, 5e-3 * k + 1e-4 * j));
        mean += x / N, square += x * x / N, cross += x * y / N, most = fmax(most, fabs(x));
    }
    TEST_ASSERT_TRUE(most <= 3 && most > 2.99);
    TEST_ASSERT_DOUBLE_WITHIN(0.05, 0, mean);
    TEST_ASSERT_DOUBLE_WITHIN(0.08, 3, square);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 0, cross);
}

static void test_binary_is_two_valued_and_held(void)
{
    const dqw_sim_signal g = {.binary = 2, .binary_hold_s = 5e-4};
    int up = 0, changes = 0;
    double last = 0;
    enum { N = 20000 };
    for (int k = 0; k < N; ++k) {
        const double x = at(&g, 5e-4 * k);
        TEST_ASSERT_EQUAL_DOUBLE(2, fabs(x));
        TEST_ASSERT_EQUAL_DOUBLE(x, at(&g, 5e-4 * k + 4e-4));
        up += x > 0, changes += x != last, last = x;
    }
    TEST_ASSERT_INT_WITHIN(300, N / 2, up);
    TEST_ASSERT_INT_WITHIN(300, N / 2, changes);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_constant_and_step);
    RUN_TEST(test_waves);
    RUN_TEST(test_table);
    RUN_TEST(test_random_is_uniform_and_held);
    RUN_TEST(test_binary_is_two_valued_and_held);
    return UNITY_END();
}
