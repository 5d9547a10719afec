// The three stages of the paper's Fig. 1, the threshold, and the way back. Integers and booleans only.
#ifndef DQW_STAGE_H
#define DQW_STAGE_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_state.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Blocks that stage 2 may take.
#define DQW_STAGE_RANDOM_BLOCKS 2000u
/// Blocks that stage 3 takes before it is judged.
#define DQW_STAGE_ORDINAL_BLOCKS 500u

/// Begin in stage 1. threshold_ppm: residual over voltage, RMS, that stage 3 must reach; 0: 50000.
/// Source   Fig. 1; (E21) in docs/EQUATIONS.md
void dqw_stage_init(dqw_stage *s, uint32_t threshold_ppm);

/// Domain knowledge is defined, or defined anew after a way back: go to stage 2. Elsewhere without effect. After a way
/// back the owner first makes its Learners anew, with what the domain knowledge had lacked: dqw_estimator_define() does
/// both.
/// Source   Fig. 1; (E21) in docs/EQUATIONS.md
void dqw_stage_define(dqw_stage *s);

/// One block on. random_converged: every Random Learner has; residual_ppm: over the last blocks.
///
/// Source   Fig. 1; (E21) in docs/EQUATIONS.md
/// Returns  true if the stage changed
/// Cost     a few comparisons
/// Context  ISR safe; one writer per object
bool dqw_stage_step(dqw_stage *s, bool random_converged, uint32_t residual_ppm);

/// Is what was learned before this block about the start? Then it counts for a quarter from here on: after 50, 100, 200
/// and 400 blocks.
///
/// Source   (E194) in docs/EQUATIONS.md
/// Cost     a few comparisons
/// Context  ISR safe; no state
bool dqw_stage_forgets(uint32_t blocks);

#ifdef __cplusplus
}
#endif
#endif
