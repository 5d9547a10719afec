// The three stages of the paper's Fig. 1, the threshold, and the way back. Integers and booleans only.
#ifndef DQW_STAGE_H
#define DQW_STAGE_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_state.h"

#ifdef __cplusplus
extern "C" {
#endif

/// What a block brought.
typedef struct dqw_stage_input {
    bool random_converged;         ///< every Random Learner has
    uint32_t residual_ppm;         ///< over all blocks
    uint32_t residual_recent_ppm;  ///< over the last blocks
} dqw_stage_input;

/// Begin in stage 1. Zero counts are taken as 1, counts above 65535 as that.
/// Source   Fig. 1; (E21) in docs/EQUATIONS.md
void dqw_stage_init(dqw_stage *s, uint32_t threshold_ppm, uint32_t random_limit, uint32_t ordinal_blocks);

/// Domain knowledge is defined, or defined anew after a way back: go to stage 2. Elsewhere without effect. After a way
/// back the owner first makes its Learners anew, with what the domain knowledge had lacked: dqw_estimator_define() does
/// both.
/// Source   Fig. 1; (E21) in docs/EQUATIONS.md
void dqw_stage_define(dqw_stage *s);

/// One block on.
///
/// Source   Fig. 1; (E21) in docs/EQUATIONS.md
/// Returns  true if the stage changed
/// Cost     a few comparisons
/// Context  ISR safe; one writer per object
bool dqw_stage_step(dqw_stage *s, dqw_stage_input in);

#ifdef __cplusplus
}
#endif
#endif
