// Sensor noise from single rows: found whatever else the signals do, and whatever noise the voltage has.
#include "dqw_noise.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

// What a drive's rows hold: true currents and speed that move slowly, white noise on them, and white noise on the
// voltage times T/L, which the step of the current is freed of.
typedef struct drive {
    double i_sd_A[2], w_sd_rad_s, voltage_sd_A;
    double slow_A, slow_rad_s;
    double i_A[2], w_rad_s;  ///< the last row's, as measured
} drive;

static void row(drive *d, dqw_noise *n, int k, test_random *r)
{
    double e[2];
    for (int axis = 0; axis < 2; axis++) {
        const double truth = d->slow_A * sin(0.01 * k + axis) + 0.3 * d->slow_A * sin(0.043 * k);
        const double i = truth + (d->i_sd_A[axis] > 0.0 ? d->i_sd_A[axis] * random_normal(r) : 0.0);
        e[axis] = i - d->i_A[axis] - (d->voltage_sd_A > 0.0 ? d->voltage_sd_A * random_normal(r) : 0.0);
        d->i_A[axis] = i;
    }
    const double w = d->slow_rad_s * sin(0.003 * k) + (d->w_sd_rad_s > 0.0 ? d->w_sd_rad_s * random_normal(r) : 0.0);
    dqw_noise_step(n, (float)e[0], (float)e[1], (float)(w - d->w_rad_s), 0.0f);
    d->w_rad_s = w;
}

static dqw_noise listen(drive d, int rows, uint64_t seed)
{
    dqw_noise n;
    memset(&n, 0x5a, sizeof n);
    dqw_noise_init(&n);
    test_random r = {seed};
    for (int k = 0; k < rows; k++) row(&d, &n, k, &r);
    return n;
}

typedef struct spread {
    double mean, sd;
} spread;

// Each variance over its true value, over repeated runs: d, q, speed.
static void of_runs(drive d, int runs, uint64_t seed, spread out[3])
{
    const double truth[3] = {d.i_sd_A[0] * d.i_sd_A[0], d.i_sd_A[1] * d.i_sd_A[1], d.w_sd_rad_s * d.w_sd_rad_s};
    double square[3] = {0};
    memset(out, 0, 3 * sizeof out[0]);
    for (int k = 0; k < runs; k++) {
        const dqw_noise n = listen(d, 16000, seed + 1000u * (uint64_t)k);
        const double found[3] = {n.of.i_d_A2, n.of.i_q_A2, n.of.w_rad2_s2};
        for (int i = 0; i < 3; i++) {
            out[i].mean += found[i] / truth[i] / runs;
            square[i] += found[i] / truth[i] * found[i] / truth[i] / runs;
        }
    }
    for (int i = 0; i < 3; i++) out[i].sd = sqrt(fmax(square[i] - out[i].mean * out[i].mean, 0.0));
}

static void test_white_noise_is_found(void)
{
    const int runs = scaled(40);
    static const double sizes[] = {1e-3, 0.05, 2.0};
    for (int s = 0; s < 3; s++) {
        const drive d = {.i_sd_A = {sizes[s], 3 * sizes[s]}, .w_sd_rad_s = 10 * sizes[s]};
        spread x[3];
        of_runs(d, runs, (uint64_t)(10 * s), x);
        for (int i = 0; i < 3; i++) {
            CASE("noise of %g, channel %d", sizes[s], i);
            BETWEEN(runs == 40 ? 0.98 : 0.9, x[i].mean, runs == 40 ? 1.02 : 1.1);  // 0.995 to 1.004
            // Scatter of a mean over 8192 rows: 3.1 to 4.6 % of a current's, 1.5 to 1.7 % of the speed's.
            if (runs == 40) BETWEEN(i == 2 ? 0.01 : 0.02, x[i].sd, i == 2 ? 0.025 : 0.06);
        }
    }
}

static void test_slow_signals_and_noise_on_the_voltage_change_nothing(void)
{
    const int runs = scaled(40);
    const double sd = 0.05;
    const drive cases[] = {
        {.i_sd_A = {sd, sd}, .w_sd_rad_s = 0.5, .slow_A = 6, .slow_rad_s = 100},
        {.i_sd_A = {sd, sd}, .w_sd_rad_s = 0.5, .voltage_sd_A = sd},
        {.i_sd_A = {sd, sd}, .w_sd_rad_s = 0.5, .slow_A = 6, .slow_rad_s = 100, .voltage_sd_A = 2 * sd}};
    for (int c = 0; c < 3; c++) {
        spread x[3];
        of_runs(cases[c], runs, (uint64_t)(100 + 10 * c), x);
        for (int i = 0; i < 3; i++) {
            CASE("case %d, channel %d", c, i);
            // 0.988 to 1.007; fewer runs scatter more, with the voltage's noise most
            BETWEEN(runs == 40 ? 0.96 : 0.85, x[i].mean, runs == 40 ? 1.04 : 1.15);
        }
    }
}

// No noise on the sensors: nothing is found, whatever the voltage's.
static void test_without_noise_next_to_nothing_is_found(void)
{
    const drive slow = {.slow_A = 6, .slow_rad_s = 100};
    dqw_noise n = listen(slow, 20000, 3);
    BETWEEN(0.0, sqrt(dqw_noise_variance(n.of.i_d_A2)), 2e-3);  // 0, of 6 A
    BETWEEN(0.0, sqrt(dqw_noise_variance(n.of.i_q_A2)), 2e-3);
    BETWEEN(1e-4, sqrt(dqw_noise_variance(n.of.w_rad2_s2)), 6e-4);  // 2.6e-4, of 100 rad/s
    const drive voltage = {.voltage_sd_A = 0.1};
    n = listen(voltage, 20000, 4);
    BETWEEN(-5e-4, n.of.i_d_A2, 5e-4);  // 8e-5, 2.5e-4 of 0.01
    BETWEEN(-5e-4, n.of.i_q_A2, 5e-4);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, n.of.w_rad2_s2);
}

static void test_it_follows_noise_that_changes(void)
{
    dqw_noise n;
    dqw_noise_init(&n);
    test_random r = {5};
    drive d = {.i_sd_A = {0.1, 0.1}, .w_sd_rad_s = 1};
    for (int k = 0; k < 30000; k++) row(&d, &n, k, &r);
    d.i_sd_A[0] = 0.4;
    d.w_sd_rad_s = 0.25;
    for (int k = 0; k < (int)DQW_NOISE_MEMORY; k++) row(&d, &n, k, &r);
    // One memory later what it was counts 1/e.
    BETWEEN(0.16 + (0.01 - 0.16) * 0.45, n.of.i_d_A2, 0.16 + (0.01 - 0.16) * 0.29);
    BETWEEN(0.009, n.of.i_q_A2, 0.011);
    BETWEEN(0.0625 + 0.9375 * 0.33, n.of.w_rad2_s2, 0.0625 + 0.9375 * 0.41);
    TEST_ASSERT_EQUAL_UINT16(DQW_NOISE_MEMORY, n.of.rows);
}

// Between gaps all is level; across them it jumps by far more than the noise.
static void test_a_gap_is_not_spanned(void)
{
    for (int length = 1; length <= 12; length++) {
        CASE("a gap every %d rows", length);
        dqw_noise n;
        dqw_noise_init(&n);
        test_random r = {(uint64_t)length};
        uint32_t expected = 0;
        for (int k = 0; k < 3000; k++) {
            if (k % length == 0) dqw_noise_gap(&n);
            // In threes, so that a row is unlike the last and the last but two.
            const double level = 1e4 * (double)(random_bits(&r) % 2 == 0 || k % length ? k / length % 5 : -9);
            const double same = k % length ? n.e_d_A[0] : level;
            dqw_noise_step(&n, (float)(same + 0.1 * random_normal(&r)), (float)same,
                           (float)(k % length ? n.w_step_rad_s : level), (float)level);
            expected += k % length >= 3;
        }
        HOLDS(n.of.rows == expected);
        BETWEEN(-1.0, n.of.i_d_A2, 1.0);
        BETWEEN(-1.0, n.of.i_q_A2, 1.0);
        BETWEEN(0.0, n.of.w_rad2_s2, 1.0);
    }
}

// A voltage that answers noise by so much of it a period, at once and one and two periods later; and motion of its own,
// that currents follow. (E189)
static void test_an_answer_is_found(void)
{
    static const double weights[] = {-3, 3, -1};
    static const double parts[] = {0, 0.05, 0.3};
    for (int late = 0; late < 3; late++)
        for (int p = 0; p < 3; p++)
            for (int seed = 0; seed < 5; seed++) {
                dqw_noise n;
                dqw_noise_init(&n);
                test_random r = {(uint64_t)(50 + 10 * late + p + 100 * seed)};
                const double sd_A = 0.02;
                double noise[4] = {0};  // of this row's current, and the ones before
                for (int k = 0; k < 20000; k++) {
                    const double made = 0.5 * sin(0.01 * k) + 0.1 * (k / 40 % 2) - parts[p] * noise[late];
                    const double slow = 0.01 * sin(0.003 * k);
                    for (int i = 3; i > 0; i--) noise[i] = noise[i - 1];
                    noise[0] = sd_A * random_normal(&r);
                    const double step = noise[0] - noise[1] + slow;
                    dqw_noise_step(&n, (float)step, 0.0f, 0.0f, (float)made);
                }
                const double found = (double)n.of.answer_A2 / (sd_A * sd_A);
                CASE("answered %d periods late, by %g, seed %d: %.4f", late, parts[p], seed, found);
                // 0.01 off where the voltage only moves, 0.04 where it answers .3.
                const double room = 0.03 + 0.2 * parts[p];
                BETWEEN(weights[late] * parts[p] - room, found, weights[late] * parts[p] + room);
            }
}

// What was measured before counts no more, however loud it was.
static void test_it_begins_anew(void)
{
    dqw_noise old;
    dqw_noise fresh;
    dqw_noise_init(&old);
    dqw_noise_init(&fresh);
    test_random r = {60};
    for (int k = 0; k < 10000; k++)
        dqw_noise_step(&old, (float)(100 * random_normal(&r)), (float)(100 * random_normal(&r)),
                       (float)(100 * random_normal(&r)), (float)(100 * random_normal(&r)));
    dqw_noise_anew(&old);
    HOLDS(old.of.rows == 0);
    for (int k = 0; k < 3000; k++) {
        const float e[4] = {(float)random_normal(&r), (float)random_normal(&r), (float)random_normal(&r),
                            (float)random_normal(&r)};
        dqw_noise_step(&old, e[0], e[1], e[2], e[3]);
        dqw_noise_step(&fresh, e[0], e[1], e[2], e[3]);
    }
    HOLDS(old.of.rows == fresh.of.rows);
    BETWEEN(-1e-4, old.of.i_d_A2 - fresh.of.i_d_A2, 1e-4);
    BETWEEN(-1e-4, old.of.i_q_A2 - fresh.of.i_q_A2, 1e-4);
    BETWEEN(-1e-4, old.of.w_rad2_s2 - fresh.of.w_rad2_s2, 1e-4);
    BETWEEN(-1e-4, old.of.answer_A2 - fresh.of.answer_A2, 1e-4);
}

static void test_variances_as_read_are_not_negative(void)
{
    TEST_ASSERT_EQUAL_FLOAT(0.0f, dqw_noise_variance(-1.0f));
    TEST_ASSERT_EQUAL_FLOAT(0.0f, dqw_noise_variance(-0.0f));
    TEST_ASSERT_EQUAL_FLOAT(0.0f, dqw_noise_variance(NAN));
    TEST_ASSERT_EQUAL_FLOAT(2.5f, dqw_noise_variance(2.5f));
}

// Signals as large as the estimator lets through, and none at all.
static void test_numbers_stay_numbers(void)
{
    dqw_noise n;
    dqw_noise_init(&n);
    test_random r = {9};
    for (int k = 0; k < scaled(200000); k++) {
        const double size = pow(10, random_uniform(&r, -45, 12));
        dqw_noise_step(&n, (float)(size * random_normal(&r)), random_bits(&r) % 2 ? 0.0f : (float)size,
                       (float)(size * random_normal(&r)), (float)(size * random_normal(&r)));
        if (random_bits(&r) % 100 == 0) dqw_noise_gap(&n);
        HOLDS(isfinite(n.of.i_d_A2) && isfinite(n.of.i_q_A2) && isfinite(n.of.answer_A2) && isfinite(n.of.w_rad2_s2) &&
              n.of.w_rad2_s2 >= 0.0f);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_white_noise_is_found);
    RUN_TEST(test_slow_signals_and_noise_on_the_voltage_change_nothing);
    RUN_TEST(test_without_noise_next_to_nothing_is_found);
    RUN_TEST(test_it_follows_noise_that_changes);
    RUN_TEST(test_a_gap_is_not_spanned);
    RUN_TEST(test_an_answer_is_found);
    RUN_TEST(test_it_begins_anew);
    RUN_TEST(test_variances_as_read_are_not_negative);
    RUN_TEST(test_numbers_stay_numbers);
    return UNITY_END();
}
