// How noisy the sensors are, from single rows: what least squares on noisy inputs must know, or it shrinks the weights.
#ifndef DQW_NOISE_H
#define DQW_NOISE_H

#include <stdint.h>

#include "dqw_parts.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Rows over which the variances are means.
#define DQW_NOISE_MEMORY 8192u

/// Forget everything.
void dqw_noise_init(dqw_noise *n);

/// Begin again: what was measured counts no more from the next row on.
void dqw_noise_anew(dqw_noise *n);

/// Time has jumped: the next row does not follow the last one. Variances stay.
void dqw_noise_gap(dqw_noise *n);

/// One consecutive pair: the step of each current less T/L times its voltage, and the step of the speed; and T/L times
/// the voltage on d, which may answer the noise.
///
/// Source   (E60) in docs/EQUATIONS.md: E (e_k - e_k-3)(e_k-1 - e_k-2) = -2 var(i), whatever is slow, and whatever the
///          voltage's noise; (E189) for the answer
/// Units    SI
/// Range    finite
/// Cost     25 flops, one division
/// Context  ISR safe; one writer per object
void dqw_noise_step(dqw_noise *n, float e_d_A, float e_q_A, float w_step_rad_s, float made_d_A);

/// A variance as read: never negative.
static inline float dqw_noise_variance(float mean)
{
    return mean > 0.0f ? mean : 0.0f;
}

#ifdef __cplusplus
}
#endif
#endif
