// The Random Learner: which samples a neuron is shown. A reservoir keeps a fair sample of all that has passed; a
// seeded draw picks from it, so that a stretch in which nothing happens cannot pull the weights along.
#ifndef DQW_RANDOM_H
#define DQW_RANDOM_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_draw.h"
#include "dqw_learner.h"
#include "dqw_status.h"

#ifdef __cplusplus
extern "C" {
#endif

/// One remembered sample.
typedef struct dqw_random_sample {
    float x[DQW_LEARNER_INPUTS];  ///< inputs
    float target;                 ///< what they should give
} dqw_random_sample;

/// What a Random Learner's reservoir is told at the start.
typedef struct dqw_random_config {
    dqw_random_sample *reservoir;  ///< the caller's memory; stays in use as long as the object
    uint32_t capacity;             ///< samples that it holds, >= 2
    uint32_t draws;                ///< samples shown in an epoch, 1 .. capacity; the paper: 50 of 301
    uint32_t seed;                 ///< of the draw; 0 is taken as 1
    float tolerance;  ///< converged when an epoch moves no weight by more than this part of the largest, > 0
} dqw_random_config;

/// The samples that a Random Learner is shown.
typedef struct dqw_random {
    dqw_random_sample *reservoir;
    dqw_draw draw;
    float before[DQW_LEARNER_INPUTS + 1];  ///< the weights at the epoch's start, W_o last
    float tolerance;
    bool converged;
} dqw_random;

/// Make an empty reservoir.
///
/// Source   section 4.2 of the paper: 50 samples drawn at random out of 301; (E8) in docs/EQUATIONS.md
/// Returns  DQW_OK; DQW_ERR_NULL, DQW_ERR_SIZE or DQW_ERR_RANGE, and then *r is untouched
#define dqw_random_init DQW_SIZED(dqw_random_init)
enum dqw_status dqw_random_init(dqw_random *r, const dqw_random_config *config);

/// Offer a sample to the reservoir: kept with probability capacity / seen, in place of a random other.
///
/// Source   reservoir sampling; (E8) in docs/EQUATIONS.md
/// Shape    x[inputs], read only
/// Cost     one draw, one copy of a sample
/// Context  ISR safe; one writer per object
void dqw_random_put(dqw_random *r, const float x[], int inputs, float target);

/// One iteration: show the Learner the next sample of the epoch. An epoch shows `draws` samples, none twice.
///
/// Source   section 4.2 of the paper; (E8) in docs/EQUATIONS.md
/// Returns  true once an epoch has moved no weight, W_o included, by more than the tolerance; then stays true
/// Cost     dqw_learner_learn, one draw; an empty reservoir does nothing
/// Context  background, or the ISR where no dqw_random_put can come between; the reservoir's order changes
bool dqw_random_iterate(dqw_random *r, dqw_learner *l);

/// The rest of an epoch at once.
/// Returns  as dqw_random_iterate
/// Cost     up to `draws` times dqw_random_iterate
bool dqw_random_epoch(dqw_random *r, dqw_learner *l);

#ifdef __cplusplus
}
#endif
#endif
