// The Ordinal Learner: R from noise-free and noisy pairs, the bias of each form and discretisation, gaps, wild samples.
#include "dqw_ordinal.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

// The paper's machine at its sampling period.
#define TRUE_R_OHM 0.37
#define TRUE_L_H 0.326e-3
#define T_S 1e-4
enum { SAMPLES = 301 };

static double x_true[SAMPLES], y_true[SAMPLES];

// +-2 V drawn anew every few ms, held from sample to sample: the current is exact.
static void make_signals(uint64_t seed)
{
    test_random r = {seed};
    const double a = exp(-TRUE_R_OHM * T_S / TRUE_L_H);
    double y = 0.0;
    double x = 0.0;
    for (int k = 0; k < SAMPLES; k++) {
        if (k % 20 == 0) x = random_bits(&r) & 1u ? 2.0 : -2.0;
        x_true[k] = x;
        y_true[k] = y;
        y = a * y + (1 - a) / TRUE_R_OHM * x;
    }
}

static double rms(const double v[], int n)
{
    double sum = 0.0;
    for (int k = 0; k < n; k++) sum += v[k] * v[k];
    return sqrt(sum / n);
}

static dqw_ordinal begin(enum dqw_ordinal_form form, enum dqw_ordinal_discretisation discretisation, double R_start,
                         double L_start)
{
    const dqw_ordinal_config c = {.dt_s = (float)T_S,
                                  .x_base = 2.0f,
                                  .y_base = 5.0f,
                                  .R_ohm = (float)R_start,
                                  .L_H = (float)L_start,
                                  .form = form,
                                  .discretisation = discretisation};
    dqw_ordinal o;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_ordinal_init(&o, &c));
    return o;
}

// Epochs until it converges; noise on the current, in parts of its RMS.
static int learn(dqw_ordinal *o, int samples, double noise, uint64_t seed)
{
    int epoch = 0;
    const double sd = noise * rms(y_true, samples);
    do {
        test_random r = {seed};
        for (int k = 0; k < samples; k++)
            dqw_ordinal_step(o, (float)x_true[k], (float)(y_true[k] + sd * random_normal(&r)));
        epoch++;
    } while (!dqw_ordinal_end_epoch(o) && epoch < 40);
    return epoch;
}

static void test_init_refuses_and_leaves_the_object_alone(void)
{
    dqw_ordinal o;
    const dqw_ordinal_config good = {.dt_s = 1e-4f, .x_base = 2.0f, .y_base = 5.0f, .R_ohm = 0.3f, .L_H = 3e-4f};
    TEST_ASSERT_EQUAL_INT(DQW_ERR_NULL, dqw_ordinal_init(NULL, &good));
    REFUSED(o, DQW_ERR_NULL, dqw_ordinal_init(&o, NULL));
    const float bad[] = {0.0f, -0.0f, -1.0f, NAN, INFINITY, -INFINITY};
    for (int k = 0; k < 6; k++)
        for (int field = 0; field < 5; field++) {
            dqw_ordinal_config c = good;
            float *const fields[] = {&c.dt_s, &c.x_base, &c.y_base, &c.R_ohm, &c.L_H};
            *fields[field] = bad[k];
            REFUSED(o, DQW_ERR_RANGE, dqw_ordinal_init(&o, &c));
        }
    // Bases whose reciprocal is infinite.
    dqw_ordinal_config c = good;
    c.x_base = 1e-45f;
    REFUSED(o, DQW_ERR_RANGE, dqw_ordinal_init(&o, &c));
    c = good;
    c.y_base = 1e-45f;
    REFUSED(o, DQW_ERR_RANGE, dqw_ordinal_init(&o, &c));
}

static void test_exact_R_from_100_samples(void)
{
    static const double start[] = {0.1, 1.0, 3.0};
    for (int s = 0; s < 3; s++)
        for (int form = 0; form < 2; form++) {
            CASE("start at %g R, form %d", start[s], form);
            make_signals(1);
            dqw_ordinal o = begin((enum dqw_ordinal_form)form, DQW_ORDINAL_EXACT, start[s] * TRUE_R_OHM,
                                  TRUE_L_H / start[s]);
            const int epochs = learn(&o, 100, 0.0, 1);
            BETWEEN(-1e-4, dqw_ordinal_R_from_x(&o, NAN) / TRUE_R_OHM - 1, 1e-4);
            BETWEEN(-1e-4, dqw_ordinal_R_from_y(&o, (float)TRUE_L_H) / TRUE_R_OHM - 1, 1e-4);
            BETWEEN(1, epochs, 3);
        }
}

static void test_start_values_are_read_back(void)
{
    const dqw_ordinal o = begin(DQW_ORDINAL_OUTPUT_ERROR, DQW_ORDINAL_EXACT, 0.5, 1e-3);
    BETWEEN(0.4999, dqw_ordinal_R_from_x(&o, NAN), 0.5001);
    BETWEEN(0.4999, dqw_ordinal_R_from_y(&o, 1e-3f), 0.5001);
}

// T R / L = 0.1135: the exact pole read with the backward difference is R = L/T (e^0.1135 - 1) = 0.392. Its weight of
// x, which the backward difference expects at the end of the period, reads R / (1 - e^-0.1135) - L/T = 0.188.
static void test_backward_difference_is_off_by_what_theory_says(void)
{
    make_signals(2);
    dqw_ordinal o = begin(DQW_ORDINAL_PAIRS, DQW_ORDINAL_BACKWARD, TRUE_R_OHM, TRUE_L_H);
    (void)learn(&o, 100, 0.0, 1);
    const double t = TRUE_R_OHM * T_S / TRUE_L_H;
    BETWEEN(-3e-4, dqw_ordinal_R_from_y(&o, (float)TRUE_L_H) / (TRUE_L_H / T_S * (exp(t) - 1)) - 1, 3e-4);
    BETWEEN(0.3915, dqw_ordinal_R_from_y(&o, (float)TRUE_L_H), 0.3921);
    BETWEEN(-2e-3, dqw_ordinal_R_from_x(&o, (float)TRUE_L_H) / (TRUE_R_OHM / (1 - exp(-t)) - TRUE_L_H / T_S) - 1, 2e-3);
}

// R that least squares on pairs tends to with white noise of this size on the current: the noise adds to the power of
// z^-1 y.
static double biased_R(double noise)
{
    double xx = 0.0, xy = 0.0, yy = 0.0, xn = 0.0, yn = 0.0;
    for (int k = 0; k + 1 < SAMPLES; k++) {
        xx += x_true[k] * x_true[k];
        xy += x_true[k] * y_true[k];
        yy += y_true[k] * y_true[k];
        xn += x_true[k] * y_true[k + 1];
        yn += y_true[k] * y_true[k + 1];
    }
    const double sd = noise * rms(y_true, SAMPLES);
    yy += (SAMPLES - 1) * sd * sd;
    return -TRUE_L_H / T_S * log((xx * yn - xy * xn) / (xx * yy - xy * xy));
}

static void test_pairs_are_biased_by_noise_and_output_error_is_not(void)
{
    static const double noise[] = {0.1, 0.2};
    static const double high[] = {1.2, 1.7};           // pairs, from z^-1 y: at least this times R
    static const double worst_percent[] = {3.5, 6.5};  // output error, worst of the seeds, from x
    const int seeds = 200;
    make_signals(3);
    for (int c = 0; c < 2; c++) {
        CASE("noise %g", noise[c]);
        double pairs = 0.0;
        double output = 0.0;
        double output_y = 0.0;
        double worst = 0.0;
        for (int seed = 0; seed < seeds; seed++) {
            dqw_ordinal o = begin(DQW_ORDINAL_PAIRS, DQW_ORDINAL_EXACT, 0.3, 3e-4);
            (void)learn(&o, SAMPLES, noise[c], (uint64_t)seed);
            pairs += dqw_ordinal_R_from_y(&o, (float)TRUE_L_H) / seeds;
            dqw_ordinal p = begin(DQW_ORDINAL_OUTPUT_ERROR, DQW_ORDINAL_EXACT, 0.3, 3e-4);
            (void)learn(&p, SAMPLES, noise[c], (uint64_t)seed);
            const double R = dqw_ordinal_R_from_x(&p, (float)TRUE_L_H);
            output += R / seeds;
            output_y += dqw_ordinal_R_from_y(&p, (float)TRUE_L_H) / seeds;
            worst = fmax(worst, 100 * fabs(R / TRUE_R_OHM - 1));
        }
        const double expected = biased_R(noise[c]);
        BETWEEN(high[c], expected / TRUE_R_OHM, 1.9 * high[c]);
        BETWEEN(0.95, pairs / expected, 1.05);
        BETWEEN(0.99, output / TRUE_R_OHM, 1.01);
        BETWEEN(0.98, output_y / TRUE_R_OHM, 1.02);
        BETWEEN(worst_percent[c] / 3, worst, worst_percent[c]);
    }
}

static void test_output_error_settles(void)
{
    make_signals(4);
    for (int seed = 0; seed < 50; seed++) {
        CASE("seed %d", seed);
        dqw_ordinal o = begin(DQW_ORDINAL_OUTPUT_ERROR, DQW_ORDINAL_EXACT, 0.3, 3e-4);
        const int epochs = learn(&o, SAMPLES, 0.2, (uint64_t)seed);
        BETWEEN(2, epochs, 15);
        HOLDS(o.converged);
        HOLDS(o.epochs == (uint32_t)epochs);
        HOLDS(o.learned == (uint32_t)epochs * (SAMPLES - 1));
    }
}

static void test_indicator_is_the_mean_error(void)
{
    make_signals(5);
    dqw_ordinal o = begin(DQW_ORDINAL_OUTPUT_ERROR, DQW_ORDINAL_EXACT, 0.3, 3e-4);
    (void)learn(&o, SAMPLES, 0.0, 1);
    BETWEEN(-1e-4, o.w_o, 1e-4);
}

// A sample that is no number breaks the chain: no pair spans it, and noise-free R stays exact.
static void test_gaps(void)
{
    for (int form = 0; form < 2; form++) {
        CASE("form %d", form);
        make_signals(6);
        dqw_ordinal o = begin((enum dqw_ordinal_form)form, DQW_ORDINAL_EXACT, 0.3, 3e-4);
        uint32_t skipped = 0;
        uint32_t learned = 0;
        int epoch = 0;
        do {
            test_random r = {7};
            bool before = false;
            for (int k = 0; k < SAMPLES; k++) {
                const uint64_t kind = random_bits(&r) % 20;
                const float x = kind == 0 ? NAN : kind == 1 ? INFINITY : (float)x_true[k];
                const float y = kind == 2 ? NAN : kind == 3 ? -INFINITY : (float)y_true[k];
                dqw_ordinal_step(&o, x, y);
                const bool good = kind > 3;
                if (!good) skipped++;
                if (good && before) learned++;
                before = good;
            }
            epoch++;
        } while (!dqw_ordinal_end_epoch(&o) && epoch < 40);
        TEST_ASSERT_EQUAL_UINT32(skipped, o.skipped);
        TEST_ASSERT_EQUAL_UINT32(learned, o.learned);
        BETWEEN(-1e-4, dqw_ordinal_R_from_x(&o, NAN) / TRUE_R_OHM - 1, 1e-4);
        BETWEEN(-1e-4, dqw_ordinal_R_from_y(&o, (float)TRUE_L_H) / TRUE_R_OHM - 1, 1e-4);
    }
}

static void test_weights_without_meaning_read_as_no_number(void)
{
    dqw_ordinal o = begin(DQW_ORDINAL_OUTPUT_ERROR, DQW_ORDINAL_EXACT, 0.3, 3e-4);
    o.b_pu = -1.0f;
    TEST_ASSERT_TRUE(isnan(dqw_ordinal_R_from_x(&o, 1e-3f)));
    o.b_pu = 0.0f;
    TEST_ASSERT_TRUE(isnan(dqw_ordinal_R_from_x(&o, 1e-3f)));
    o.a = -0.1f;
    TEST_ASSERT_TRUE(isnan(dqw_ordinal_R_from_y(&o, 1e-3f)));
    o.a = 0.0f;
    TEST_ASSERT_TRUE(isnan(dqw_ordinal_R_from_y(&o, 1e-3f)));
}

// One sample of any finite size, in any epoch: later epochs of clean samples find R again.
static void test_a_wild_sample_does_not_wedge_it(void)
{
    static const float sizes[] = {1e3f, 1e6f, 1e10f, 1e19f, 1e30f, 3e38f};
    for (int form = 0; form < 2; form++)
        for (int s = 0; s < 6; s++)
            for (int where = 0; where < 2; where++)
                for (int when = 0; when < 2; when++) {
                    CASE("form %d, %g in %s, epoch %d", form, (double)sizes[s], where ? "y" : "x", when);
                    make_signals(8);
                    dqw_ordinal o = begin((enum dqw_ordinal_form)form, DQW_ORDINAL_EXACT, 0.3, 3e-4);
                    for (int epoch = 0; epoch < 20; epoch++) {
                        for (int k = 0; k < SAMPLES; k++) {
                            const bool wild = epoch == when && k == 100;
                            dqw_ordinal_step(&o, wild && !where ? sizes[s] : (float)x_true[k],
                                             wild && where ? sizes[s] : (float)y_true[k]);
                        }
                        (void)dqw_ordinal_end_epoch(&o);
                    }
                    const double R = dqw_ordinal_R_from_x(&o, NAN);
                    // Pairs never forget: there it is enough that a number comes out.
                    HOLDS(isfinite(o.a) && isfinite(o.b_pu));
                    if (form == DQW_ORDINAL_OUTPUT_ERROR) BETWEEN(-1e-3, R / TRUE_R_OHM - 1, 1e-3);
                }
}

static void test_counters_stop_at_their_maximum(void)
{
    dqw_ordinal o = begin(DQW_ORDINAL_OUTPUT_ERROR, DQW_ORDINAL_EXACT, 0.3, 3e-4);
    o.learned = o.skipped = o.epochs = UINT32_MAX;
    dqw_ordinal_step(&o, 1.0f, 1.0f);
    dqw_ordinal_step(&o, 1.0f, 1.0f);
    dqw_ordinal_step(&o, NAN, 1.0f);
    (void)dqw_ordinal_end_epoch(&o);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, o.learned);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, o.skipped);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, o.epochs);
}

// In the middle of an epoch too the resistances are those of the weights as they stand.
static void test_a_resistance_within_an_epoch(void)
{
    dqw_ordinal o = begin(DQW_ORDINAL_PAIRS, DQW_ORDINAL_EXACT, 0.4, 4e-4);
    for (int way = -1; way <= 1; way++) {
        o.delta_pu[0] = 0.1f * (float)way * o.b_pu;
        o.delta_pu[1] = 0.02f * (float)way;
        const double a = (double)o.a + (double)o.delta_pu[1];
        const double b = (double)o.b_pu * (1 + 0.1 * way) * 5.0 / 2.0;
        CASE("way %d", way);
        BETWEEN(-1e-5, (double)dqw_ordinal_R_from_x(&o, NAN) / ((1 - a) / b) - 1, 1e-5);
        BETWEEN(-1e-5, (double)dqw_ordinal_R_from_y(&o, 4e-4f) / (-log(a) * 4e-4 / T_S) - 1, 1e-5);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_and_leaves_the_object_alone);
    RUN_TEST(test_exact_R_from_100_samples);
    RUN_TEST(test_start_values_are_read_back);
    RUN_TEST(test_backward_difference_is_off_by_what_theory_says);
    RUN_TEST(test_pairs_are_biased_by_noise_and_output_error_is_not);
    RUN_TEST(test_output_error_settles);
    RUN_TEST(test_indicator_is_the_mean_error);
    RUN_TEST(test_gaps);
    RUN_TEST(test_weights_without_meaning_read_as_no_number);
    RUN_TEST(test_a_wild_sample_does_not_wedge_it);
    RUN_TEST(test_counters_stop_at_their_maximum);
    RUN_TEST(test_a_resistance_within_an_epoch);
    return UNITY_END();
}
