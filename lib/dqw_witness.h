// The witness: one complex neuron on what the estimator leaves over. Its inputs turn once and twice with the rotor:
// what a current sensor's offset, an unlike phase, an unlike sensor and shorted turns add. Knows nothing of faults'
// names.
#ifndef DQW_WITNESS_H
#define DQW_WITNESS_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_estimator_block.h"
#include "dqw_parts.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Forget everything.
void dqw_witness_init(dqw_witness *w);

/// Learn the residual of the block that the estimator has just learned. Without effect where the angle is not known,
/// the machine turns too slowly to tell a ripple from a constant, or so fast that a block averages it away.
///
/// Source   (E62) in docs/EQUATIONS.md: all inputs share one error, each has its own mean power as step
/// Returns  true if it learned
/// Cost     about 150 flops, 5 divisions
/// Context  background
#define dqw_witness_learn DQW_SIZED(dqw_witness_learn)
bool dqw_witness_learn(dqw_witness *w, const dqw_estimator *e, const dqw_estimator_block *block);

/// Size of a weight, and its standard deviation (of one of its two parts), SI; DQW_UNKNOWN until the memory is full.
/// Source   (E62) in docs/EQUATIONS.md
float dqw_witness_size(const dqw_witness *w, enum dqw_witness_input input);
float dqw_witness_sd(const dqw_witness *w, const dqw_estimator *e, enum dqw_witness_input input);

/// Mean electrical speed of what it remembers, weighted by resistance's input, rad/s; 0 where there is none.
/// Source   (E177) in docs/EQUATIONS.md
float dqw_witness_speed(const dqw_witness *w);

#ifdef __cplusplus
}
#endif
#endif
