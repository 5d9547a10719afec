// Tests of numbers by their bits, against <math.h> in double: every class, every boundary, random bits.
#include <float.h>

#include "dqw_number.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

static float of_bits(uint32_t bits)
{
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static void judge(float x, float limit)
{
    CASE("x %a, limit %a", (double)x, (double)limit);
    const bool finite = isfinite((double)x) != 0;
    HOLDS(dqw_is_finite(x) == finite);
    HOLDS(dqw_is_positive(x) == (finite && (double)x > 0.0));
    HOLDS(dqw_is_zero_or_positive(x) == (finite && (double)x >= 0.0));
    if (!isnan(limit)) HOLDS(dqw_within(x, fabsf(limit)) == (finite && fabs((double)x) <= fabs((double)limit)));
}

static void test_every_boundary(void)
{
    static const uint32_t edges[] = {0,           1,           0x007fffffu, 0x00800000u, 0x3f800000u, 0x447a0000u,
                                     0x7f7ffffeu, 0x7f7fffffu, 0x7f800000u, 0x7f800001u, 0x7fc00000u, 0x7fffffffu};
    enum { EDGES = sizeof edges / sizeof edges[0] };
    for (unsigned sign = 0; sign < 2; sign++)
        for (int i = 0; i < EDGES; i++)
            for (int j = 0; j < EDGES; j++) judge(of_bits(edges[i] | sign << 31), of_bits(edges[j]));
    // A limit of minus zero is zero.
    TEST_ASSERT_TRUE(dqw_within(0.0f, -0.0f) && dqw_within(-0.0f, -0.0f) && !dqw_within(FLT_MIN, -0.0f));
}

static void test_random_bits(void)
{
    test_random r = {7};
    for (int k = 0; k < scaled(1000000); k++) judge(random_float_bits(&r), random_float_bits(&r));
}

static void test_not_known_is_a_number_above_all_that_is_known(void)
{
    TEST_ASSERT_TRUE(dqw_is_finite(DQW_UNKNOWN));
    TEST_ASSERT_TRUE(DQW_UNKNOWN < FLT_MAX && DQW_UNKNOWN > 0.99f * FLT_MAX);
    TEST_ASSERT_TRUE(isnan(dqw_number_nan()));
    TEST_ASSERT_FALSE(dqw_is_finite(dqw_number_nan()));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_boundary);
    RUN_TEST(test_random_bits);
    RUN_TEST(test_not_known_is_a_number_above_all_that_is_known);
    return UNITY_END();
}
