// Small questions about numbers that several files ask, answered from their bits: so that a compiler that is told that there is no NaN and
// no infinity (-ffast-math) answers them too.
#ifndef DQW_NUMBER_H
#define DQW_NUMBER_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// A deviation that is not known: larger than all others, and finite. Ask `sd < DQW_UNKNOWN`.
#define DQW_UNKNOWN 3.4e38f

/// The number's bits as IEEE 754 has them: sign, exponent, fraction.
static inline uint32_t dqw_bits(float x)
{
    const union {
        float number;
        uint32_t bits;
    } both = {x};
    return both.bits;
}

/// Neither NaN nor infinity.
static inline bool dqw_is_finite(float x)
{
    return (dqw_bits(x) & 0x7fffffffu) < 0x7f800000u;
}

/// |x| <= limit; false for NaN.
/// Range    limit >= 0
static inline bool dqw_within(float x, float limit)
{
    return (dqw_bits(x) & 0x7fffffffu) <= dqw_bits(limit);
}

/// A number above zero.
static inline bool dqw_is_positive(float x)
{
    return dqw_bits(x) - 1u < 0x7f7fffffu;
}

/// A number that is not negative.
static inline bool dqw_is_zero_or_positive(float x)
{
    return dqw_bits(x) < 0x7f800000u || dqw_bits(x) == 0x80000000u;
}

/// Cosine and sine of one angle, within what a sensor's amplitude leaves open.
static inline bool dqw_is_direction(float cosine, float sine)
{
    if (!dqw_within(cosine, 1.01f) || !dqw_within(sine, 1.01f)) return false;
    const float square = cosine * cosine + sine * sine;
    return square > 0.9f && square < 1.1f;
}

#ifdef __cplusplus
}
#endif
#endif
