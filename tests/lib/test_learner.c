// The Learner: refusals, the energy of one step, metamorphic relations, convergence, noise on the inputs, wild samples.
#include <float.h>

#include "dqw_learner.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

static dqw_learner_config config_of(int inputs)
{
    dqw_learner_config c = {.inputs = inputs, .step_size = 0.5f, .y_base = 3.0f};
    for (int i = 0; i < DQW_LEARNER_INPUTS; i++) c.x_base[i] = 1.0f + (float)i;
    return c;
}

static void test_init_refuses_and_leaves_the_object_alone(void)
{
    dqw_learner l;
    const dqw_learner_config good = config_of(3);
    TEST_ASSERT_EQUAL_INT(DQW_ERR_NULL, dqw_learner_init(NULL, &good));
    REFUSED(l, DQW_ERR_NULL, dqw_learner_init(&l, NULL));
    static const int sizes[] = {0, -1, DQW_LEARNER_INPUTS + 1, 1000, INT32_MIN, INT32_MAX};
    for (unsigned k = 0; k < sizeof sizes / sizeof sizes[0]; k++) {
        dqw_learner_config c = good;
        c.inputs = sizes[k];
        REFUSED(l, DQW_ERR_SIZE, dqw_learner_init(&l, &c));
    }
    const float bad[] = {0.0f, -0.0f, -1.0f, NAN, INFINITY, -INFINITY, -FLT_MIN};
    for (unsigned k = 0; k < sizeof bad / sizeof bad[0]; k++) {
        dqw_learner_config c = good;
        c.step_size = bad[k];
        REFUSED(l, DQW_ERR_RANGE, dqw_learner_init(&l, &c));
        c = good;
        c.y_base = bad[k];
        REFUSED(l, DQW_ERR_RANGE, dqw_learner_init(&l, &c));
        for (int i = 0; i < 3; i++) {
            c = good;
            c.x_base[i] = bad[k];
            REFUSED(l, DQW_ERR_RANGE, dqw_learner_init(&l, &c));
        }
        // Bases beyond `inputs` are nobody's.
        c = good;
        c.x_base[3] = bad[k];
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_init(&l, &c));
    }
    dqw_learner_config c = good;
    c.step_size = 2.0f;
    REFUSED(l, DQW_ERR_RANGE, dqw_learner_init(&l, &c));
    c.step_size = nextafterf(2.0f, 0.0f);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_init(&l, &c));
    // The reciprocal of the smallest denormal is infinite.
    c = good;
    c.x_base[0] = 1e-45f;
    REFUSED(l, DQW_ERR_RANGE, dqw_learner_init(&l, &c));
    // Nor may what a weight is counted in vanish: the bases are numbers, their ratio is none.
    c = good;
    c.y_base = 1e-30f;
    c.x_base[2] = 1e30f;
    REFUSED(l, DQW_ERR_RANGE, dqw_learner_init(&l, &c));
    c.y_base = 1e30f;
    c.x_base[2] = 1e-30f;
    REFUSED(l, DQW_ERR_RANGE, dqw_learner_init(&l, &c));
}

static void test_fresh_learner_puts_out_zero_and_restores_what_is_set(void)
{
    dqw_learner l;
    const dqw_learner_config c = config_of(3);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_init(&l, &c));
    const float x[] = {1.0f, 2.0f, 3.0f};
    TEST_ASSERT_EQUAL_FLOAT(0.0f, dqw_learner_forward(&l, x));
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_set_weight(&l, 0, 0.5f));
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_set_weight(&l, 2, -4.0f));
    TEST_ASSERT_EQUAL_FLOAT(-4.0f, dqw_learner_weight(&l, 2));
    TEST_ASSERT_EQUAL_FLOAT(0.5f - 12.0f, dqw_learner_forward(&l, x));
    const dqw_learner before = l;
    TEST_ASSERT_EQUAL_INT(DQW_ERR_SIZE, dqw_learner_set_weight(&l, 3, 1.0f));
    TEST_ASSERT_EQUAL_INT(DQW_ERR_SIZE, dqw_learner_set_weight(&l, -1, 1.0f));
    TEST_ASSERT_EQUAL_INT(DQW_ERR_RANGE, dqw_learner_set_weight(&l, 0, NAN));
    TEST_ASSERT_EQUAL_INT(DQW_ERR_RANGE, dqw_learner_set_weight(&l, 0, INFINITY));
    TEST_ASSERT_EQUAL_INT(DQW_ERR_NULL, dqw_learner_set_weight(NULL, 0, 1.0f));
    TEST_ASSERT_EQUAL_MEMORY(&before, &l, sizeof l);
    TEST_ASSERT_TRUE(isnan(dqw_learner_weight(&l, 3)));
    TEST_ASSERT_TRUE(isnan(dqw_learner_weight(&l, -1)));
}

// Of as many inputs as there are, each in its own unit.
static void test_all_inputs(void)
{
    dqw_learner l;
    const dqw_learner_config c = config_of(DQW_LEARNER_INPUTS);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_init(&l, &c));
    for (int i = 0; i < DQW_LEARNER_INPUTS; i++) TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_set_weight(&l, i, 2.0f));
    TEST_ASSERT_EQUAL_FLOAT(DQW_LEARNER_INPUTS * (DQW_LEARNER_INPUTS + 1.0f), dqw_learner_forward(&l, c.x_base));
    for (int i = 0; i < DQW_LEARNER_INPUTS; i++)
        HOLDS(l.w_pu[i] > 0.65f * c.x_base[i] && l.w_pu[i] < 0.67f * c.x_base[i]);
}

// After a step the same sample's error is (1 - mu |x|^2 / (norm + floor)) times what it was, the constant input in the
// norm where there is one; and the distance to any exact solution falls by mu (2 - mu s) e^2 / norm, s = |x|^2 / norm.
static void test_energy_of_one_step(void)
{
    test_random r = {5};
    for (int k = 0; k < scaled(20000); k++) {
        CASE("step %d", k);
        dqw_learner_config c = config_of(1 + k % 6);
        c.step_size = (float)random_uniform(&r, 0.05, 1.95);
        c.indicator = k % 2 == 0;
        dqw_learner l;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_init(&l, &c));
        float x[6];
        double truth[6];
        double size = 0.0;
        double target = 0.0;
        double distance = 0.0;
        for (int i = 0; i < c.inputs; i++) {
            l.w_pu[i] = (float)random_normal(&r);
            x[i] = (float)(random_normal(&r) * c.x_base[i]);
            truth[i] = random_normal(&r);
            const double x_pu = (double)x[i] / c.x_base[i];
            size += x_pu * x_pu;
            target += truth[i] * x_pu * c.y_base;
            distance += (truth[i] - l.w_pu[i]) * (truth[i] - l.w_pu[i]);
        }
        const double norm = size + (c.indicator ? 1.0 : 0.0) + 1e-6;
        const double e = dqw_learner_learn(&l, x, (float)target);
        const double after = (double)(float)target - dqw_learner_forward(&l, x);
        const double expected = (1.0 - c.step_size * size / norm) * e;
        BETWEEN(expected - 1e-4, after, expected + 1e-4);
        double left = 0.0;
        for (int i = 0; i < c.inputs; i++) left += (truth[i] - l.w_pu[i]) * (truth[i] - l.w_pu[i]);
        const double e_pu = e / c.y_base;
        const double fall = c.step_size * (2.0 - c.step_size * size / norm) * e_pu * e_pu / norm;
        BETWEEN(fall - 1e-4 * (1 + distance), distance - left, fall + 1e-4 * (1 + distance));
    }
}

typedef struct run {
    dqw_learner l;
    double truth[6];
} run;

// Learn y = truth . x from `samples` random samples; order[] says which input is which; bases are scaled by `scale`.
static run learn_linear(int inputs, const int order[], double scale, int samples, uint64_t seed)
{
    run out;
    dqw_learner_config c = config_of(inputs);
    for (int i = 0; i < inputs; i++) {
        c.x_base[i] = (float)(scale * (1 + order[i]));
        out.truth[i] = 0.3 + order[i];
    }
    c.y_base = 3.0f;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_init(&out.l, &c));
    test_random r = {seed};
    for (int k = 0; k < samples; k++) {
        double all[6];
        for (int i = 0; i < inputs; i++) all[i] = random_normal(&r) * (1 + i);
        float x[6];
        double y = 0.0;
        for (int i = 0; i < inputs; i++) {
            x[i] = (float)all[order[i]];
            y += out.truth[i] * x[i];
        }
        (void)dqw_learner_learn(&out.l, x, (float)y);
    }
    return out;
}

static void test_converges_to_the_truth_without_noise(void)
{
    static const int order[] = {0, 1, 2, 3, 4, 5};
    for (int n = 1; n <= 6; n++) {
        CASE("%d inputs", n);
        run a = learn_linear(n, order, 1.0, 2000, 6);
        for (int i = 0; i < n; i++) BETWEEN(-1e-5, dqw_learner_weight(&a.l, i) / a.truth[i] - 1, 1e-5);  // 4e-7
        TEST_ASSERT_EQUAL_UINT32(2000, a.l.learned);
        TEST_ASSERT_EQUAL_UINT32(0, a.l.skipped);
    }
}

static void test_permuted_inputs_permute_the_weights(void)
{
    static const int straight[] = {0, 1, 2, 3, 4, 5};
    static const int turned[] = {4, 2, 5, 0, 3, 1};
    run a = learn_linear(6, straight, 1.0, 60, 7);
    run b = learn_linear(6, turned, 1.0, 60, 7);
    for (int i = 0; i < 6; i++) {
        CASE("input %d", i);
        const double one = dqw_learner_weight(&a.l, turned[i]);
        BETWEEN(one - 1e-5, dqw_learner_weight(&b.l, i), one + 1e-5);
    }
}

// Scaling every input's base and the target's by powers of two changes no rounding, and so not one bit of a restored
// weight.
static void test_scaled_bases_leave_the_restored_weights_alone(void)
{
    test_random r = {8};
    dqw_learner_config c = config_of(4);
    dqw_learner_config d = c;
    c.indicator = d.indicator = true;
    d.y_base *= 8.0f;
    dqw_learner a;
    dqw_learner b;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_init(&a, &c));
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_init(&b, &d));
    for (int k = 0; k < 100; k++) {
        float x[4];
        for (int i = 0; i < 4; i++) x[i] = (float)random_normal(&r);
        const float y = (float)random_normal(&r);
        const float e = dqw_learner_learn(&a, x, y);
        TEST_ASSERT_EQUAL_FLOAT(e, dqw_learner_learn(&b, x, y));
    }
    for (int i = 0; i < 4; i++) TEST_ASSERT_EQUAL_FLOAT(dqw_learner_weight(&a, i), dqw_learner_weight(&b, i));
    // Inputs and their bases together: the same per-unit signals, weights in the other unit.
    run one = learn_linear(4, (const int[]){0, 1, 2, 3}, 1.0, 3000, 9);
    run two = learn_linear(4, (const int[]){0, 1, 2, 3}, 4.0, 3000, 9);
    for (int i = 0; i < 4; i++) BETWEEN(-1e-4, dqw_learner_weight(&two.l, i) / dqw_learner_weight(&one.l, i) - 1, 1e-4);
}

// y = 0.8 x, inputs and target with white noise of the same size per unit; the step falls as one over the samples.
static double noisy_weight(bool noisy_inputs, double noise, int samples, uint64_t seed, double *expected)
{
    dqw_learner_config c = config_of(1);
    c.x_base[0] = 1.0f;
    c.y_base = 1.0f;
    c.indicator = true;
    c.noisy_inputs = noisy_inputs;
    dqw_learner l;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_init(&l, &c));
    test_random r = {seed};
    double xy = 0.0;
    double xx = 0.0;
    for (int k = 0; k < samples; k++) {
        const double s = random_normal(&r);
        const double x = s + noise * random_normal(&r);
        const double y = 0.8 * s + noise * random_normal(&r);
        const float in = (float)x;
        l.step_size = (float)(0.5 / (1.0 + 0.25 * fmax(0.0, k - 100.0)));
        (void)dqw_learner_learn(&l, &in, (float)y);
        xy += x * y / (1.0 + x * x);
        xx += x * x / (1.0 + x * x);
    }
    *expected = xy / xx;  // what the normalised step without regard to the inputs' noise must end at
    return dqw_learner_weight(&l, 0);
}

static void test_noisy_inputs_attenuate_the_plain_step_alone(void)
{
    double expected;
    const double plain_10 = noisy_weight(false, 0.1, 200000, 10, &expected) / 0.8;
    // The plain weight is low by the noise in its inputs, 1 / (1 + x^2): 0.9901 and 0.9615.
    BETWEEN(0.986, plain_10, 0.994);  // 0.9901
    BETWEEN(0.999, plain_10 * 0.8 / expected, 1.001);
    const double plain_20 = noisy_weight(false, 0.2, 200000, 11, &expected) / 0.8;
    BETWEEN(0.958, plain_20, 0.966);  // 0.9621
    BETWEEN(0.999, plain_20 * 0.8 / expected, 1.001);
    const double total_10 = noisy_weight(true, 0.1, 200000, 12, &expected) / 0.8;
    BETWEEN(0.999, total_10, 1.007);  // 1.0046: the norm, which has the noise in it, leaves a small bias of its own
    const double total_20 = noisy_weight(true, 0.2, 200000, 13, &expected) / 0.8;
    BETWEEN(0.995, total_20, 1.022);  // 1.0187
}

static void test_indicator_becomes_the_mean_error_and_zero_when_done(void)
{
    dqw_learner_config c = config_of(1);
    c.x_base[0] = 1.0f;
    c.y_base = 1.0f;
    c.indicator = true;
    dqw_learner l;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_init(&l, &c));
    test_random r = {14};
    // Inputs of random sign cannot explain a constant 0.25: it stays as the mean error.
    l.step_size = 0.01f;
    double mean = 0.0;
    for (int k = 0; k < 40000; k++) {
        const float x = (float)random_normal(&r);
        const float y = 0.5f * x + 0.25f;
        (void)dqw_learner_learn(&l, &x, y);
        if (k >= 20000) mean += l.w_o / 20000.0;
    }
    BETWEEN(0.24, mean, 0.26);  // 0.25
    for (int k = 0; k < 4000; k++) {
        const float x = (float)random_normal(&r);
        (void)dqw_learner_learn(&l, &x, 0.5f * x);
    }
    BETWEEN(-1e-4, l.w_o, 1e-4);
    // It is no part of the output.
    l.w_o = 100.0f;
    const float zero = 0.0f;
    TEST_ASSERT_EQUAL_FLOAT(0.0f, dqw_learner_forward(&l, &zero));
}

static void test_samples_that_are_no_numbers_are_counted_and_change_nothing(void)
{
    dqw_learner_config c = config_of(2);
    c.indicator = true;
    for (int mode = 0; mode < 2; mode++) {
        c.noisy_inputs = mode == 1;
        dqw_learner l;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_init(&l, &c));
        const float good[] = {1.0f, 2.0f};
        (void)dqw_learner_learn(&l, good, 1.0f);
        dqw_learner before = l;
        const float odd[] = {NAN, INFINITY, -INFINITY, FLT_MAX};
        for (int k = 0; k < 4; k++)
            for (int place = 0; place < 3; place++) {
                float x[] = {1.0f, 2.0f};
                float y = 1.0f;
                if (place < 2)
                    x[place] = odd[k];
                else if (k == 3)
                    continue;  // the largest finite target is learned, within limits
                else
                    y = odd[k];
                TEST_ASSERT_EQUAL_FLOAT(0.0f, dqw_learner_learn(&l, x, y));
                before.skipped++;
                TEST_ASSERT_EQUAL_MEMORY(&before, &l, sizeof l);
            }
    }
}

// One sample of any finite size moves the weights by a bounded step, from which they come back.
static void test_a_wild_sample_does_not_wedge_it(void)
{
    static const float sizes[] = {1e3f, 1e6f, 1e12f, 1e18f, 1e19f, 1e25f, 1e30f, 3e38f};
    for (unsigned k = 0; k < 4 * sizeof sizes / sizeof sizes[0]; k++) {
        const float size = sizes[k / 4];
        CASE("a sample of %g, in %s, %s", (double)size, k % 2 ? "the target" : "an input",
             k / 2 % 2 ? "noisy" : "plain");
        dqw_learner_config c = config_of(2);
        c.noisy_inputs = k / 2 % 2 == 1;
        c.indicator = true;
        dqw_learner l;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_init(&l, &c));
        test_random r = {15 + k};
        for (int n = 0; n < 20000; n++) {
            float x[] = {(float)random_normal(&r), (float)(2 * random_normal(&r))};
            float y = 1.5f * x[0] - 0.25f * x[1];
            if (n < 10) {
                if (k % 2)
                    y = size;
                else
                    x[n % 2] = size;
            }
            (void)dqw_learner_learn(&l, x, y);
        }
        BETWEEN(1.4999, dqw_learner_weight(&l, 0), 1.5001);
        BETWEEN(-0.2501, dqw_learner_weight(&l, 1), -0.2499);
    }
}

// With noisy inputs a sample counts by the inputs' expected power, until half of the step would more than mirror the
// error: from there on by its own, and the weight then moves to twice what would explain the sample. (E6)
static void test_a_large_sample_of_noisy_inputs_mirrors_the_error_at_most(void)
{
    static const double x[] = {0.5, 1.5, 2.5, 4.0, 30.0};
    for (int k = 0; k < 5; k++) {
        dqw_learner_config c = config_of(1);
        c.noisy_inputs = true;
        c.step_size = 0.5f;
        c.x_base[0] = c.y_base = 1.0f;
        dqw_learner l;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_init(&l, &c));
        const float in = (float)x[k];
        (void)dqw_learner_learn(&l, &in, 0.25f);
        const double norm = fmax(c.indicator ? 2.0 : 1.0, 0.5 * 0.5 * (x[k] * x[k] + (c.indicator ? 1.0 : 0.0)));
        CASE("an input of %g", x[k]);
        BETWEEN(1 - 1e-5, (double)l.w_pu[0] / (0.5 * 0.25 / norm * x[k]), 1 + 1e-5);
    }
}

static void test_a_wild_target_moves_the_weights_by_a_bounded_step(void)
{
    const dqw_learner_config c = config_of(1);
    dqw_learner l;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_init(&l, &c));
    const float x = 2.0f;
    (void)dqw_learner_learn(&l, &x, 3e38f);
    // 0.5 times 1000 bases over the input, per unit
    BETWEEN(249.9, l.w_pu[0], 250.1);
}

static void test_counters_stop_at_their_maximum(void)
{
    dqw_learner l;
    const dqw_learner_config c = config_of(1);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_init(&l, &c));
    l.learned = l.skipped = UINT32_MAX;
    const float x = 1.0f;
    (void)dqw_learner_learn(&l, &x, 1.0f);
    (void)dqw_learner_learn(&l, &x, NAN);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, l.learned);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, l.skipped);
}

// The neuron for the interrupt takes the same path as the Learner with unit bases whose constant input is counted in
// the norm.
static void test_the_plain_step_takes_the_same_path(void)
{
    for (int n = 1; n <= DQW_LEARNER_INPUTS && n <= 6; n++) {
        dqw_learner_config c = {.inputs = n, .step_size = 0.5f, .y_base = 1.0f, .indicator = true};
        for (int i = 0; i < n; i++) c.x_base[i] = 1.0f;
        dqw_learner l;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_init(&l, &c));
        float w[DQW_LEARNER_INPUTS] = {0};
        test_random r = {(uint64_t)(60 + n)};
        double worst = 0.0;
        double moved = 0.0;
        for (int k = 0; k < scaled(20000); k++) {
            CASE("%d inputs, step %d", n, k);
            float x[DQW_LEARNER_INPUTS];
            const double size = pow(10, random_uniform(&r, -3, 1));
            double y = 0.3 * random_normal(&r);
            for (int i = 0; i < n; i++) {
                x[i] = (float)(size * random_normal(&r));
                y += (i + 1) * sin(1e-3 * k) * (double)x[i];
            }
            const float before = w[0];
            const float e_l = dqw_learner_learn(&l, x, (float)y);
            const float e = dqw_learner_step_pu(w, x, n, (float)y, 0.5f);
            moved += fabs((double)(w[0] - before));
            // A wild error counts as one of 1000 bases there, and as none here.
            HOLDS(fabs((double)e) < 1e3);
            BETWEEN(-2e-4, (double)(e - e_l), 2e-4);  // rounding of a target up to 500
            for (int i = 0; i < n; i++) worst = fmax(worst, fabs((double)(w[i] - l.w_pu[i])));
        }
        CASE("%d inputs", n);
        // The floor that keeps the Learner's norm off zero is a millionth of the constant input's; and rounding.
        BETWEEN(1e-7, worst, 5e-6);  // 3.6e-7 to 1.4e-6
        HOLDS(moved > 10.0);
    }
}

static void test_the_plain_step_learns_nothing_from_wild_samples(void)
{
    static const float bad[] = {NAN, INFINITY, -INFINITY, 1e30f, -1e30f, FLT_MAX};
    for (int n = 1; n <= 6; n++)
        for (int at = 0; at <= n; at++)
            for (int b = 0; b < 6; b++) {
                CASE("%d inputs, %g at %d", n, (double)bad[b], at);
                float w[6] = {0.5f, -1.0f, 0.25f, 2.0f, -0.125f, 1.0f};
                float before[6];
                memcpy(before, w, sizeof w);
                float x[6] = {1.0f, 0.5f, -0.5f, 1.0f, 0.25f, -1.0f};
                float y = 3.0f;
                *(at == n ? &y : &x[at]) = bad[b];
                (void)dqw_learner_step_pu(w, x, n, y, 0.5f);
                TEST_ASSERT_EQUAL_MEMORY(before, w, sizeof w);
            }
    // Up to the limit of the error it learns, beyond it does not.
    for (int sign = -1; sign <= 1; sign += 2) {
        float w = 0.0f;
        const float x = 1.0f;
        const float beyond = (float)sign * nextafterf(1000.0f, 2000.0f);
        HOLDS(dqw_learner_step_pu(&w, &x, 1, beyond, 0.5f) == beyond && w == 0.0f);
        HOLDS(dqw_learner_step_pu(&w, &x, 1, (float)sign * 1000.0f, 0.5f) == (float)sign * 1000.0f &&
              fabsf(w - (float)sign * 250.0f) < 1e-3f);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_and_leaves_the_object_alone);
    RUN_TEST(test_fresh_learner_puts_out_zero_and_restores_what_is_set);
    RUN_TEST(test_all_inputs);
    RUN_TEST(test_energy_of_one_step);
    RUN_TEST(test_converges_to_the_truth_without_noise);
    RUN_TEST(test_permuted_inputs_permute_the_weights);
    RUN_TEST(test_scaled_bases_leave_the_restored_weights_alone);
    RUN_TEST(test_noisy_inputs_attenuate_the_plain_step_alone);
    RUN_TEST(test_indicator_becomes_the_mean_error_and_zero_when_done);
    RUN_TEST(test_samples_that_are_no_numbers_are_counted_and_change_nothing);
    RUN_TEST(test_a_wild_sample_does_not_wedge_it);
    RUN_TEST(test_a_large_sample_of_noisy_inputs_mirrors_the_error_at_most);
    RUN_TEST(test_a_wild_target_moves_the_weights_by_a_bounded_step);
    RUN_TEST(test_counters_stop_at_their_maximum);
    RUN_TEST(test_the_plain_step_takes_the_same_path);
    RUN_TEST(test_the_plain_step_learns_nothing_from_wild_samples);
    return UNITY_END();
}
