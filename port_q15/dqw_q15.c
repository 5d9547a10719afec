// The wide operations: products and quotients whose exponent is free, as a background needs them. Built of 32-bit ones.
#include "dqw_q15.h"

unsigned dqw_q_bits64(int64_t x)
{
    const uint64_t u = x < 0 ? ~(uint64_t)x : (uint64_t)x;
    const uint32_t high = (uint32_t)(u >> 32);
    return high != 0 ? 64u - dqw_q_clz32(high) : 32u - dqw_q_clz32((uint32_t)u);
}

int64_t dqw_q_scale64(int64_t x, int n)
{
    if (x == 0 || n < -63) return 0;
    if (n < 0) return dqw_q_floor64(x, (unsigned)-n) + (dqw_q_floor64(x, (unsigned)-n - 1u) & 1);
    if ((int)dqw_q_bits64(x) + n > 62) return x < 0 ? -((int64_t)1 << 62) : (int64_t)1 << 62;
    return x * ((int64_t)1 << n);
}

// x = m 2^e with m of 31 bits and a sign, truncated.
static int32_t mantissa(int64_t x, int *e)
{
    const int bits = (int)dqw_q_bits64(x);
    *e = bits - 31;
    return (int32_t)(*e >= 0 ? dqw_q_floor64(x, (unsigned)*e) : x * ((int64_t)1 << -*e));
}

int64_t dqw_q_product64(int64_t a, int64_t b, int n)
{
    int e_a;
    int e_b;
    const int32_t m_a = mantissa(a, &e_a);
    const int32_t m_b = mantissa(b, &e_b);
    return dqw_q_scale64((int64_t)m_a * m_b, e_a + e_b + n);
}

int64_t dqw_q_times64(int64_t a, int32_t b, int n)
{
    return dqw_q_product64(a, b, n);
}

int32_t dqw_q_times32(int64_t a, int32_t b, int n)
{
    return dqw_q31_sat(dqw_q_product64(a, b, n));
}

// 2^62 / m for 2^30 <= m < 2^31, to 29 bits: a division of 32 bits, and one of Newton's steps.
static uint32_t reciprocal(uint32_t m)
{
    const uint32_t r0 = 0xffffffffu / (m >> 15);  // 2^17 .. 2^16, of 2^47 / m
    // r0 (2 - m r0 / 2^47), as 2^62 / m = 2^15 2^47 / m
    const uint64_t mr = (uint64_t)m * r0;  // 2^47 within 2^-14 of it
    const uint64_t two = ((uint64_t)1 << 48) - mr;
    return (uint32_t)(((two >> 16) * r0) >> 16);
}

int64_t dqw_q_quotient64(int64_t a, int64_t b, int n)
{
    if (a == 0 || b == 0) return 0;
    int e_a;
    int e_b;
    const int32_t m_a = mantissa(a, &e_a);
    const int32_t m_b = mantissa(b, &e_b);
    const uint32_t size_b = m_b < 0 ? (uint32_t)(-(int64_t)m_b) : (uint32_t)m_b;
    // -2^31 is the only mantissa of 32 bits.
    const uint32_t r = size_b > 0x7fffffffu ? 0x80000000u : reciprocal(size_b);
    const int64_t p = (int64_t)m_a * r;  // r <= 2^32
    return dqw_q_scale64(m_b < 0 ? -p : p, e_a - e_b - 62 + n);
}

int64_t dqw_q_within64(int64_t x, int64_t most)
{
    return x > most ? most : x < -most ? -most : x;
}

int32_t dqw_q_quotient32(int64_t a, int64_t b, int n)
{
    return dqw_q31_sat(dqw_q_quotient64(a, b, n));
}

uint32_t dqw_q_root64(uint64_t x)
{
    uint32_t root = 0;
    for (int bit = 31; bit >= 0; bit--) {
        const uint32_t with = root | (uint32_t)1 << bit;
        if ((uint64_t)with * with <= x) root = with;
    }
    return root;
}

int32_t dqw_q_length32(int32_t x, int32_t y)
{
    return dqw_q31_sat(dqw_q_root64((uint64_t)((int64_t)x * x) + (uint64_t)((int64_t)y * y)));
}
