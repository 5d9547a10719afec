// The normal equations in integers beside the covariance form in double, row by row: growth, near-singular inputs, full
// sums, refusals.
#include "dqw_normal_q15.h"
#include "dqw_q15.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

#define ONE_Q28 268435456.0
#define ONE_Q32 4294967296.0
#define ONE_Q40 1099511627776.0
#define PRIOR_Q32 4295

static int64_t q40(double x) { return llrint(x * ONE_Q40); }

static void test_init_refuses_and_leaves_the_object_alone(void)
{
    dqw_normal_q15 n;
    const int64_t prior[DQW_NORMAL_INPUTS] = {1, 1, 1, 1};
    const int64_t start[DQW_NORMAL_INPUTS] = {0};
    TEST_ASSERT_EQUAL_INT(DQW_ERR_NULL, dqw_normal_init_q15(NULL, 2, prior, start));
    REFUSED(n, DQW_ERR_NULL, dqw_normal_init_q15(&n, 2, NULL, start));
    REFUSED(n, DQW_ERR_NULL, dqw_normal_init_q15(&n, 2, prior, NULL));
    static const int sizes[] = {0, -1, DQW_NORMAL_INPUTS + 1, 256 + 2, INT32_MAX, INT32_MIN};
    for (unsigned k = 0; k < sizeof sizes / sizeof sizes[0]; k++)
        REFUSED(n, DQW_ERR_SIZE, dqw_normal_init_q15(&n, sizes[k], prior, start));
    static const int64_t bad_prior[] = {0, -1, INT64_MIN, (int64_t)1 << 40, INT64_MAX};
    for (unsigned k = 0; k < sizeof bad_prior / sizeof bad_prior[0]; k++) {
        const int64_t p[] = {1, bad_prior[k]};
        REFUSED(n, DQW_ERR_RANGE, dqw_normal_init_q15(&n, 2, p, start));
    }
    static const int64_t bad_start[] = {(int64_t)1 << 60, -((int64_t)1 << 60) - 1, INT64_MAX, INT64_MIN};
    for (unsigned k = 0; k < sizeof bad_start / sizeof bad_start[0]; k++) {
        const int64_t s[] = {0, bad_start[k]};
        REFUSED(n, DQW_ERR_RANGE, dqw_normal_init_q15(&n, 2, prior, s));
    }
    const int64_t most[] = {((int64_t)1 << 40) - 1, 1};
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_normal_init_q15(&n, 2, most, start));
    const int64_t far[] = {((int64_t)1 << 60) - 1, -((int64_t)1 << 60) + 1};
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_normal_init_q15(&n, 2, prior, far));
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_normal_init_q15(&n, DQW_NORMAL_INPUTS < 4 ? DQW_NORMAL_INPUTS : 4, prior, start));
}

// Sums as if the start had been measured: b = P^-1 w, c = w' P^-1 w, never below what the inputs explain of it.
static void test_a_start_is_in_the_sums(void)
{
    test_random r = {750};
    enum { INPUTS = DQW_NORMAL_INPUTS < 4 ? DQW_NORMAL_INPUTS : 4 };
    for (int k = 0; k < 200; k++) {
        int64_t prior_q32[INPUTS];
        int64_t start_q40[INPUTS];
        double target = 0;
        for (int i = 0; i < INPUTS; i++) {
            const double prior = pow(10, random_uniform(&r, -3, 2));
            const double w = random_uniform(&r, -30, 30);
            prior_q32[i] = llrint(ldexp(prior, 32)), start_q40[i] = llrint(ldexp(w, 40));
            target += prior * w * w;
        }
        dqw_normal_q15 n;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_normal_init_q15(&n, INPUTS, prior_q32, start_q40));
        CASE("start %d", k);
        for (int i = 0; i < INPUTS; i++) {
            const double b = ldexp((double)prior_q32[i], -32) * ldexp((double)start_q40[i], -40);
            BETWEEN(-1e-6 * fabs(b) - 1e-9, ldexp((double)n.b_q32[i], -32) - b, 1e-6 * fabs(b) + 1e-9);
            HOLDS(n.a_q32[DQW_NORMAL_A(i, i)] == prior_q32[i]);
        }
        BETWEEN(1 - 1e-6, ldexp((double)n.c_q32, -32) / target, 1 + 1e-6);
    }
}

// (E17) and (E61) as they are written, in long double.
typedef struct covariance {
    int n;
    long double w[6], p[6][6];
} covariance;

static void step(covariance *c, const double x[], double y)
{
    long double px[6];
    long double size = 1.0L;
    long double e = y;
    for (int i = 0; i < c->n; i++) {
        px[i] = 0.0L;
        for (int j = 0; j < c->n; j++) px[i] += c->p[i][j] * x[j];
        e -= c->w[i] * x[i];
    }
    for (int i = 0; i < c->n; i++) size += px[i] * x[i];
    for (int i = 0; i < c->n; i++) {
        c->w[i] += px[i] / size * e;
        for (int j = 0; j < c->n; j++) c->p[i][j] -= px[i] * px[j] / size;
    }
}

typedef struct worst {
    double weight;    ///< in deviations of the weight, for a residual of 1e-3
    double variance;  ///< relative
    double alone;     ///< of what the others leave of an input, over all of it
} worst;

// Of two rows what the others do not explain: P x over each own P_ii.
static double compare_alone(const dqw_normal_q15 *s, const covariance *c, test_random *r)
{
    int32_t x_q28[2][DQW_NORMAL_INPUTS] = {{0}};
    double off = 0;
    long double left[2][6];
    double size[2] = {0};
    for (int row = 0; row < 2; row++) {
        for (int i = 0; i < c->n; i++) {
            x_q28[row][i] = (int32_t)lrint(random_uniform(r, -0.3, 0.3) * ONE_Q28);
            size[row] = fmax(size[row], fabs(x_q28[row][i] / ONE_Q28));
        }
        for (int i = 0; i < c->n; i++) {
            left[row][i] = 0;
            for (int j = 0; j < c->n; j++) left[row][i] += c->p[i][j] * (x_q28[row][j] / (long double)ONE_Q28);
            left[row][i] /= c->p[i][i];
        }
    }
    dqw_normal_alone_q15(s, x_q28);
    for (int row = 0; row < 2; row++)
        for (int i = 0; i < c->n; i++) {
            // Up to 8 fit.
            const double is = fmin(7.99, fmax(-7.99, (double)left[row][i]));
            off = fmax(off, fabs(x_q28[row][i] / ONE_Q28 - is) / fmax(size[row], fabs(is)));
        }
    return off;
}

// Inputs from 1 down to 1/condition, mixed; now and then weight i's variance grows.
static worst compare(int n, int rows, double condition, double noise, bool grows, uint64_t seed)
{
    test_random r = {seed};
    dqw_normal_q15 s;
    int64_t prior[6];
    int64_t start[6];
    covariance c = {.n = n, .w = {0}};
    double truth[6];
    double mix[6][6];
    for (int i = 0; i < n; i++) {
        prior[i] = PRIOR_Q32;
        start[i] = q40(random_uniform(&r, -2, 2));
        c.w[i] = start[i] / ONE_Q40;
        c.p[i][i] = ONE_Q32 / PRIOR_Q32;
        truth[i] = random_uniform(&r, -1.5, 1.5);
        for (int j = 0; j < n; j++) mix[i][j] = (i == j ? 1.0 : 0.0) + 0.3 * random_normal(&r) / n;
    }
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_normal_init_q15(&s, n, prior, start));
    worst out = {0, 0, 0};
    for (int k = 1; k <= rows; k++) {
        int32_t x_q28[6];
        double z[6];
        double x[6];
        double y = noise * random_normal(&r);
        for (int i = 0; i < n; i++)
            z[i] = random_uniform(&r, -1, 1) * (n > 1 ? pow(condition, -(double)i / (n - 1)) : 1.0);
        for (int i = 0; i < n; i++) {
            double sum = 0.0;
            for (int j = 0; j < n; j++) sum += mix[i][j] * z[j];
            x_q28[i] = (int32_t)lrint(sum * ONE_Q28);
            x[i] = x_q28[i] / ONE_Q28;
            y += truth[i] * x[i];
        }
        const int32_t y_q28 = (int32_t)lrint(y * ONE_Q28);
        dqw_normal_add_q15(&s, x_q28, y_q28);
        step(&c, x, y_q28 / ONE_Q28);
        if (grows && k % 7 == 0) {
            const int i = (int)(random_bits(&r) % (uint64_t)n);
            const double q = (double)c.p[i][i] * random_uniform(&r, 0.0, 0.05);
            dqw_normal_grow_q15(&s, i, q40(q));
            c.p[i][i] += q40(q) / ONE_Q40;
        }
        if (k % 50 != 0) continue;
        out.alone = fmax(out.alone, compare_alone(&s, &c, &r));
        dqw_solution_q15 w;
        dqw_normal_solve_q15(&s, start, &w);
        HOLDS(w.out == 0);
        for (int i = 0; i < n; i++) {
            out.weight = fmax(out.weight,
                              fabs((double)(w.w_q40[i] / ONE_Q40 - c.w[i])) / (1e-3 * sqrt((double)c.p[i][i])));
            out.variance = fmax(out.variance, fabs((double)(w.cov_q40[i] / ONE_Q40 / c.p[i][i] - 1.0L)));
        }
    }
    return out;
}

// Sums in Q32 of inputs down to 1/30 have 10 bits less: 2^-28 of each solution's digits times the condition squared.
static void test_the_same_as_the_recursion(void)
{
    static const double conditions[] = {1, 5, 30};
    static const double noises[] = {0.0, 0.001, 0.1};
    worst all = {0, 0, 0};
    worst grown = {0, 0, 0};
    for (int n = 1; n <= 6; n++)
        for (int c = 0; c < 3; c++)
            for (int v = 0; v < 3; v++) {
                CASE("%d inputs, condition %g, noise %g", n, conditions[c], noises[v]);
                const worst a = compare(n, scaled(3000), conditions[c], noises[v], false,
                                        (uint64_t)(100 * n + 10 * c + v));
                const worst b = compare(n, scaled(3000), conditions[c], noises[v], true,
                                        (uint64_t)(100 * n + 10 * c + v));
                all.weight = fmax(all.weight, a.weight), all.variance = fmax(all.variance, a.variance);
                all.alone = fmax(all.alone, fmax(a.alone, b.alone));
                grown.weight = fmax(grown.weight, b.weight), grown.variance = fmax(grown.variance, b.variance);
            }
    CASE("without growth");
    BETWEEN(4e-5, all.weight, 7e-4);    // 1.7e-4
    BETWEEN(3e-7, all.variance, 6e-6);  // 1.4e-6
    BETWEEN(3e-7, all.alone, 6e-6);     // 1.5e-6
    CASE("with growth");
    BETWEEN(3e-5, grown.weight, 5e-4);    // 1.1e-4
    BETWEEN(3e-7, grown.variance, 6e-6);  // 1.5e-6
}

// Growth of one weight's variance changes that variance, and nothing else.
static void test_growth_moves_no_value(void)
{
    test_random r = {5};
    dqw_normal_q15 s;
    const int64_t prior[3] = {PRIOR_Q32, PRIOR_Q32, PRIOR_Q32};
    const int64_t start[3] = {0};
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_normal_init_q15(&s, 3, prior, start));
    for (int k = 0; k < 500; k++) {
        const double a = random_uniform(&r, -1, 1);
        const double x[3] = {a, 0.5 * a + random_uniform(&r, -1, 1), random_uniform(&r, -0.3, 0.3)};
        const int32_t x_q28[3] = {(int32_t)lrint(x[0] * ONE_Q28), (int32_t)lrint(x[1] * ONE_Q28),
                                  (int32_t)lrint(x[2] * ONE_Q28)};
        dqw_normal_add_q15(&s, x_q28,
                           (int32_t)lrint((0.7 * x[0] - 0.2 * x[1] + 1.1 * x[2] + 0.01 * random_normal(&r)) * ONE_Q28));
    }
    dqw_solution_q15 before;
    dqw_normal_solve_q15(&s, start, &before);
    for (int i = 0; i < 3; i++)
        for (int size = -10; size <= 20; size += 5) {
            CASE("weight %d, growth 2^%d of its variance", i, size);
            dqw_normal_q15 g = s;
            dqw_solution_q15 after;
            const int64_t q = (int64_t)ldexp((double)before.cov_q40[i], size);
            dqw_normal_grow_q15(&g, i, q);
            dqw_normal_solve_q15(&g, start, &after);
            if (after.out != 0) {
                // Beyond 2^22 in size: the direction counts as never learned.
                HOLDS(size >= 20);
                continue;
            }
            for (int k = 0; k < 3; k++) {
                const double expected = (double)before.cov_q40[k] + (k == i ? (double)q : 0.0);
                // What is left of the sums has so many bits less.
                const double most = 1e-5 + ldexp(1.0, size - 28);
                BETWEEN(-most, after.cov_q40[k] / expected - 1.0, most);
                BETWEEN(-0.02, (after.w_q40[k] - before.w_q40[k]) / ONE_Q40 / (0.01 * sqrt(expected / ONE_Q40)), 0.02);
            }
        }
    // Nothing to grow by, nothing to grow.
    dqw_normal_q15 same = s;
    dqw_normal_grow_q15(&same, 1, 0);
    dqw_normal_grow_q15(&same, 1, -5);
    TEST_ASSERT_EQUAL_MEMORY(&s, &same, sizeof s);
}

// Two inputs that are alike but for a part e: told apart above 2^-10, left out together below 2^-12, and the third one
// learned in any case.
static void test_near_singular_inputs_are_left_out(void)
{
    static const int bits[] = {4, 8, 10, 12, 14, 20};
    for (int b = 0; b < 6; b++) {
        CASE("alike but for 2^-%d", bits[b]);
        test_random r = {6};
        dqw_normal_q15 s;
        const int64_t prior[3] = {1, 1, 1};
        const int64_t start[3] = {q40(0.25), q40(-0.5), q40(0.125)};
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_normal_init_q15(&s, 3, prior, start));
        for (int k = 0; k < 1000; k++) {
            const double u = random_uniform(&r, -1, 1);
            const double z = random_uniform(&r, -1, 1);
            const int32_t x[3] = {(int32_t)lrint(z * ONE_Q28), (int32_t)lrint(u * ONE_Q28),
                                  (int32_t)lrint((u + ldexp(random_uniform(&r, -1, 1), -bits[b])) * ONE_Q28)};
            dqw_normal_add_q15(&s, x, (int32_t)lrint(0.5 * x[0] + 0.3 * x[1] - 0.2 * x[2]));
        }
        dqw_solution_q15 w;
        dqw_normal_solve_q15(&s, start, &w);
        BETWEEN(-1e-4, w.w_q40[0] / ONE_Q40 - (bits[b] >= 12 ? w.w_q40[0] / ONE_Q40 : 0.5), 1e-4);
        HOLDS(w.cov_q40[0] != INT64_MAX);
        if (bits[b] <= 10) {
            HOLDS(w.out == 0 && w.cov_q40[1] != INT64_MAX && w.cov_q40[2] != INT64_MAX);
            const double most = 2e-8 * ldexp(1.0, 2 * bits[b]);
            BETWEEN(-most, w.w_q40[1] / ONE_Q40 - 0.3, most);
            BETWEEN(-most, w.w_q40[2] / ONE_Q40 + 0.2, most);
        } else {
            // Of the second beside the first, whatever was left out behind them.
            const int32_t x = 1 << 26;
            int32_t both[2][DQW_NORMAL_INPUTS] = {{x, x, x}, {-x, x, x}};
            dqw_normal_alone_q15(&s, both);
            const double slope = (double)s.a_q32[1] / (double)s.a_q32[0];
            for (int row = 0; row < 2; row++)
                BETWEEN(-1e-5, both[row][1] / (double)x - (row ? 1 + slope : 1 - slope), 1e-5);
            HOLDS(both[0][2] == 0 && both[1][2] == 0);
            HOLDS(w.out == 4 && w.cov_q40[1] == INT64_MAX && w.cov_q40[2] == INT64_MAX && w.w_q40[2] == start[2]);
        }
        HOLDS(w.left_q32 >= 0);
    }
}

// A pivot of 2^-22 of full scale is learned still, one last place less is not: two inputs by their sums, whose factors
// are powers of two.
static void test_the_least_pivot(void)
{
    const int64_t start[2] = {q40(3), q40(-3)};
    for (int less = 0; less < 2; less++) {
        CASE("%d less", less);
        // 1, 1 and 1 + 2^-20, so that 2^-20 is left; scaled by 2^-2.
        const int64_t one = (int64_t)1 << 32;
        const int64_t own = one + 4096 - less;
        dqw_normal_q15 s = {.inputs = 2, .a_q32 = {one, one, own}, .c_q32 = one};
        // 0.5 and 0.25
        s.b_q32[0] = one / 2 + one / 4;
        s.b_q32[1] = one / 2 + own / 4;
        dqw_solution_q15 w;
        dqw_normal_solve_q15(&s, start, &w);
        HOLDS(w.out == (less ? 2u : 0u));
        BETWEEN(-0.01, w.w_q40[1] / ONE_Q40 - (less ? -3 : 0.25), 0.01);
    }
}

// Full sums halve, all of them: weights stay, deviations grow by the square root of two.
static void test_full_sums_halve(void)
{
    dqw_normal_q15 s;
    const int64_t prior[2] = {PRIOR_Q32, PRIOR_Q32};
    const int64_t start[2] = {0};
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_normal_init_q15(&s, 2, prior, start));
    test_random r = {7};
    int halved = 0;
    // After 1000 rows, as if after 8 million: 2^61 is near.
    for (int k = 0; k < 2000; k++) {
        const int32_t x[2] = {(int32_t)(random_bits(&r) & 1u ? INT32_MAX : INT32_MIN), (int32_t)random_bits(&r)};
        const int32_t y = (int32_t)(0.25 * x[0] + 0.5 * x[1]);
        const int64_t before = s.a_q32[0];
        const int64_t target = s.c_q32;
        dqw_normal_add_q15(&s, x, y);
        if (s.a_q32[0] < before) {
            halved++;
            BETWEEN(0.4999, (double)s.a_q32[0] / (double)before, 0.5001);
            BETWEEN(0.4999, (double)s.c_q32 / (double)target, 0.5001);
        }
        HOLDS(s.a_q32[0] < (int64_t)1 << 62 && s.c_q32 < (int64_t)1 << 62);
        if (k == 999) {
            for (int i = 0; i < 3; i++) s.a_q32[i] *= 8388;
            for (int i = 0; i < 2; i++) s.b_q32[i] *= 8388;
            s.c_q32 *= 8388;
        }
        if (k > 10 && k % 100 == 0) {
            dqw_solution_q15 w;
            dqw_normal_solve_q15(&s, start, &w);
            CASE("row %d", k);
            BETWEEN(-3e-8, w.w_q40[0] / ONE_Q40 - 0.25, 3e-8);
            BETWEEN(-3e-8, w.w_q40[1] / ONE_Q40 - 0.5, 3e-8);
        }
    }
    BETWEEN(1, halved, 1);
}

// Rows of every rank and size, with inputs that follow others but for a last place; and sums that no rows make. Nothing
// overflows, and what is said to be learned has a finite variance.
static void test_any_sums(void)
{
    test_random r = {91};
    int tied = 0;
    int learned = 0;
    for (int k = 0; k < scaled(20000); k++) {
        const int n = 1 + (int)(random_bits(&r) % DQW_NORMAL_INPUTS);
        const int rank = 1 + (int)(random_bits(&r) % (unsigned)n);
        int64_t prior[DQW_NORMAL_INPUTS];
        int64_t start[DQW_NORMAL_INPUTS];
        for (int i = 0; i < n; i++) {
            prior[i] = PRIOR_Q32;
            start[i] = dqw_q_signed32((uint32_t)random_bits(&r));
        }
        dqw_normal_q15 s;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_normal_init_q15(&s, n, prior, start));
        const unsigned small = (unsigned)(random_bits(&r) % 20);
        for (int row = 0; row < 30; row++) {
            int32_t x[DQW_NORMAL_INPUTS];
            int32_t before = 0;
            for (int i = 0; i < n; i++) {
                const int32_t any = dqw_q_signed32((uint32_t)random_bits(&r)) / 2;
                // Followers of an input; or each nearly what the one before it was apart by: of such, none alone is
                // near another.
                if (k % 3 == 1)
                    x[i] = i < rank ? any / (1 << random_bits(&r) % 20) : x[i - rank] / 2 + any / (1 << (8 + small));
                else
                    x[i] = i == 0 ? any : before + any / (1 << small);
                before = any;
            }
            dqw_normal_add_q15(&s, x, dqw_q_signed32((uint32_t)random_bits(&r)));
        }
        if (k % 3 == 0)
            for (int i = 0; i < n * (n + 1) / 2; i++)
                s.a_q32[i] = dqw_q_signed32((uint32_t)random_bits(&r)) * ((int64_t)1 << random_bits(&r) % 30);
        dqw_solution_q15 out;
        dqw_normal_solve_q15(&s, start, &out);
        HOLDS(out.left_q32 >= 0);
        int32_t both[2][DQW_NORMAL_INPUTS];
        for (int i = 0; i < 2 * n; i++) both[i / n][i % n] = dqw_q_signed32((uint32_t)random_bits(&r));
        dqw_normal_alone_q15(&s, both);
        for (int i = 0; i < 2 * n; i++)
            HOLDS(out.cov_q40[i % n] != INT64_MAX || (out.out >> i % n & 1u) == 0 || both[i / n][i % n] == 0);
        for (int i = 0; i < n; i++) {
            HOLDS(out.cov_q40[i] >= 0);
            if ((out.out >> i & 1u) != 0) TEST_ASSERT_EQUAL_INT64(start[i], out.w_q40[i]);
            if (k % 3 == 0) continue;
            tied += out.cov_q40[i] == INT64_MAX;
            learned += out.cov_q40[i] != INT64_MAX;
        }
    }
    HOLDS(tied > 0 && learned > 0);
}

// All sums are a quarter: the variance four times, the weight where it was; two more rows count as eight did. (E194)
static void test_what_is_forgotten_counts_for_a_quarter(void)
{
    dqw_normal_q15 s;
    const int64_t prior[2] = {PRIOR_Q32, PRIOR_Q32};
    const int64_t start[2] = {0};
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_normal_init_q15(&s, 2, prior, start));
    const int32_t x[2][2] = {{(int32_t)(0.5 * ONE_Q28), 0}, {0, (int32_t)(0.25 * ONE_Q28)}};
    for (int k = 0; k < 8; k++) dqw_normal_add_q15(&s, x[k % 2], (int32_t)(0.125 * ONE_Q28));
    dqw_solution_q15 before;
    dqw_solution_q15 after;
    dqw_normal_solve_q15(&s, start, &before);
    dqw_normal_forget_q15(&s);
    dqw_normal_solve_q15(&s, start, &after);
    for (int i = 0; i < 2; i++) {
        BETWEEN(-1e-4, (double)after.cov_q40[i] / (double)before.cov_q40[i] - 4, 1e-4);
        BETWEEN(-1e-6, (double)(after.w_q40[i] - before.w_q40[i]) / (double)before.w_q40[i], 1e-6);
    }
    for (int k = 0; k < 2; k++) dqw_normal_add_q15(&s, x[k % 2], (int32_t)(0.25 * ONE_Q28));
    dqw_normal_solve_q15(&s, start, &after);
    for (int i = 0; i < 2; i++) BETWEEN(-1e-4, (double)after.w_q40[i] / (double)before.w_q40[i] - 1.5, 1e-4);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_and_leaves_the_object_alone);
    RUN_TEST(test_a_start_is_in_the_sums);
    RUN_TEST(test_the_same_as_the_recursion);
    RUN_TEST(test_growth_moves_no_value);
    RUN_TEST(test_near_singular_inputs_are_left_out);
    RUN_TEST(test_the_least_pivot);
    RUN_TEST(test_full_sums_halve);
    RUN_TEST(test_what_is_forgotten_counts_for_a_quarter);
    RUN_TEST(test_any_sums);
    return UNITY_END();
}
