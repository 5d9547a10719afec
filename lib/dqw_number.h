// Small questions about numbers that several files ask. By the bits, so that -ffinite-math-only, under which a compiler may take every number for
// finite, changes no answer.
#ifndef DQW_NUMBER_H
#define DQW_NUMBER_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// A deviation that nobody knows: finite, and larger than any that is known.
#define DQW_UNKNOWN 3.4e38f

/// Bits of the size of a number: as integers they have the order of the numbers, infinity and then NaN above all.
static inline uint32_t dqw_size_bits(float x)
{
    union {
        float number;
        uint32_t bits;
    } u;
    u.number = x;
    return u.bits & 0x7fffffffu;
}

/// Neither NaN nor infinity.
static inline bool dqw_is_finite(float x)
{
    return dqw_size_bits(x) < 0x7f800000u;
}

/// |x| <= limit; false for NaN and infinity. limit: finite, >= 0.
static inline bool dqw_within(float x, float limit)
{
    return dqw_size_bits(x) <= dqw_size_bits(limit);
}

/// A number above zero.
static inline bool dqw_is_positive(float x)
{
    return dqw_is_finite(x) && x > 0.0f;
}

/// A number that is not negative.
static inline bool dqw_is_zero_or_positive(float x)
{
    return dqw_is_finite(x) && x >= 0.0f;
}

#ifdef __cplusplus
}
#endif
#endif
