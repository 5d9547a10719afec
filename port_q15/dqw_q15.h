// Fixed-point arithmetic: the few operations that the port is made of. Integers only, ISO C: no shift of a negative
// number, no narrowing that a compiler may choose. Compilers turn the shifts below into one instruction. Where a core
// has an instruction that compilers do not find by themselves, it is named; the number is the same.
#ifndef DQW_Q15_H
#define DQW_Q15_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Asks for a loop of a few known turns to be unrolled where a size setting would not.
#if defined(__GNUC__) && !defined(__clang__)
#define DQW_Q_UNROLL _Pragma("GCC unroll 11")
#else
#define DQW_Q_UNROLL
#endif

/// The signed number with these bits: ISO C leaves the cast to the compiler, and every compiler makes nothing of this.
static inline int32_t dqw_q_signed32(uint32_t bits)
{
    return bits <= INT32_MAX ? (int32_t)bits : -(int32_t)~bits - 1;
}

/// x / 2^n, rounded down.
/// Range    n in 0 .. 31 (64: 0 .. 63)
static inline int32_t dqw_q_floor32(int32_t x, unsigned n)
{
    return x < 0 ? ~(~x >> n) : x >> n;
}

/// The same in 64 bits.
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

/// The same in 64 bits.
static inline int64_t dqw_q_round64(int64_t x, unsigned n)
{
    return dqw_q_floor64(x + ((int64_t)1 << (n - 1u)), n);
}

/// Bounded to 16 bits.
static inline int16_t dqw_q15_sat(int32_t x)
{
    return (int16_t)(x > INT16_MAX ? INT16_MAX : x < INT16_MIN ? INT16_MIN : x);
}

/// Bounded to 32 bits.
static inline int32_t dqw_q31_sat(int64_t x)
{
    // Where it fits, the upper half is what the sign of the lower one says: half the code of two comparisons.
    const uint32_t low = (uint32_t)((uint64_t)x & UINT32_MAX);
    const uint32_t high = (uint32_t)((uint64_t)x >> 32);
    return dqw_q_signed32((low >> 31) + high == 0 ? low : (high >> 31) + INT32_MAX);
}

/// a + b, bounded to 32 bits.
static inline int32_t dqw_q31_add(int32_t a, int32_t b)
{
#if defined(__ARM_FEATURE_DSP) && defined(__GNUC__)
    return __builtin_arm_qadd(a, b);
#else
    const int32_t sum = dqw_q_signed32((uint32_t)a + (uint32_t)b);
    // Two of one sign whose sum has the other: it did not fit.
    if (((a ^ sum) & (b ^ sum)) < 0) return a < 0 ? INT32_MIN : INT32_MAX;
    return sum;
#endif
}

/// Bounded to -2^28 .. 2^28 - 1.
static inline int32_t dqw_q28_sat(int32_t x)
{
#if defined(__ARM_FEATURE_SAT) && defined(__GNUC__)
    return __builtin_arm_ssat(x, 29);
#else
    if ((((uint32_t)x + (1u << 28)) >> 29) == 0) return x;
    return x < 0 ? -(1 << 28) : (1 << 28) - 1;
#endif
}

/// The rounded top half of a Q31 number: -32768 .. 32768.
static inline int32_t dqw_q15_top(int32_t x_q31)
{
    return dqw_q_round32(dqw_q_floor32(x_q31, 15), 1);
}

/// Q31 times Q15, Q30: the learner's product, of the rounded top half of x.
/// Range    any; |product| <= 2^30
static inline int32_t dqw_q30_mul(int32_t x_q31, int16_t y_q15)
{
    return dqw_q15_top(x_q31) * y_q15;
}

/// Q29 times Q15, Q31, rounded, in products of 16 by 16 bits. The same as the one below.
static inline int32_t dqw_q31_mul_by_halves(int32_t x_q29, int16_t y_q15)
{
    const int32_t low_q32 = (int32_t)(((uint32_t)x_q29 << 3) & 0xffffu);  // |low y| < 2^31
    return dqw_q_floor32(x_q29, 13) * y_q15 + dqw_q_round32(dqw_q_floor32(low_q32 * y_q15, 15), 1);
}

/// Q29 times Q15, Q31, rounded: the learner's correction.
/// Range    -2^28 <= x < 2^28, any y; |product| <= 2^30
static inline int32_t dqw_q31_mul(int32_t x_q29, int16_t y_q15)
{
#if defined(__ARM_ARCH_ISA_THUMB) && __ARM_ARCH_ISA_THUMB == 1
    // The smallest Arm cores keep 32 bits of a product.
    return dqw_q31_mul_by_halves(x_q29, y_q15);
#else
    // The upper half of 64 bits, rounded by the first bit of the lower.
    const int64_t product = (int64_t)(x_q29 * 8) * (y_q15 * 65536);
    return (int32_t)dqw_q_floor64(product, 32) + (int32_t)((uint64_t)product >> 31 & 1u);
#endif
}

/// Number of leading zeros, 32 for 0.
static inline unsigned dqw_q_clz32(uint32_t x)
{
    if (x == 0) return 32;
#if defined(__ARM_FEATURE_CLZ) && defined(__GNUC__)
    return (unsigned)__builtin_clz(x);
#else
    unsigned n = 0;
    if (x <= 0x0000ffffu) n += 16, x <<= 16;
    if (x <= 0x00ffffffu) n += 8, x <<= 8;
    if (x <= 0x0fffffffu) n += 4, x <<= 4;
    if (x <= 0x3fffffffu) n += 2, x <<= 2;
    return x <= 0x7fffffffu ? n + 1u : n;
#endif
}

/// Bits that |x| needs: 0 for 0, 63 for the largest.
unsigned dqw_q_bits64(int64_t x);

/// x times 2^n, n of either sign; rounded where bits are lost, bounded where they do not fit.
/// Range    any
int64_t dqw_q_scale64(int64_t x, int n);

/// a b 2^n, rounded, bounded to 62 bits: as if through a product without a bound. Good to 31 bits of each factor.
/// Range    any; n in -126 .. 126
int64_t dqw_q_product64(int64_t a, int64_t b, int n);

/// The same of a factor of 32 bits, which a core passes in fewer registers; and bounded to 32 bits.
int64_t dqw_q_times64(int64_t a, int32_t b, int n);
int32_t dqw_q_times32(int64_t a, int32_t b, int n);

/// a / b 2^n, rounded, bounded to 62 bits; 0 for b = 0. Good to 28 bits. No division of 64 bits.
/// Range    any; n in -126 .. 126
int64_t dqw_q_quotient64(int64_t a, int64_t b, int n);

/// The same bounded to 32 bits.
int32_t dqw_q_quotient32(int64_t a, int64_t b, int n);

/// x within -most .. most.
int64_t dqw_q_within64(int64_t x, int64_t most);

/// |x|
/// Range    above INT64_MIN
static inline int64_t dqw_q_size64(int64_t x)
{
    return x < 0 ? -x : x;
}

/// The integer square root, rounded down.
uint32_t dqw_q_root64(uint64_t x);

/// Length of (x, y), rounded down, bounded to 31 bits.
int32_t dqw_q_length32(int32_t x, int32_t y);

/// x_q15^-1 as Q16 without a division: x from 1 to 7, x_q15 in 2^15 .. 7 * 2^15. The same as 2^31 / x_q15.
static inline uint32_t dqw_q16_inverse_by_steps(uint32_t x_q15)
{
    // 1 <= d < 2
    uint32_t d_q15 = x_q15;
    unsigned halvings = 0;
    if (d_q15 >= 4u << 15) d_q15 >>= 2, halvings = 2;
    if (d_q15 >= 2u << 15) d_q15 >>= 1, halvings++;
    // A line, wrong by 6 %, and two of Newton's steps: 1.3e-5, which is a unit in the last place.
    int32_t r_q16 = 92330 - (int32_t)(d_q15 - (d_q15 >> 4));
    r_q16 += dqw_q_floor32(r_q16 * (65536 - (int32_t)((d_q15 * (uint32_t)r_q16) >> 15)), 16);
    r_q16 += dqw_q_floor32(r_q16 * (65536 - (int32_t)((d_q15 * (uint32_t)r_q16) >> 15)), 16);
    const uint32_t near = (uint32_t)r_q16 >> halvings;
    const uint32_t product_q31 = near * x_q15;
    if (product_q31 > 1u << 31) return near - 1u;
    return (1u << 31) - product_q31 >= x_q15 ? near + 1u : near;
}

/// x_q15^-1 as Q16, rounded down.
/// Range    x_q15 in 2^15 .. 7 * 2^15
static inline uint32_t dqw_q16_inverse(uint32_t x_q15)
{
#if (defined(__ARM_ARCH) && !defined(__ARM_FEATURE_IDIV) && !defined(__aarch64__)) ||                                  \
    (defined(__riscv) && !defined(__riscv_div))
    return dqw_q16_inverse_by_steps(x_q15);
#else
    return (1u << 31) / x_q15;
#endif
}

/// x times y / 2^n, rounded, in 32-bit products: y is unsigned and has 17 bits at most.
/// Range    y <= 2^16, n in 8 .. 16, |x y| < 2^(31 + n) - 2^33
static inline int32_t dqw_q_mul32x16(int32_t x, uint32_t y, unsigned n)
{
    const uint32_t low = ((uint32_t)x & 0xffffu) * y + (1u << (n - 1u));
    return dqw_q_floor32(x, 16) * (int32_t)y * ((int32_t)1 << (16u - n)) + (int32_t)(low >> n);
}

#ifdef __cplusplus
}
#endif
#endif
