// What a number is, asked of its bits: the same under every compiler's floating-point flags, -ffast-math and
// -ffinite-math-only too.
#ifndef DQW_NUMBER_H
#define DQW_NUMBER_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_reading.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Asks for a small function to be part of its caller, or to stay apart from it, where a size setting would do
/// otherwise.
#if defined(__GNUC__)
#define DQW_INLINE static inline __attribute__((always_inline))
#define DQW_APART static __attribute__((noinline))
#else
#define DQW_INLINE static inline
#define DQW_APART static
#endif

/// Bits of infinity; a NaN's are more.
#define DQW_NUMBER_INFINITE UINT32_C(0x7f800000)

// A compiler that was promised finite numbers may draw conclusions from a float that it holds, and none from one that
// it must read.
#if defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__
#define DQW_NUMBER_READ volatile
#else
#define DQW_NUMBER_READ
#endif

/// The bits of a float, IEEE 754 binary32.
static inline uint32_t dqw_number_bits(float x)
{
    DQW_NUMBER_READ union {
        float number;
        uint32_t bits;
    } same;
    same.number = x;
    return same.bits;
}

/// NaN, for read-outs that have nothing to say.
static inline float dqw_number_nan(void)
{
    DQW_NUMBER_READ union {
        uint32_t bits;
        float number;
    } same;
    same.bits = UINT32_C(0x7fc00000);
    return same.number;
}

/// The size of a number: as integers these have the order of the numbers, infinity and then NaN above all.
static inline uint32_t dqw_size_bits(float x)
{
    return dqw_number_bits(x) & UINT32_C(0x7fffffff);
}

/// Neither NaN nor infinity.
static inline bool dqw_is_finite(float x)
{
    return dqw_size_bits(x) < DQW_NUMBER_INFINITE;
}

/// A number above zero.
static inline bool dqw_is_positive(float x)
{
    const uint32_t bits = dqw_number_bits(x);
    return bits != 0 && bits < DQW_NUMBER_INFINITE;
}

/// A number that is not negative; minus zero is zero.
static inline bool dqw_is_zero_or_positive(float x)
{
    const uint32_t bits = dqw_number_bits(x);
    return bits < DQW_NUMBER_INFINITE || bits == UINT32_C(0x80000000);
}

/// A number of at most this size, |x| <= limit.
/// Range    limit >= 0, not NaN; false for x NaN or infinite, whatever the limit
static inline bool dqw_within(float x, float limit)
{
    const uint32_t size = dqw_number_bits(x) & UINT32_C(0x7fffffff);
    return size < DQW_NUMBER_INFINITE && size <= (dqw_number_bits(limit) & UINT32_C(0x7fffffff));
}

/// Cosine and sine of one angle: their length, squared, is within 0.9 .. 1.1.
static inline bool dqw_is_direction(float cosine, float sine)
{
    const uint32_t least = UINT32_C(0x3f666666), most = UINT32_C(0x3f8ccccd);
    return dqw_number_bits(cosine * cosine + sine * sine) - least <= most - least;
}

#ifdef __cplusplus
}
#endif
#endif
