// The arithmetic of the fixed-point port against 64-bit integers: all operands where there are 2^32 or fewer, else the
// edges and many more.
#include "dqw_q15.h"
#include "dqw_scale.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

static int64_t bound(int64_t x, int64_t low, int64_t high) { return x < low ? low : x > high ? high : x; }
static int64_t sat15(int64_t x) { return bound(x, INT16_MIN, INT16_MAX); }
static int64_t sat31(int64_t x) { return bound(x, INT32_MIN, INT32_MAX); }

// x / 2^n rounded down, by division: shifts are what is tried.
static int64_t floor_of(int64_t x, int64_t divisor)
{
    const int64_t q = x / divisor;
    return q * divisor > x ? q - 1 : q;
}

// Any number of these bits; every fourth at an edge.
static int64_t any(test_random *r, int bits)
{
    const uint64_t z = random_bits(r);
    const int64_t high = (int64_t)(((uint64_t)1 << (bits - 1)) - 1);
    if (z % 4 == 0) {
        const int64_t edge[] = {-high - 1, -high, -1, 0, 1, high, high / 2, -high / 2};
        return edge[z / 4 % 8];
    }
    const uint64_t size = random_bits(r) % (uint64_t)bits;
    const int64_t x = (int64_t)(random_bits(r) & ((uint64_t)high >> size));
    return z & 8u ? x : -x;
}

// The learner's product, over all 2^32 pairs of its 16-bit operands; what is rounded away is drawn. The sanitized run
// takes every tenth row.
static void test_every_product_of_the_learner(void)
{
    const int rows = scaled(65536);
    test_random r = {5};
    for (int k = 0; k < rows; k++) {
        const int32_t top = (int32_t)((int64_t)k * 65535 / (rows - 1)) - 32768;
        const int32_t w_q31 = (int32_t)bound(65536 * (int64_t)top + (int64_t)(random_bits(&r) % 65536) - 32768,
                                             INT32_MIN, INT32_MAX);
        int32_t wrong = 0;
        for (int32_t y = -32768; y < 32768; y++) wrong |= dqw_q30_mul(w_q31, (int16_t)y) ^ top * y;
        CASE("%d, weight %d", (int)top, (int)w_q31);
        HOLDS(wrong == 0);
    }
    // The top that no 16 bits hold.
    for (int32_t y = -32768; y < 32768; y++) HOLDS(dqw_q30_mul(INT32_MAX, (int16_t)y) == 32768 * y);
}

// Its correction, over all pairs of what is rounded in it, 13 bits of the gain by 16; the gain's upper bits go through
// their range.
static void test_every_correction_of_the_learner(void)
{
    const int rows = scaled(8192);
    test_random r = {6};
    for (int k = 0; k < rows; k++) {
        const int64_t low = rows == 8192 ? k : (int64_t)(random_bits(&r) % 8192);
        const int64_t x_q29 = 8192 * ((int64_t)k * 65535 / (rows - 1) - 32768) + low;
        uint64_t wrong = 0;
        // Rounded, halves up: what is left of the exact product is from -4096 to 4095.
        for (int y = -32768; y < 32768; y++) {
            const int32_t p_q31 = dqw_q31_mul((int32_t)x_q29, (int16_t)y);
            wrong |= (uint64_t)(x_q29 * y - 8192 * (int64_t)p_q31 + 4096) >> 13;
            wrong |= (uint64_t)(p_q31 != dqw_q31_mul_by_halves((int32_t)x_q29, (int16_t)y));
        }
        CASE("gain %lld", (long long)x_q29);
        HOLDS(wrong == 0);
    }
}

static void test_shifts_and_bounds(void)
{
    test_random r = {1};
    for (int k = 0; k < scaled(3000000); k++) {
        const int32_t x = (int32_t)any(&r, 32);
        const int64_t y = any(&r, 64);
        const unsigned n = 1u + (unsigned)(random_bits(&r) % 30);
        const unsigned m = 1u + (unsigned)(random_bits(&r) % 62);
        CASE("%d, %lld by %u, %u", x, (long long)y, n, m);
        HOLDS(dqw_q_floor32(x, n) == floor_of(x, (int64_t)1 << n));
        HOLDS(dqw_q_floor32(x, 0) == x);
        HOLDS(dqw_q_floor64(y, m) == floor_of(y, (int64_t)1 << m));
        if (x <= INT32_MAX - ((int32_t)1 << (n - 1)))
            HOLDS(dqw_q_round32(x, n) == floor_of((int64_t)x + ((int64_t)1 << (n - 1)), (int64_t)1 << n));
        if (y <= INT64_MAX - ((int64_t)1 << (m - 1)))
            HOLDS(dqw_q_round64(y, m) == floor_of(y + ((int64_t)1 << (m - 1)), (int64_t)1 << m));
        HOLDS(dqw_q15_sat(x) == sat15(x));
        HOLDS(dqw_q31_sat(y) == sat31(y));
        HOLDS(dqw_q28_sat(x) == bound(x, -(1 << 28), (1 << 28) - 1));
        HOLDS(dqw_q_signed32((uint32_t)x) == x);
        HOLDS(dqw_q15_top(x) == floor_of((int64_t)x + 32768, 65536));
    }
}

static void test_sums_and_products(void)
{
    test_random r = {2};
    for (int k = 0; k < scaled(3000000); k++) {
        const int32_t a = (int32_t)any(&r, 32);
        const int32_t b = (int32_t)any(&r, 32);
        CASE("%d and %d", a, b);
        HOLDS(dqw_q31_add(a, b) == sat31((int64_t)a + b));
        const uint32_t c = (uint32_t)(random_bits(&r) % 65537);
        const unsigned n = 8u + (unsigned)(random_bits(&r) % 9);
        const int64_t product = (int64_t)a * c;
        if (llabs(product) >= ((int64_t)1 << (31 + n)) - ((int64_t)1 << 33)) continue;
        HOLDS(dqw_q_mul32x16(a, c, n) == floor_of(product + ((int64_t)1 << (n - 1)), (int64_t)1 << n));
    }
}

static void test_every_inverse(void)
{
    for (uint32_t x = 1u << 15; x <= 7u << 15; x++) {
        CASE("%u", (unsigned)x);
        HOLDS(dqw_q16_inverse(x) == 0x80000000u / x);
        HOLDS(dqw_q16_inverse_by_steps(x) == 0x80000000u / x);
    }
}

// The integer square root, rounded down: of squares, of their neighbours, and of any bits.
static void test_roots(void)
{
    test_random r = {4};
    for (int k = 0; k < 20000; k++) {
        const uint64_t root = random_bits(&r) >> (32 + random_bits(&r) % 32);
        CASE("%lu squared", (unsigned long)root);
        HOLDS(dqw_q_root64(root * root) == root && dqw_q_root64(root * root + 2 * root) == root);
        if (root > 0) HOLDS(dqw_q_root64(root * root - 1) == root - 1);
        const uint64_t any_of = random_bits(&r);
        const uint64_t found = dqw_q_root64(any_of);
        HOLDS(found * found <= any_of && any_of - found * found <= 2 * found);
    }
}

static void test_leading_zeros_and_scaling(void)
{
    TEST_ASSERT_EQUAL_UINT(32, dqw_q_clz32(0));
    TEST_ASSERT_EQUAL_UINT(0, dqw_q_bits64(0));
    for (unsigned n = 0; n < 32; n++) {
        TEST_ASSERT_EQUAL_UINT(31 - n, dqw_q_clz32((uint32_t)1 << n));
        TEST_ASSERT_EQUAL_UINT(31 - n, dqw_q_clz32(0xffffffffu >> (31 - n)));
    }
    for (unsigned n = 0; n < 63; n++) {
        TEST_ASSERT_EQUAL_UINT(n + 1, dqw_q_bits64((int64_t)1 << n));
        TEST_ASSERT_EQUAL_UINT(n, dqw_q_bits64(-((int64_t)1 << n)));
    }
    test_random r = {3};
    for (int k = 0; k < scaled(1000000); k++) {
        const int64_t x = any(&r, 64);
        const int n = (int)(random_bits(&r) % 140) - 70;
        CASE("%lld by 2^%d", (long long)x, n);
        const long double exact = floorl(ldexpl((long double)x, n) + 0.5L);  // 64 bits of mantissa: exact
        const long double most = ldexpl(1, 62);
        const long double got = (long double)dqw_q_scale64(x, n);
        if (fabsl(exact) < most)
            HOLDS(got == exact);
        else
            HOLDS(got == (n < 0 ? exact : x > 0 ? most : -most));
    }
}

static void test_scale_is_checked(void)
{
    const dqw_scale good = {
        .v_full_mV = 48000, .i_full_mA = 20000, .w_full_mrad_s = 400000, .dt_ns = 50000, .pole_pairs = 4};
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_scale_check(&good));
    TEST_ASSERT_EQUAL_INT(DQW_ERR_NULL, dqw_scale_check(NULL));
    for (int field = 0; field < 4; field++) {
        dqw_scale s = good;
        uint32_t *const fields[] = {&s.v_full_mV, &s.i_full_mA, &s.w_full_mrad_s, &s.dt_ns};
        static const uint32_t last[] = {DQW_SCALE_MAX, DQW_SCALE_MAX, DQW_SCALE_MAX, 1000000000u};
        static const enum dqw_status refused[] = {DQW_ERR_V_BASE, DQW_ERR_I_BASE, DQW_ERR_W_BASE, DQW_ERR_DT};
        const int bad = refused[field];
        const int status[] = {bad, DQW_OK, DQW_OK, bad, bad};
        const uint32_t value[] = {0, 1, last[field], last[field] + 1u, UINT32_MAX};
        for (int k = 0; k < 5; k++) {
            CASE("field %d, %u", field, (unsigned)value[k]);
            *fields[field] = value[k];
            HOLDS((int)dqw_scale_check(&s) == status[k]);
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_product_of_the_learner);
    RUN_TEST(test_every_correction_of_the_learner);
    RUN_TEST(test_shifts_and_bounds);
    RUN_TEST(test_sums_and_products);
    RUN_TEST(test_every_inverse);
    RUN_TEST(test_roots);
    RUN_TEST(test_leading_zeros_and_scaling);
    RUN_TEST(test_scale_is_checked);
    return UNITY_END();
}
