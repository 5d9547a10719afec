// The Random Learner in fixed point: which samples a neuron is shown. The same reservoir and the same draws as
// dqw_random.
#ifndef DQW_RANDOM_Q15_H
#define DQW_RANDOM_Q15_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_draw.h"
#include "dqw_learner_q15.h"
#include "dqw_status.h"

#ifdef __cplusplus
extern "C" {
#endif

/// One remembered sample.
typedef struct dqw_random_sample_q15 {
    int16_t x_q15[DQW_LEARNER_INPUTS_Q15];  ///< inputs
    int16_t target_q15;                     ///< what they should give
} dqw_random_sample_q15;

/// What a Random Learner's reservoir is told at the start.
typedef struct dqw_random_config_q15 {
    dqw_random_sample_q15 *reservoir;  ///< the caller's memory; stays in use as long as the object
    uint32_t capacity;                 ///< samples that it holds, >= 2
    uint32_t draws;                    ///< samples shown in an epoch, 1 .. capacity; the paper: 50 of 301
    uint32_t seed;                     ///< of the draw; 0 is taken as 1
    uint16_t tolerance_q15;  ///< converged when an epoch moves no weight by more than this part of the largest, > 0
} dqw_random_config_q15;

/// The samples that a Random Learner is shown.
typedef struct dqw_random_q15 {
    dqw_random_sample_q15 *reservoir;
    dqw_draw draw;
    int32_t before_q31[DQW_LEARNER_INPUTS_Q15 + 1];  ///< the weights at the epoch's start, W_o last
    uint16_t tolerance_q15;
    bool converged;
} dqw_random_q15;

/// Make an empty reservoir.
///
/// Source   section 4.2 of the paper: 50 samples drawn at random out of 301; (E8) in docs/EQUATIONS.md
/// Returns  DQW_OK; DQW_ERR_NULL, DQW_ERR_SIZE or DQW_ERR_RANGE, and then *r is untouched
enum dqw_status dqw_random_init_q15(dqw_random_q15 *r, const dqw_random_config_q15 *config);

/// Offer a sample to the reservoir: kept with probability capacity / seen, in place of a random other.
///
/// Source   reservoir sampling; (E8) in docs/EQUATIONS.md
/// Shape    x_q15[inputs], read only
/// Cost     one draw, one copy of a sample
/// Context  ISR safe; one writer per object
void dqw_random_put_q15(dqw_random_q15 *r, const int16_t x_q15[], int inputs, int16_t target_q15);

/// One iteration: show the Learner the next sample of the epoch. An epoch shows `draws` samples, none twice.
///
/// Source   section 4.2 of the paper; (E8) in docs/EQUATIONS.md
/// Returns  true once an epoch has moved no weight, W_o included, by more than the tolerance; then stays true
/// Cost     dqw_learner_learn_q15, one draw; an empty reservoir does nothing
/// Context  background, or the ISR where no dqw_random_put_q15 can come between; the reservoir's order changes
bool dqw_random_iterate_q15(dqw_random_q15 *r, dqw_learner_q15 *l);

/// The rest of an epoch at once.
/// Returns  as dqw_random_iterate_q15
/// Cost     up to `draws` times dqw_random_iterate_q15
bool dqw_random_epoch_q15(dqw_random_q15 *r, dqw_learner_q15 *l);

#ifdef __cplusplus
}
#endif
#endif
