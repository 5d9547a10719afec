// The gain against batch least squares in double, and its positive definiteness under any inputs.
#include <float.h>

#include "dqw_gain.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

static void test_init_refuses_and_leaves_the_object_alone(void)
{
    dqw_gain g;
    TEST_ASSERT_EQUAL_INT(DQW_ERR_NULL, dqw_gain_init(NULL, 2, 1.0f));
    static const int sizes[] = {0, -1, DQW_LEARNER_INPUTS + 1, INT32_MAX, INT32_MIN};
    for (unsigned k = 0; k < sizeof sizes / sizeof sizes[0]; k++)
        REFUSED(g, DQW_ERR_SIZE, dqw_gain_init(&g, sizes[k], 1.0f));
    const float bad[] = {0.0f, -0.0f, -1.0f, NAN, INFINITY, -INFINITY};
    for (unsigned k = 0; k < sizeof bad / sizeof bad[0]; k++) REFUSED(g, DQW_ERR_RANGE, dqw_gain_init(&g, 2, bad[k]));
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_gain_init(&g, 3, 100.0f));
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) TEST_ASSERT_EQUAL_FLOAT(i == j ? 100.0f : 0.0f, dqw_gain_covariance(&g, i, j));
}

typedef struct difference {
    double weight;      ///< largest |w / w_ls - 1|
    double covariance;  ///< largest |P_ij - P_ij,ls| / sqrt(P_ii P_jj)
} difference;

// Regressors mixed by a random matrix after scaling by 1 .. 1/condition. Ridge 1 / p0 in the batch: the same problem
// exactly.
static difference compare(int n, int samples, double condition, double noise, uint64_t seed)
{
    const double p0 = 1e6;
    test_random r = {seed};
    double mix[6][6];
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) mix[i][j] = (i == j ? 1.0 : 0.0) + 0.5 * random_normal(&r) / n;
    dqw_gain g;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_gain_init(&g, n, (float)p0));
    float w[6] = {0};
    double truth[6];
    for (int i = 0; i < n; i++) truth[i] = random_uniform(&r, 0.5, 1.5);
    test_ls ls;
    ls_begin(&ls, n, 1.0 / p0);
    for (int k = 0; k < samples; k++) {
        double z[6];
        float x[6];
        double xd[6];
        for (int i = 0; i < n; i++) z[i] = random_normal(&r) * (n > 1 ? pow(condition, -(double)i / (n - 1)) : 1.0);
        double y = noise * random_normal(&r);
        for (int i = 0; i < n; i++) {
            double sum = 0.0;
            for (int j = 0; j < n; j++) sum += mix[i][j] * z[j];
            x[i] = (float)sum;
            xd[i] = x[i];
            y += truth[i] * xd[i];
        }
        y = (float)y;
        ls_add(&ls, xd, y);
        float gain[6];
        float e = (float)y;
        for (int i = 0; i < n; i++) e -= w[i] * x[i];
        dqw_gain_step(&g, x, gain);
        for (int i = 0; i < n; i++) w[i] += gain[i] * e;
    }
    double best[LS_MAX];
    double inverse[LS_MAX][LS_MAX];
    (void)ls_solve(&ls, best, inverse);
    difference d = {0, 0};
    for (int i = 0; i < n; i++) {
        d.weight = fmax(d.weight, fabs(w[i] - best[i]) / fabs(best[i]));
        for (int j = 0; j < n; j++) {
            const double off = dqw_gain_covariance(&g, i, j) - inverse[i][j];
            d.covariance = fmax(d.covariance, fabs(off) / sqrt(inverse[i][i] * inverse[j][j]));
        }
    }
    return d;
}

static difference larger(difference a, difference b)
{
    const difference d = {fmax(a.weight, b.weight), fmax(a.covariance, b.covariance)};
    return d;
}

static void test_weights_and_covariances_are_those_of_batch_least_squares(void)
{
    static const int counts[] = {1000, 10000, 100000};
    // Rounding adds up over the samples: the worst of six was 1.0e-6, 5.8e-6, 1.5e-5, and 1.3e-6, 1.5e-5, 6.1e-5.
    static const double weight[] = {3e-6, 1.5e-5, 4e-5};
    static const double covariance[] = {4e-6, 4e-5, 2e-4};
    for (int c = 0; c < 3; c++) {
        difference worst = {0, 0};
        for (int n = 1; n <= 6; n++) worst = larger(worst, compare(n, counts[c], 1.0, 0.1, (uint64_t)(100 * c + n)));
        CASE("%d samples", counts[c]);
        BETWEEN(weight[c] / 10, worst.weight, weight[c]);
        BETWEEN(covariance[c] / 10, worst.covariance, covariance[c]);
    }
}

// p0 I less p0² x x'/(1 + p0 x'x), with as many inputs as there is room for: nothing behind the last one counts.
static void test_covariances_of_all_inputs_that_there_is_room_for(void)
{
    const int n = DQW_LEARNER_INPUTS;
    const double p0 = 4.0;
    dqw_gain g;
    float x[DQW_LEARNER_INPUTS];
    float gain[DQW_LEARNER_INPUTS];
    double square = 0.0;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_gain_init(&g, n, (float)p0));
    for (int i = 0; i < n; i++) {
        x[i] = 1.0f + 0.25f * (float)i;
        square += x[i] * (double)x[i];
    }
    dqw_gain_step(&g, x, gain);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            const double p = (i == j ? p0 : 0.0) - p0 * p0 * x[i] * (double)x[j] / (1.0 + p0 * square);
            CASE("%d, %d", i, j);
            TEST_ASSERT_DOUBLE_WITHIN(1e-6 * p0, p, dqw_gain_covariance(&g, i, j));
        }
}

static void test_ill_conditioned_regressors(void)
{
    static const double conditions[] = {1e1, 1e2, 1e3, 1e4};
    // The error of single precision grows with the condition number of the regressors, not with its square: the worst
    // of five was 1.2e-6, 2.9e-6, 6.3e-5, 1.1e-4.
    static const double weight[] = {4e-6, 1e-5, 2e-4, 4e-4};
    for (int c = 0; c < 4; c++) {
        difference worst = {0, 0};
        for (int n = 2; n <= 6; n++)
            worst = larger(worst, compare(n, 10000, conditions[c], 0.0, (uint64_t)(1000 * c + n)));
        CASE("condition %g", conditions[c]);
        BETWEEN(weight[c] / 10, worst.weight, weight[c]);
        BETWEEN(3e-6, worst.covariance, 5e-4);  // 1.9e-5 to 1.5e-4
    }
}

static void test_an_input_of_zero_leaves_its_variance_alone(void)
{
    dqw_gain g;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_gain_init(&g, 4, 1e6f));
    test_random r = {20};
    for (int k = 0; k < 10000; k++) {
        float x[] = {(float)random_normal(&r), 0.0f, (float)random_normal(&r), 0.0f};
        float gain[4];
        dqw_gain_step(&g, x, gain);
        TEST_ASSERT_EQUAL_FLOAT(0.0f, gain[1]);
        TEST_ASSERT_EQUAL_FLOAT(0.0f, gain[3]);
    }
    TEST_ASSERT_EQUAL_FLOAT(1e6f, dqw_gain_covariance(&g, 1, 1));
    TEST_ASSERT_EQUAL_FLOAT(1e6f, dqw_gain_covariance(&g, 3, 3));
    for (int i = 0; i < 4; i++)
        if (i != 1) TEST_ASSERT_EQUAL_FLOAT(0.0f, dqw_gain_covariance(&g, 1, i));
}

// Inputs of any size that the documentation allows, zeros and denormals among them.
static void test_variances_stay_positive(void)
{
    static const double largest[] = {2, 6, 8.9};  // powers of ten
    for (int c = 0; c < 3; c++)
        for (int n = 1; n <= 6; n++) {
            dqw_gain g;
            TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_gain_init(&g, n, 1e6f));
            test_random r = {(uint64_t)(300 + 10 * c + n)};
            for (int k = 0; k < scaled(60000); k++) {
                CASE("%d inputs up to 1e%g, step %d", n, largest[c], k);
                float x[6];
                float gain[6];
                for (int i = 0; i < n; i++) {
                    const uint64_t kind = random_bits(&r) % 8;
                    x[i] = kind == 0   ? 0.0f
                           : kind == 1 ? 1e-42f
                                       : (float)(random_normal(&r) < 0 ? -1 : 1) *
                                             (float)pow(10, random_uniform(&r, -20, largest[c]));
                }
                dqw_gain_step(&g, x, gain);
                for (int i = 0; i < n; i++) {
                    HOLDS(g.d[i] > 0.0f && isfinite(g.d[i]));
                    HOLDS(isfinite(gain[i]));
                    HOLDS(isfinite(dqw_gain_covariance(&g, i, i)) && dqw_gain_covariance(&g, i, i) > 0.0f);
                }
            }
        }
}

// P in long double, dense, by the textbook's equations.
typedef struct dense {
    int n;
    long double p[6][6];
} dense;

static void dense_step(dense *d, const float x[])
{
    long double px[6] = {0};
    long double alpha = 1.0L;
    for (int i = 0; i < d->n; i++) {
        for (int j = 0; j < d->n; j++) px[i] += d->p[i][j] * (long double)x[j];
        alpha += px[i] * (long double)x[i];
    }
    for (int i = 0; i < d->n; i++)
        for (int j = 0; j < d->n; j++) d->p[i][j] -= px[i] * px[j] / alpha;
}

// Largest |P_ij - P_ij,dense| / sqrt(P_ii P_jj), and the same of P z for a z that is as large in every direction that P
// has.
static difference against_dense(const dqw_gain *g, const dense *d, test_random *r)
{
    difference off = {0, 0};
    float z[6];
    float out[6] = {0};
    double pz[6] = {0};
    double size = 0.0;
    for (int i = 0; i < d->n; i++) z[i] = (float)(random_normal(r) / sqrt((double)d->p[i][i]));
    dqw_gain_apply(g, z, out);
    for (int i = 0; i < d->n; i++)
        for (int j = 0; j < d->n; j++) {
            const double scale = sqrt((double)(d->p[i][i] * d->p[j][j]));
            off.covariance = fmax(off.covariance,
                                  fabs((double)dqw_gain_covariance(g, i, j) - (double)d->p[i][j]) / scale);
            pz[i] += (double)d->p[i][j] * (double)z[j];
        }
    for (int i = 0; i < d->n; i++) size = fmax(size, fabs((double)z[i]) * sqrt((double)d->p[i][i]));
    for (int i = 0; i < d->n; i++)
        off.weight = fmax(off.weight, fabs((double)out[i] - pz[i]) / sqrt((double)d->p[i][i]) / size);
    return off;
}

// Steps, and in between variances that grow, by far less to far more than there is.
static void test_apply_and_grow_are_those_of_a_dense_matrix(void)
{
    static const double grown[] = {1e-6, 1e-3, 1.0, 10.0};  // largest part by which a variance grows in a step
    // Growth forgets rounding with the rest: the worst of six was 3.1e-6, 4.5e-6, 5.8e-7, 5.1e-7, and 3.7e-6, 4.6e-6,
    // 5.4e-7, 5.6e-7. Beyond, a thousand times a step, P is as good as singular in between, and single precision keeps
    // 5 %.
    static const double weight[] = {1e-5, 1.4e-5, 2e-6, 2e-6};
    static const double covariance[] = {1e-5, 1.4e-5, 2e-6, 2e-6};
    for (int c = 0; c < 4; c++) {
        difference worst = {0, 0};
        for (int n = 1; n <= 6; n++) {
            test_random r = {(uint64_t)(500 + 10 * c + n)};
            dqw_gain g;
            TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_gain_init(&g, n, 100.0f));
            dense d = {.n = n};
            for (int i = 0; i < n; i++) d.p[i][i] = 100.0;
            for (int k = 0; k < 2000; k++) {
                float x[6];
                float gain[6];
                for (int i = 0; i < n; i++) x[i] = (float)(random_normal(&r) * (i % 2 ? 0.1 : 1.0));
                dqw_gain_step(&g, x, gain);
                dense_step(&d, x);
                const int i = (int)(random_bits(&r) % (uint64_t)n);
                const float q = (float)(d.p[i][i] * grown[c] * random_uniform(&r, 0.0, 1.0));
                dqw_gain_grow(&g, i, q);
                d.p[i][i] += (long double)q;
                if (k % 10 == 0) worst = larger(worst, against_dense(&g, &d, &r));
            }
        }
        CASE("growth up to %g", grown[c]);
        BETWEEN(weight[c] / 10, worst.weight, weight[c]);
        BETWEEN(covariance[c] / 10, worst.covariance, covariance[c]);
    }
}

// Two inputs: the product by hand, and nothing behind the last.
static void test_apply_writes_its_inputs_alone(void)
{
    dqw_gain g;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_gain_init(&g, 2, 4.0f));
    const float x[2] = {1.0f, 2.0f};
    float k[2];
    dqw_gain_step(&g, x, k);
    const float z[3] = {3.0f, -1.0f, 7.0f};
    float out[3] = {0.0f, 0.0f, 5.0f};
    dqw_gain_apply(&g, z, out);
    for (int i = 0; i < 2; i++) {
        const double by_hand = 3.0 * (double)dqw_gain_covariance(&g, i, 0) - (double)dqw_gain_covariance(&g, i, 1);
        BETWEEN(by_hand - 1e-5, (double)out[i], by_hand + 1e-5);
    }
    TEST_ASSERT_EQUAL_FLOAT(5.0f, out[2]);
}

static void test_growth_of_nothing_changes_nothing(void)
{
    dqw_gain g;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_gain_init(&g, 6, 10.0f));
    test_random r = {40};
    float gain[6];
    for (int k = 0; k < 20; k++) {
        float x[6];
        for (int i = 0; i < 6; i++) x[i] = (float)random_normal(&r);
        dqw_gain_step(&g, x, gain);
    }
    const dqw_gain before = g;
    for (int i = 0; i < 6; i++) {
        dqw_gain_grow(&g, i, 0.0f);
        TEST_ASSERT_EQUAL_MEMORY(&before, &g, sizeof g);
    }
    // One that grows by much leaves the others' variances, and what ties them, where they were.
    for (int i = 0; i < 6; i++) {
        dqw_gain h = before;
        dqw_gain_grow(&h, i, 5.0f);
        for (int a = 0; a < 6; a++)
            for (int b = 0; b < 6; b++) {
                CASE("grown %d, element %d %d", i, a, b);
                const double was = (double)dqw_gain_covariance(&before, a, b) + (a == i && b == i ? 5.0 : 0.0);
                const double scale = sqrt((double)dqw_gain_covariance(&h, a, a) *
                                          (double)dqw_gain_covariance(&h, b, b));
                BETWEEN(-1e-6, ((double)dqw_gain_covariance(&h, a, b) - was) / scale, 1e-6);
            }
    }
}

static void test_variances_stay_positive_over_mixed_steps_and_growth(void)
{
    for (int n = 1; n <= 6; n++) {
        dqw_gain g;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_gain_init(&g, n, 1e6f));
        test_random r = {(uint64_t)(700 + n)};
        for (int k = 0; k < scaled(100000); k++) {
            CASE("%d inputs, step %d", n, k);
            float x[6];
            float gain[6];
            for (int i = 0; i < n; i++)
                x[i] = random_bits(&r) % 8 == 0 ? 0.0f
                                                : (float)(random_normal(&r) * pow(10, random_uniform(&r, -10, 4)));
            dqw_gain_step(&g, x, gain);
            dqw_gain_grow(&g, (int)(random_bits(&r) % (uint64_t)n), (float)pow(10, random_uniform(&r, -30, 6)));
            for (int i = 0; i < n; i++) {
                HOLDS(g.d[i] > 0.0f && isfinite(g.d[i]) && isfinite(gain[i]));
                HOLDS(isfinite(dqw_gain_covariance(&g, i, i)) && dqw_gain_covariance(&g, i, i) > 0.0f);
                for (int j = 0; j < i; j++) {
                    const double rho = (double)dqw_gain_covariance(&g, i, j) /
                                       sqrt((double)dqw_gain_covariance(&g, i, i) *
                                            (double)dqw_gain_covariance(&g, j, j));
                    HOLDS(fabs(rho) <= 1.0001);
                }
            }
        }
    }
}

// P + q a a' of the first n weights, a zero behind them, against the same in double; over and over, with updates
// between.
static void test_growing_along_a_vector(void)
{
    enum { MOST = 6 };
    test_random r = {77};
    double worst = 0.0;
    for (int run = 0; run < scaled(400); run++) {
        const int inputs = 1 + (int)(random_bits(&r) % MOST);
        dqw_gain g;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_gain_init(&g, inputs, (float)pow(10, random_uniform(&r, -2, 4))));
        for (int step = 0; step < 6; step++) {
            CASE("run %d, step %d, %d inputs", run, step, inputs);
            float x[DQW_LEARNER_INPUTS] = {0};
            float k[DQW_LEARNER_INPUTS];
            for (int i = 0; i < inputs; i++) x[i] = (float)random_normal(&r);
            dqw_gain_step(&g, x, k);
            double expected[MOST][MOST];
            const int n = (int)(random_bits(&r) % (uint64_t)(inputs + 1));
            const double q = random_bits(&r) % 5 == 0 ? 0.0 : pow(10, random_uniform(&r, -4, 3));
            float a[DQW_LEARNER_INPUTS] = {0};
            for (int i = 0; i < n; i++) a[i] = random_bits(&r) % 4 == 0 ? 0.0f : (float)random_normal(&r);
            for (int i = 0; i < inputs; i++)
                for (int j = 0; j < inputs; j++)
                    expected[i][j] = (double)dqw_gain_covariance(&g, i, j) +
                                     (double)(float)q * (double)a[i] * (double)a[j];
            dqw_gain_grow_along(&g, a, n, (float)q);
            for (int i = 0; i < inputs; i++) {
                HOLDS(g.d[i] > 0.0f);
                for (int j = 0; j < inputs; j++)
                    worst = fmax(worst, fabs((double)dqw_gain_covariance(&g, i, j) - expected[i][j]) /
                                            sqrt(expected[i][i] * expected[j][j]));
            }
        }
    }
    test_case[0] = 0;
    BETWEEN(1e-8, worst, 1e-5);  // 1.4e-6
}

// What was learned before counts for a quarter: batch least squares whose first half weighs a quarter. (E194)
static void test_what_is_forgotten_counts_for_a_quarter(void)
{
    enum { INPUTS = 4, SAMPLES = 400 };
    dqw_gain g;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_gain_init(&g, INPUTS, 1e6f));
    test_ls ls;
    ls_begin(&ls, INPUTS, 1e-6 / 4);
    test_random r = {194};
    float w[INPUTS] = {0};
    for (int k = 0; k < SAMPLES; k++) {
        const bool early = k < SAMPLES / 2;
        if (k == SAMPLES / 2) dqw_gain_forget(&g);
        float x[INPUTS];
        double weighed[INPUTS];
        // Other weights before than after.
        double y = 0.1 * random_normal(&r);
        for (int i = 0; i < INPUTS; i++) {
            x[i] = (float)random_normal(&r);
            y += (early ? 1.0 : 2.0 + i) * x[i];
            weighed[i] = (early ? 0.5 : 1.0) * x[i];
        }
        ls_add(&ls, weighed, (early ? 0.5 : 1.0) * y);
        float gain[INPUTS];
        float e = (float)y;
        for (int i = 0; i < INPUTS; i++) e -= w[i] * x[i];
        dqw_gain_step(&g, x, gain);
        for (int i = 0; i < INPUTS; i++) w[i] += gain[i] * e;
    }
    double best[LS_MAX];
    double inverse[LS_MAX][LS_MAX];
    (void)ls_solve(&ls, best, inverse);
    for (int i = 0; i < INPUTS; i++) {
        BETWEEN(-1e-4, w[i] / best[i] - 1, 1e-4);
        BETWEEN(-1e-4, dqw_gain_covariance(&g, i, i) / inverse[i][i] - 1, 1e-4);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_and_leaves_the_object_alone);
    RUN_TEST(test_weights_and_covariances_are_those_of_batch_least_squares);
    RUN_TEST(test_covariances_of_all_inputs_that_there_is_room_for);
    RUN_TEST(test_ill_conditioned_regressors);
    RUN_TEST(test_an_input_of_zero_leaves_its_variance_alone);
    RUN_TEST(test_variances_stay_positive);
    RUN_TEST(test_apply_and_grow_are_those_of_a_dense_matrix);
    RUN_TEST(test_apply_writes_its_inputs_alone);
    RUN_TEST(test_growth_of_nothing_changes_nothing);
    RUN_TEST(test_variances_stay_positive_over_mixed_steps_and_growth);
    RUN_TEST(test_growing_along_a_vector);
    RUN_TEST(test_what_is_forgotten_counts_for_a_quarter);
    return UNITY_END();
}
