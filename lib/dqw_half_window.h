// How long a block is, from a nameplate.
#ifndef DQW_HALF_WINDOW_H
#define DQW_HALF_WINDOW_H

#include "dqw_nameplate.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Pairs in half a block: a millisecond, less where the highest speed needs it.
///
/// Source   (E80) in docs/EQUATIONS.md
/// Range    any nameplate; a number that is none, or not positive, is as if it were not there, a period without one
///          gives 20
/// Returns  5 .. 10000
/// Cost     3 divisions
/// Context  at start; no state
uint16_t dqw_nameplate_half_window(const dqw_nameplate *plate);

#ifdef __cplusplus
}
#endif
#endif
