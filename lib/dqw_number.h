// Small questions about numbers that several files ask.
#ifndef DQW_NUMBER_H
#define DQW_NUMBER_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Neither NaN nor infinity, in three instructions where a library's isfinite() is a call.
static inline bool dqw_is_finite(float x)
{
    return x - x == 0.0f;
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
