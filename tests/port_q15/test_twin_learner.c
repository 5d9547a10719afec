// The fixed-point Learner beside the float one, sample by sample: step sizes and amplitudes, every mode, limits,
// refusals.
#include "dqw_learner.h"
#include "dqw_learner_q15.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

static const double truth[] = {0.304, -0.26, 0.11, 0.15, -0.08, 0.09};  // no sum beyond the full scale

// What one unit of the last place of a signal is.
#define LSB (1.0 / 32768)

static int16_t q15(double x) { return (int16_t)lrint(fmax(-32767.0, fmin(32767.0, 32768 * x))); }
static double of_q31(int32_t w) { return w / 2147483648.0; }
static double of_q28(int32_t e) { return e / 268435456.0; }

// Largest distances over a run, in last places of Q15.
typedef struct worst {
    double twins;         ///< fixed point from float, any weight at any sample
    double fixed;         ///< fixed point from the same law in double
    double single;        ///< float from the same law in double
    double fixed_mean;    ///< means of the last quarter: fixed point from double
    double truth_fixed;   ///< fixed point from the truth
    double truth_single;  ///< float from the truth
    int bounded;          ///< steps that the bound made shorter
} worst;

static worst run(int n, uint16_t step_q15, double amplitude, int samples, uint64_t seed)
{
    int32_t w_q31[DQW_LEARNER_INPUTS_Q15] = {0};
    float w[DQW_LEARNER_INPUTS_Q15] = {0};
    double v[DQW_LEARNER_INPUTS_Q15] = {0};
    double mean[3][DQW_LEARNER_INPUTS_Q15] = {{0}};
    test_random r = {seed};
    worst out = {0};
    const int from = samples - samples / 4;
    for (int k = 0; k < samples; k++) {
        int16_t x_q15[DQW_LEARNER_INPUTS_Q15];
        float x[DQW_LEARNER_INPUTS_Q15];
        double y = 0.0;
        double norm = 1.0;
        for (int i = 0; i < n; i++) {
            x_q15[i] = q15(random_uniform(&r, -amplitude, amplitude));
            x[i] = (float)x_q15[i] / 32768;
            y += truth[i] * (double)x[i];
            norm += (double)x[i] * (double)x[i];
        }
        const int16_t y_q15 = q15(y);
        double e = y_q15 * LSB;
        for (int i = 0; i < n; i++) e -= v[i] * (double)x[i];
        // The fixed-point step is bounded where the float one's bound is a thousand bases.
        const double g = step_q15 * LSB * e / norm;
        if (fabs(g) > 0.5) out.bounded++;
        for (int i = 0; i < n; i++) v[i] += fmax(-0.5, fmin(0.5, g)) * (double)x[i];
        (void)dqw_learner_step_pu(w, x, n, (float)y_q15 / 32768, (float)step_q15 / 32768);
        const int32_t e_q28 = dqw_learner_step_pu_q15(w_q31, x_q15, n, y_q15, step_q15);
        if (k == 0) BETWEEN(-1e-9, of_q28(e_q28) - y_q15 * LSB, 1e-9);
        for (int i = 0; i < n; i++) {
            const double fixed = of_q31(w_q31[i]);
            out.twins = fmax(out.twins, fabs(fixed - (double)w[i]) / LSB);
            out.fixed = fmax(out.fixed, fabs(fixed - v[i]) / LSB);
            out.single = fmax(out.single, fabs((double)w[i] - v[i]) / LSB);
            if (k < from) continue;
            mean[0][i] += fixed / (samples - from);
            mean[1][i] += (double)w[i] / (samples - from);
            mean[2][i] += v[i] / (samples - from);
        }
    }
    for (int i = 0; i < n; i++) {
        out.fixed_mean = fmax(out.fixed_mean, fabs(mean[0][i] - mean[2][i]) / LSB);
        out.truth_fixed = fmax(out.truth_fixed, fabs(mean[0][i] - truth[i]) / LSB);
        out.truth_single = fmax(out.truth_single, fabs(mean[1][i] - truth[i]) / LSB);
    }
    return out;
}

// The products see a weight rounded to 16 bits: wrong by half a last place, an input. In the mean the law settles where
// the rounded weights are right on average, half a last place from there at most. On the way the gain is wrong by 7e-5
// of itself, and a weight has travelled
// 0.52, 17000 last places: 1.2 of them, times the largest part x e^-x = 0.37 of the way where that shows. So 1.0 alone,
// and as inputs pull each other, twice that. The float twin adds its own distance: at slow steps and small signals it
// is the one that stalls.
static void test_step_sizes_and_amplitudes(void)
{
    static const uint16_t step[] = {65000, 32768, 16384, 3277, 328, 33};
    static const double amplitude[] = {0.05, 0.1, 0.3, 0.6, 1.0};
    const bool table = getenv("DQW_TEST_VALUES") != NULL;
    worst all = {0};
    for (int n = 1; n <= 6; n += n < 2 ? 1 : 2)
        for (int s = 0; s < 6; s++)
            for (int a = 0; a < 5; a++) {
                CASE("%d inputs, step size %g, amplitude %g", n, step[s] / 32768.0, amplitude[a]);
                // Time for e^-20, or for what a test may take.
                const double power = amplitude[a] * amplitude[a] / 3;
                const double time = 20 * (1 + n * power) / (step[s] / 32768.0 * power);
                const int samples = scaled(time < 1e6 ? (int)time + 20000 : 1000000);
                const worst w = run(n, step[s], amplitude[a], samples, (uint64_t)(100 * n + 10 * s + a));
                if (table && (n == 1 || n == 4))
                    printf("%d inputs, step %.4f, amplitude %.2f: twins %.3f, fixed %.3f, float %.3f, mean %.3f, from "
                           "truth %.3f, float's %.3f\n",
                           n, step[s] / 32768.0, amplitude[a], w.twins, w.fixed, w.single, w.fixed_mean, w.truth_fixed,
                           w.truth_single);
                BETWEEN(0.0, w.fixed, 2.0);
                BETWEEN(0.0, w.fixed_mean, 1.0);
                if (w.bounded == 0) BETWEEN(0.0, w.twins, 2.0 + w.single);
                HOLDS(step[s] > 16384 || w.bounded == 0);
                if (time < samples) BETWEEN(0.0, w.truth_fixed, 1.0);
                all.fixed = fmax(all.fixed, w.fixed);
                all.fixed_mean = fmax(all.fixed_mean, w.fixed_mean);
                if (time < samples) all.truth_fixed = fmax(all.truth_fixed, w.truth_fixed);
            }
    test_case[0] = 0;
    BETWEEN(1.0, all.fixed, 2.0);        // 1.90
    BETWEEN(0.2, all.fixed_mean, 0.7);   // 0.38
    BETWEEN(0.2, all.truth_fixed, 0.7);  // 0.38
}

// The table of docs/NUMERICS.md, our part of it: four taps learned from white noise until what is left of the start is
// e^-16 of it. The weights' error in % of them: no step size stalls, no amplitude diverges.
static void test_taps_at_every_step_size_and_amplitude(void)
{
    static const uint16_t step[] = {16384, 3277, 328, 33};
    static const double amplitude[] = {0.05, 0.1, 0.3, 0.5, 0.7, 1.0};
    for (int s = 0; s < 4; s++)
        for (int a = 0; a < 6; a++) {
            const double power = amplitude[a] * amplitude[a] / 3;
            const long samples = 40000 + (long)(16 * (1 + 4 * power) / (step[s] / 32768.0 * power));
            if (scaled(10) == 1 && samples > 500000) continue;
            CASE("step size %g, amplitude %g", step[s] / 32768.0, amplitude[a]);
            test_random r = {1};
            int16_t x[4] = {0};
            int32_t w_q31[4] = {0};
            double square = 0.0;
            for (long k = 0; k < samples; k++) {
                memmove(x + 1, x, 3 * sizeof x[0]);
                x[0] = q15(random_uniform(&r, -amplitude[a], amplitude[a]));
                double y = 0.0;
                for (int i = 0; i < 4; i++) y += truth[i] * x[i];
                (void)dqw_learner_step_pu_q15(w_q31, x, 4, (int16_t)lrint(y), step[s]);
                for (int i = 0; i < 4 && k >= samples - samples / 4; i++) square += pow(of_q31(w_q31[i]) - truth[i], 2);
            }
            const double size = truth[0] * truth[0] + truth[1] * truth[1] + truth[2] * truth[2] + truth[3] * truth[3];
            const double off_percent = 100 * sqrt(square / (double)(samples / 4) / size);
            BETWEEN(0.001, off_percent, 0.005);  // 0.0020 to 0.0024
        }
}

static void test_init_refuses_and_leaves_the_object_alone(void)
{
    dqw_learner_q15 l;
    const dqw_learner_config_q15 good = {.inputs = 3, .step_size_q15 = 16384};
    TEST_ASSERT_EQUAL_INT(DQW_ERR_NULL, dqw_learner_init_q15(NULL, &good));
    REFUSED(l, DQW_ERR_NULL, dqw_learner_init_q15(&l, NULL));
    static const int sizes[] = {0, -1, DQW_LEARNER_INPUTS_Q15 + 1, INT32_MIN, INT32_MAX};
    for (int k = 0; k < 5; k++) {
        dqw_learner_config_q15 c = good;
        c.inputs = sizes[k];
        REFUSED(l, DQW_ERR_SIZE, dqw_learner_init_q15(&l, &c));
    }
    dqw_learner_config_q15 c = good;
    c.step_size_q15 = 0;
    REFUSED(l, DQW_ERR_RANGE, dqw_learner_init_q15(&l, &c));
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_init_q15(&l, &good));
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_set_weight_q15(&l, 2, -5));
    TEST_ASSERT_EQUAL_INT32(-5, dqw_learner_weight_q15(&l, 2));
    const dqw_learner_q15 before = l;
    TEST_ASSERT_EQUAL_INT(DQW_ERR_SIZE, dqw_learner_set_weight_q15(&l, 3, 1));
    TEST_ASSERT_EQUAL_INT(DQW_ERR_SIZE, dqw_learner_set_weight_q15(&l, -1, 1));
    TEST_ASSERT_EQUAL_INT(DQW_ERR_NULL, dqw_learner_set_weight_q15(NULL, 0, 1));
    TEST_ASSERT_EQUAL_MEMORY(&before, &l, sizeof l);
    TEST_ASSERT_EQUAL_INT32(0, dqw_learner_weight_q15(&l, 3));
    TEST_ASSERT_EQUAL_INT32(0, dqw_learner_weight_q15(&l, -1));
    l.learned = UINT32_MAX;
    const int16_t x[3] = {1, 2, 3};
    (void)dqw_learner_learn_q15(&l, x, 4);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, l.learned);
}

// Every mode of the Learner: weights, indicator, forward output and returned error of each sample. The bounds are those
// of the step above; where nothing but a floor keeps the norm from zero, the gain is large and what a last place is of
// the input adds.
static void test_every_mode_takes_the_float_path(void)
{
    static const uint16_t step[] = {32768, 16384, 3277, 328};
    static const double amplitude[] = {0.05, 0.3, 1.0};
    double most[4] = {0};
    double pulled = 0.0;
    for (int mode = 0; mode < 4; mode++)
        for (int n = 1; n <= 6; n++)
            for (int s = 0; s < 4; s++)
                for (int a = 0; a < 3; a++) {
                    CASE("mode %d, %d inputs, step size %g, amplitude %g", mode, n, step[s] / 32768.0, amplitude[a]);
                    dqw_learner_config c = {.inputs = n, .step_size = step[s] / 32768.0f, .y_base = 1.0f};
                    dqw_learner_config_q15 d = {.inputs = n, .step_size_q15 = step[s]};
                    c.noisy_inputs = d.noisy_inputs = (mode & 1) != 0;
                    c.indicator = d.indicator = (mode & 2) != 0;
                    for (int i = 0; i < n; i++) c.x_base[i] = 1.0f;
                    dqw_learner f;
                    dqw_learner_q15 q;
                    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_init(&f, &c));
                    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_init_q15(&q, &d));
                    test_random r = {(uint64_t)(1000 * mode + 100 * n + 10 * s + a)};
                    double apart = 0.0;
                    for (int k = 0; k < scaled(4000); k++) {
                        int16_t x_q15[6];
                        float x[6];
                        double y = 0.03 * amplitude[a] * random_normal(&r) * (k % 7 == 0);
                        for (int i = 0; i < n; i++) {
                            x_q15[i] = q15(random_uniform(&r, 0.25 * amplitude[a], amplitude[a]) *
                                           (random_bits(&r) % 2 ? 1 : -1));
                            x[i] = (float)x_q15[i] / 32768;
                            y += truth[i] * (double)x[i];
                        }
                        const int16_t y_q15 = q15(y);
                        const double forward = of_q28(dqw_learner_forward_q15(&q, x_q15));
                        HOLDS(fabs(forward - (double)dqw_learner_forward(&f, x)) < 10 * n * LSB);
                        const double e = of_q28(dqw_learner_learn_q15(&q, x_q15, y_q15));
                        HOLDS(fabs(y_q15 * LSB - forward - e) < 1e-9);
                        (void)dqw_learner_learn(&f, x, (float)y_q15 / 32768);
                        for (int i = 0; i < n; i++)
                            apart = fmax(apart, fabs(of_q31(q.w_q31[i]) - (double)f.w_pu[i]) / LSB);
                        if (d.indicator) apart = fmax(apart, fabs(of_q31(q.w_o_q31) - (double)f.w_o) / LSB);
                        TEST_ASSERT_EQUAL_INT32(k + 1, q.learned);
                    }
                    BETWEEN(0.0001, apart, 3.0);
                    most[mode] = fmax(most[mode], apart);
                    if (mode == 1) pulled = fmax(pulled, fabs((double)f.w_pu[0]));
                }
    for (int mode = 0; mode < 4; mode++) {
        CASE("mode %d", mode);
        BETWEEN(0.4, most[mode], 3.0);
    }
    HOLDS(pulled > 0.2);
}

// What the law is for: the plain weight is low by the noise in its input, the one that knows of it is not. The same
// samples as float.
static void test_noisy_inputs(void)
{
    for (int noisy = 0; noisy < 2; noisy++) {
        dqw_learner_config c = {.inputs = 1,
                                .step_size = 1.0f / 256,
                                .x_base = {1.0f},
                                .y_base = 1.0f,
                                .noisy_inputs = noisy == 1,
                                .indicator = true};
        const dqw_learner_config_q15 d = {
            .inputs = 1, .step_size_q15 = 128, .noisy_inputs = noisy == 1, .indicator = true};
        dqw_learner f;
        dqw_learner_q15 q;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_init(&f, &c));
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_init_q15(&q, &d));
        test_random r = {7};
        double mean[2] = {0};
        const int samples = 200000;
        for (int k = 0; k < samples; k++) {
            const double x = 0.3 * random_normal(&r);
            const int16_t x_q15 = q15(x + 0.06 * random_normal(&r));
            const int16_t y_q15 = q15(0.8 * x + 0.06 * random_normal(&r));
            const float xf = (float)x_q15 / 32768;
            (void)dqw_learner_learn(&f, &xf, (float)y_q15 / 32768);
            (void)dqw_learner_learn_q15(&q, &x_q15, y_q15);
            if (k < samples / 4) continue;
            mean[0] += (double)f.w_pu[0] / (samples - samples / 4);
            mean[1] += of_q31(q.w_q31[0]) / (samples - samples / 4);
        }
        CASE("noisy %d", noisy);
        BETWEEN(-1e-4, mean[1] - mean[0], 1e-4);
        if (noisy == 0) BETWEEN(0.94, mean[1] / 0.8, 0.98);
        if (noisy == 1) BETWEEN(0.985, mean[1] / 0.8, 1.02);
    }
}

// Errors beyond what a step may be are corrected by one of the full scale: from 1 to 0, and no further.
static void test_a_step_is_bounded(void)
{
    for (int way = -1; way <= 1; way += 2)
        for (int size = 1; size <= 2; size++) {
            const dqw_learner_config_q15 d = {.inputs = 1, .step_size_q15 = size * 30000};
            dqw_learner_q15 q;
            TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_init_q15(&q, &d));
            q.w_q31[0] = way * INT32_MAX;
            const int16_t x[1] = {INT16_MIN};
            // An error of two full scales, by 0.92 or 1.83 of them.
            BETWEEN(-1e-4, dqw_learner_learn_q15(&q, x, (int16_t)(way * INT16_MAX)) / 268435456.0 - 2 * way, 1e-4);
            CASE("way %d, size %d", way, size);
            BETWEEN(-1e-3, of_q31(q.w_q31[0]), 1e-3);
        }
}

// A truth outside the range of the weights: they stop at its edge and come back.
static void test_weights_stop_at_one_and_come_back(void)
{
    static const double outside[] = {1.5, -1.5};
    for (int k = 0; k < 2; k++)
        for (int kind = 0; kind < 2; kind++) {
            CASE("truth %g, kind %d", outside[k], kind);
            const dqw_learner_config_q15 d = {.inputs = 2, .step_size_q15 = 16384};
            dqw_learner_q15 q;
            TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_init_q15(&q, &d));
            test_random r = {3};
            for (int j = 0; j < 4000; j++) {
                const int16_t x[2] = {q15(random_uniform(&r, -0.6, 0.6)), q15(random_uniform(&r, -0.6, 0.6))};
                const double w = j < 2000 ? outside[k] : 0.25 * outside[k];
                const int16_t y = q15(w * x[0] * LSB);
                if (kind == 0)
                    (void)dqw_learner_step_pu_q15(q.w_q31, x, 2, y, 16384);
                else
                    (void)dqw_learner_learn_q15(&q, x, y);
                if (j > 1000 && j < 2000) BETWEEN(0.8, of_q31(q.w_q31[0]) * (k == 0 ? 1 : -1), 1.0);
            }
            BETWEEN(-3 * LSB, of_q31(q.w_q31[0]) - 0.25 * outside[k], 3 * LSB);
            BETWEEN(-3 * LSB, of_q31(q.w_q31[1]), 3 * LSB);
        }
}

// An error of 1.5 at a step size of 2 would move the weight by 1.2: the step is taken as a half, times the input.
static void test_a_wild_step_is_bounded(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        int32_t w = sign > 0 ? INT32_MIN : INT32_MAX;
        const int16_t x = 16384;
        const double before = of_q31(w);
        const double e = of_q28(dqw_learner_step_pu_q15(&w, &x, 1, (int16_t)(sign * 32767), 65535));
        BETWEEN(1.4999, sign * e, 1.5001);
        BETWEEN(0.2499, sign * (of_q31(w) - before), 0.2501);
    }
}

// The smallest step still moves a weight: a hundredth of a last place of the target, at 5 % of full scale and step size
// 0.001.
static void test_no_error_is_too_small(void)
{
    static const int16_t x[] = {1638, 8192, 32767};
    for (int a = 0; a < 3; a++) {
        int32_t w = (1 << 30) + (1 << 15) -
                    1;  // in the middle of 16384 and 16385: the product is wrong by half its last place
        const int32_t start = w;
        const int16_t y = (int16_t)((x[a] + 1) / 2);
        const int32_t e_q28 = dqw_learner_step_pu_q15(&w, &x[a], 1, y, 33);
        CASE("input %d, error %g last places", x[a], of_q28(e_q28) / LSB);
        const double exact = 33 * LSB * of_q28(e_q28) / (1 + x[a] * LSB * x[a] * LSB) * x[a] * LSB * 2147483648.0;
        BETWEEN(exact - 0.5 - 2 * x[a] * LSB - 1e-4 * fabs(exact), w - start,
                exact + 0.5 + 2 * x[a] * LSB + 1e-4 * fabs(exact));
    }
}

// Every shift rounds: a change that is smaller than the last place of a weight comes out right in the mean, whatever
// the sign of its error.
// Rounded down it would pull a slow learner away, by half a last place a step.
static void test_the_smallest_changes_pull_nowhere(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        test_random r = {4};
        double off = 0.0;
        const int times = 200000;
        for (int k = 0; k < times; k++) {
            const int16_t x = q15(random_uniform(&r, -0.3, 0.3));
            const int32_t start = (int32_t)(random_bits(&r) % (1u << 31)) - (1 << 30);
            int32_t w = start;
            const int16_t y = q15(of_q31(start) * x * LSB);
            const double e = of_q28(dqw_learner_step_pu_q15(&w, &x, 1, (int16_t)(y + (k & 1)), 1));
            const double exact = LSB * e / (1 + x * LSB * x * LSB) * x * LSB * 2147483648.0;
            off += sign * x > 0 ? (w - start - exact) / times : 0.0;
        }
        CASE("sign %d", sign);
        BETWEEN(-0.01, off, 0.01);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_and_leaves_the_object_alone);
    RUN_TEST(test_every_mode_takes_the_float_path);
    RUN_TEST(test_noisy_inputs);
    RUN_TEST(test_a_step_is_bounded);
    RUN_TEST(test_weights_stop_at_one_and_come_back);
    RUN_TEST(test_a_wild_step_is_bounded);
    RUN_TEST(test_no_error_is_too_small);
    RUN_TEST(test_the_smallest_changes_pull_nowhere);
    RUN_TEST(test_step_sizes_and_amplitudes);
    RUN_TEST(test_taps_at_every_step_size_and_amplitude);
    return UNITY_END();
}
