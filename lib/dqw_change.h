// Has it changed? A sequential detector: a cumulative sum that grows while a deviation is beyond its band. Integers
// only.
#ifndef DQW_CHANGE_H
#define DQW_CHANGE_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_state.h"

#ifdef __cplusplus
extern "C" {
#endif

/// One band, in the format of a deviation.
#define DQW_CHANGE_BAND_Q5 32

/// Nothing seen yet.
void dqw_change_init(dqw_change *c);

/// One step on: the sum gains what the deviation is beyond its band, or loses what it is within.
///
/// Source   Page's cumulative sum; (E63) in docs/EQUATIONS.md
/// Units    deviation_q5: size over band, Q5, >= 0; taken as four bands where it is more
/// Range    limit_q5 in 1 .. 255
/// Returns  true while the sum is at its limit
/// Cost     a few comparisons
/// Context  ISR safe; one writer per object
bool dqw_change_step(dqw_change *c, int32_t deviation_q5, uint8_t limit_q5);

#ifdef __cplusplus
}
#endif
#endif
