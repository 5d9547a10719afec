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
    for (unsigned k = 0; k < sizeof sizes / sizeof sizes[0]; k++) REFUSED(g, DQW_ERR_SIZE, dqw_gain_init(&g, sizes[k], 1.0f));
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

// Regressors mixed by a random matrix after scaling by 1 .. 1/condition. Ridge 1 / p0 in the batch: the same problem exactly.
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

static void test_ill_conditioned_regressors(void)
{
    static const double conditions[] = {1e1, 1e2, 1e3, 1e4};
    // The error of single precision grows with the condition number of the regressors, not with its square: the worst of
    // five was 1.2e-6, 2.9e-6, 6.3e-5, 1.1e-4.
    static const double weight[] = {4e-6, 1e-5, 2e-4, 4e-4};
    for (int c = 0; c < 4; c++) {
        difference worst = {0, 0};
        for (int n = 2; n <= 6; n++) worst = larger(worst, compare(n, 10000, conditions[c], 0.0, (uint64_t)(1000 * c + n)));
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
                                       : (float)(random_normal(&r) < 0 ? -1 : 1) * (float)pow(10, random_uniform(&r, -20, largest[c]));
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

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_and_leaves_the_object_alone);
    RUN_TEST(test_weights_and_covariances_are_those_of_batch_least_squares);
    RUN_TEST(test_ill_conditioned_regressors);
    RUN_TEST(test_an_input_of_zero_leaves_its_variance_alone);
    RUN_TEST(test_variances_stay_positive);
    return UNITY_END();
}
