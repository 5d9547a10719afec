// The three stages of the paper's Fig. 1, the threshold, and the way back. Integers and booleans only.
#ifndef DQW_STAGE_H
#define DQW_STAGE_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum dqw_stage_name {
    DQW_STAGE_DOMAIN = 0,  ///< 1: domain knowledge: which Learners, with which inputs. Waits for dqw_stage_define()
    DQW_STAGE_RANDOM,      ///< 2: random learning: coarse weights from a reservoir
    DQW_STAGE_ORDINAL,     ///< 3: ordinal learning: fine weights from consecutive samples
    DQW_STAGE_IN_SERVICE,  ///< threshold met: fit for diagnosis
};

/// Why the machine went back to stage 1.
enum dqw_stage_back {
    DQW_BACK_NONE = 0,       ///< it never did
    DQW_BACK_NOT_CONVERGED,  ///< the Random Learners did not settle within their limit of blocks
    DQW_BACK_THRESHOLD,      ///< ordinal learning is done, but the residual is above the threshold
    DQW_BACK_LEFT_BAND,      ///< the residual rose above the threshold while in service
};

typedef struct dqw_stage {
    uint32_t threshold_ppm;   ///< of residual over voltage, RMS
    uint32_t blocks;          ///< blocks spent in this stage
    uint32_t residual_ppm;    ///< at the last way back
    uint16_t random_limit;    ///< blocks that stage 2 may take
    uint16_t ordinal_blocks;  ///< blocks that stage 3 takes before it is judged
    uint16_t times_back;      ///< up to 65535
    enum dqw_stage_name name;
    enum dqw_stage_back back;
} dqw_stage;

/// What a block brought.
typedef struct dqw_stage_input {
    bool random_converged;         ///< every Random Learner has
    uint32_t residual_ppm;         ///< over all blocks
    uint32_t residual_recent_ppm;  ///< over the last blocks
} dqw_stage_input;

/// Begin in stage 1. Zero counts are taken as 1, counts above 65535 as that.
/// Source   Fig. 1; (E21) in docs/EQUATIONS.md
void dqw_stage_init(dqw_stage *s, uint32_t threshold_ppm, uint32_t random_limit, uint32_t ordinal_blocks);

/// Domain knowledge is defined, or defined anew after a way back: go to stage 2. Elsewhere without effect. After a way back
/// the owner first makes its Learners anew, with what the domain knowledge had lacked: dqw_estimator_define() does both.
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
