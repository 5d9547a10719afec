// Clarke and Park: identities, inverses, the balanced closed form, the paper's convention.
#include "dqw_test.h"
#include "dqw_transform.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

// Rounding of a few operations on values of the given size.
static void near(double expected, double value, double size)
{
    BETWEEN(expected - 4e-7 * size, value, expected + 4e-7 * size);
}

static void test_balanced_phases_are_a_circle_of_the_same_amplitude(void)
{
    for (int k = 0; k < 720; k++) {
        const double t = k * PI / 360.0 - PI;
        CASE("angle %g", t);
        const dqw_abc x = {(float)(10 * cos(t)), (float)(10 * cos(t - 2 * PI / 3)), (float)(10 * cos(t + 2 * PI / 3))};
        const dqw_alphabeta y = dqw_clarke(x);
        near(10 * cos(t), y.alpha, 10);
        near(10 * sin(t), y.beta, 10);
        // A frame that runs 0.4 rad behind sees the vector at 0.4 rad.
        const dqw_dq z = dqw_park(y, (float)cos(t - 0.4), (float)sin(t - 0.4));
        near(10 * cos(0.4), z.d, 10);
        near(10 * sin(0.4), z.q, 10);
    }
}

static void test_zero_sequence_is_dropped(void)
{
    const dqw_abc x = {7.5f, 7.5f, 7.5f};
    const dqw_alphabeta y = dqw_clarke(x);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, y.alpha);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, y.beta);
}

static void test_inverses_on_random_vectors(void)
{
    test_random r = {1};
    for (int k = 0; k < scaled(100000); k++) {
        CASE("vector %d", k);
        const double size = pow(10, random_uniform(&r, -3, 3));
        const dqw_alphabeta x = {(float)random_uniform(&r, -size, size), (float)random_uniform(&r, -size, size)};
        const dqw_alphabeta y = dqw_clarke(dqw_clarke_inverse(x));
        near(x.alpha, y.alpha, size);
        near(x.beta, y.beta, size);
        const double t = random_uniform(&r, -10, 10);
        const float c = (float)cos(t);
        const float s = (float)sin(t);
        const dqw_alphabeta z = dqw_park_inverse(dqw_park(x, c, s), c, s);
        near(x.alpha, z.alpha, size);
        near(x.beta, z.beta, size);
    }
}

static void test_phases_of_the_inverse_sum_to_zero_and_power_is_three_halves(void)
{
    test_random r = {2};
    for (int k = 0; k < 1000; k++) {
        CASE("vector %d", k);
        const dqw_alphabeta v = {(float)random_normal(&r), (float)random_normal(&r)};
        const dqw_alphabeta i = {(float)random_normal(&r), (float)random_normal(&r)};
        const dqw_abc a = dqw_clarke_inverse(v);
        const dqw_abc b = dqw_clarke_inverse(i);
        near(0.0, (double)a.a + a.b + a.c, 4);
        near(1.5 * ((double)v.alpha * i.alpha + (double)v.beta * i.beta),
             (double)a.a * b.a + (double)a.b * b.b + (double)a.c * b.c, 40);
    }
}

static void test_park_keeps_the_length_and_composes(void)
{
    test_random r = {3};
    for (int k = 0; k < 1000; k++) {
        CASE("vector %d", k);
        const dqw_alphabeta x = {(float)random_normal(&r), (float)random_normal(&r)};
        const double s = random_uniform(&r, -PI, PI);
        const double t = random_uniform(&r, -PI, PI);
        const dqw_dq one = dqw_park(x, (float)cos(s), (float)sin(s));
        near(hypot(x.alpha, x.beta), hypot(one.d, one.q), 6);
        const dqw_alphabeta between = {one.d, one.q};
        const dqw_dq two = dqw_park(between, (float)cos(t), (float)sin(t));
        const dqw_dq both = dqw_park(x, (float)cos(s + t), (float)sin(s + t));
        near(both.d, two.d, 8);
        near(both.q, two.q, 8);
    }
}

static void test_paper_is_the_usual_transform_at_minus_the_angle(void)
{
    test_random r = {4};
    for (int k = 0; k < 1000; k++) {
        CASE("vector %d", k);
        const dqw_alphabeta x = {(float)random_normal(&r), (float)random_normal(&r)};
        const double t = random_uniform(&r, -10, 10);
        const dqw_dq paper = dqw_park_paper(x, (float)cos(t), (float)sin(t));
        const dqw_dq usual = dqw_park(x, (float)cos(-t), (float)sin(-t));
        TEST_ASSERT_EQUAL_FLOAT(usual.d, paper.d);
        TEST_ASSERT_EQUAL_FLOAT(usual.q, paper.q);
        // (P4), (P5) as printed
        near(cos(t) * x.alpha - sin(t) * x.beta, paper.d, 6);
        near(sin(t) * x.alpha + cos(t) * x.beta, paper.q, 6);
    }
}

static void test_not_a_number_stays_visible(void)
{
    const dqw_abc x = {1.0f, NAN, 0.0f};
    const dqw_alphabeta y = dqw_clarke(x);
    TEST_ASSERT_TRUE(isnan(y.alpha));
    TEST_ASSERT_TRUE(isnan(y.beta));
    TEST_ASSERT_TRUE(isnan(dqw_park(y, 1.0f, 0.0f).d));
}

// Largest error against libm, beside what single precision lets an angle of this size move by.
static double worst_cosine_sine(double largest_rad, int count, test_random *r)
{
    double worst = 0.0;
    for (int k = 0; k < count; k++) {
        const float t = (float)random_uniform(r, -largest_rad, largest_rad);
        float c;
        float s;
        dqw_cosine_sine(t, &c, &s);
        CASE("angle %.9g", (double)t);
        const double off = hypot((double)c - cos((double)t), (double)s - sin((double)t));
        HOLDS(off < 1e-6 + fabs((double)t) * 6e-8);
        worst = fmax(worst, off);
    }
    return worst;
}

static void test_cosine_and_sine_are_those_of_libm(void)
{
    static const double largest[] = {0.8, 10, 1e3, 1e5};
    static const double bound[] = {8e-7, 8e-7, 8e-7, 2.5e-6};  // 3.8e-7, 3.9e-7, 3.8e-7, 1.3e-6
    test_random r = {5};
    for (int k = 0; k < 4; k++) {
        const double worst = worst_cosine_sine(largest[k], scaled(300000), &r);
        CASE("up to %g rad", largest[k]);
        BETWEEN(bound[k] / 4, worst, bound[k]);
    }
    // Every quarter turn's edges, where one series takes over from the other.
    for (int n = -4000; n <= 4000; n++)
        for (int k = -3; k <= 3; k++) {
            float t = (float)((n + 0.5) * PI / 2);
            for (int m = 0; m < abs(k); m++) t = nextafterf(t, k > 0 ? INFINITY : -INFINITY);
            float c;
            float s;
            dqw_cosine_sine(t, &c, &s);
            CASE("angle %.9g", (double)t);
            HOLDS(hypot((double)c - cos((double)t), (double)s - sin((double)t)) < 1e-6 + fabs((double)t) * 6e-8);
        }
}

static void test_cosine_and_sine_of_what_is_no_angle(void)
{
    static const float bad[] = {NAN, INFINITY, -INFINITY, 1e30f, -1e30f, 1e9f, -3e9f, 3.402823466e38f};
    for (unsigned k = 0; k < sizeof bad / sizeof bad[0]; k++) {
        CASE("angle %g", (double)bad[k]);
        float c = 5.0f;
        float s = 5.0f;
        dqw_cosine_sine(bad[k], &c, &s);
        HOLDS(c == 1.0f && s == 0.0f);
    }
    // Beyond 1e5 rad it still is on the circle, or 1 and 0.
    test_random r = {6};
    for (int k = 0; k < 10000; k++) {
        const float t = (float)random_uniform(&r, 1e5, 1e6);
        float c;
        float s;
        dqw_cosine_sine(t, &c, &s);
        CASE("angle %.9g", (double)t);
        BETWEEN(0.98, hypot((double)c, (double)s), 1.02);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_balanced_phases_are_a_circle_of_the_same_amplitude);
    RUN_TEST(test_zero_sequence_is_dropped);
    RUN_TEST(test_inverses_on_random_vectors);
    RUN_TEST(test_phases_of_the_inverse_sum_to_zero_and_power_is_three_halves);
    RUN_TEST(test_park_keeps_the_length_and_composes);
    RUN_TEST(test_paper_is_the_usual_transform_at_minus_the_angle);
    RUN_TEST(test_not_a_number_stays_visible);
    RUN_TEST(test_cosine_and_sine_are_those_of_libm);
    RUN_TEST(test_cosine_and_sine_of_what_is_no_angle);
    return UNITY_END();
}
