// Has it changed? A sequential detector: a cumulative sum that grows while a deviation is beyond its band. Integers only.
#ifndef DQW_CHANGE_H
#define DQW_CHANGE_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// One band, in the format of a deviation.
#define DQW_CHANGE_BAND_Q8 256

typedef struct dqw_change {
    int16_t sum_q8;      ///< how long and how far beyond, 0 .. limit
    uint16_t above;      ///< steps since the sum was last 0: since when
} dqw_change;

/// Nothing seen yet.
void dqw_change_init(dqw_change *c);

/// One step on: the sum gains what the deviation is beyond its band, or loses what it is within.
///
/// Source   Page's cumulative sum; (E63) in docs/EQUATIONS.md
/// Units    deviation_q8: size over band, Q8, >= 0; taken as four bands where it is more
/// Range    limit_q8 in 1 .. 32767
/// Returns  true while the sum is at its limit
/// Cost     a few comparisons
/// Context  ISR safe; one writer per object
bool dqw_change_step(dqw_change *c, int32_t deviation_q8, int16_t limit_q8);

#ifdef __cplusplus
}
#endif
#endif
