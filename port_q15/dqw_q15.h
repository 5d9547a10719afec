// Fixed-point arithmetic: the few operations that the port is made of. Integers only, ISO C: no shift of a negative number, no
// narrowing that a compiler may choose. Compilers turn the shifts below into one instruction.
#ifndef DQW_Q15_H
#define DQW_Q15_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// x / 2^n, rounded down.
/// Range    n in 0 .. 31 (64: 0 .. 63)
static inline int32_t dqw_q_floor32(int32_t x, unsigned n)
{
    return x < 0 ? ~(~x >> n) : x >> n;
}

static inline int64_t dqw_q_floor64(int64_t x, unsigned n)
{
    return x < 0 ? ~(~x >> n) : x >> n;
}

/// x / 2^n, rounded to the nearest, halves up.
/// Range    n in 1 .. 30, x <= 2^31 - 1 - 2^(n-1) (64: n in 1 .. 62, x <= 2^63 - 1 - 2^(n-1))
static inline int32_t dqw_q_round32(int32_t x, unsigned n)
{
    return dqw_q_floor32(x + ((int32_t)1 << (n - 1u)), n);
}

static inline int64_t dqw_q_round64(int64_t x, unsigned n)
{
    return dqw_q_floor64(x + ((int64_t)1 << (n - 1u)), n);
}

/// Bounded to 16, to 32 bits.
static inline int16_t dqw_q15_sat(int32_t x)
{
    return (int16_t)(x > INT16_MAX ? INT16_MAX : x < INT16_MIN ? INT16_MIN : x);
}

static inline int32_t dqw_q31_sat(int64_t x)
{
    return (int32_t)(x > INT32_MAX ? INT32_MAX : x < INT32_MIN ? INT32_MIN : x);
}

/// Q15 times Q15, Q15, rounded. -1 times -1 is the only product that does not fit: 32767.
static inline int16_t dqw_q15_mul(int16_t a, int16_t b)
{
    return dqw_q15_sat(dqw_q_round32((int32_t)a * b, 15));
}

/// Q31 times Q31, Q31, rounded. -1 times -1 is the only product that does not fit: 2^31 - 1.
static inline int32_t dqw_q31_mul(int32_t a, int32_t b)
{
    return dqw_q31_sat(dqw_q_round64((int64_t)a * b, 31));
}

/// The rounded top half of a Q31 number. Above 32767.5 / 32768 it is 32767.
static inline int16_t dqw_q15_from_q31(int32_t x_q31)
{
    return dqw_q15_sat(dqw_q_floor32(x_q31, 16) + (dqw_q_floor32(x_q31, 15) & 1));
}

/// Number of leading zeros, 32 for 0.
static inline unsigned dqw_q_clz32(uint32_t x)
{
    unsigned n = 0;
    if (x == 0) return 32;
    if (x <= 0x0000ffffu) n += 16, x <<= 16;
    if (x <= 0x00ffffffu) n += 8, x <<= 8;
    if (x <= 0x0fffffffu) n += 4, x <<= 4;
    if (x <= 0x3fffffffu) n += 2, x <<= 2;
    return x <= 0x7fffffffu ? n + 1u : n;
}

/// Bits that |x| needs: 0 for 0, 63 for the largest.
static inline unsigned dqw_q_bits64(int64_t x)
{
    const uint64_t u = x < 0 ? ~(uint64_t)x : (uint64_t)x;
    const uint32_t high = (uint32_t)(u >> 32);
    return high != 0 ? 64u - dqw_q_clz32(high) : 32u - dqw_q_clz32((uint32_t)u);
}

/// x times 2^n, n of either sign; rounded where bits are lost, bounded where they do not fit.
/// Range    any
static inline int64_t dqw_q_scale64(int64_t x, int n)
{
    if (x == 0 || n < -63) return 0;
    if (n < 0) return (n == -63 ? 0 : dqw_q_floor64(x, (unsigned)-n)) + (dqw_q_floor64(x, (unsigned)-n - 1u) & 1);
    if ((int)dqw_q_bits64(x) + n > 62) return x < 0 ? -((int64_t)1 << 62) : (int64_t)1 << 62;
    return x * ((int64_t)1 << n);
}

/// a b 2^n, rounded, bounded to 62 bits: as if through a product without a bound. Good to 31 bits of each factor.
/// Range    any; n in -126 .. 126
int64_t dqw_q_product64(int64_t a, int64_t b, int n);

/// a / b 2^n, rounded down, bounded to 62 bits; 0 for b = 0. Good to 28 bits. No division of 64 bits.
/// Range    any; n in -126 .. 126
int64_t dqw_q_quotient64(int64_t a, int64_t b, int n);

/// The integer square root, rounded down.
uint32_t dqw_q_root64(uint64_t x);

#ifdef __cplusplus
}
#endif
#endif
