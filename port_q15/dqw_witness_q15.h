// The witness in whole numbers: one complex neuron on what the estimator leaves over. Its inputs turn once and twice
// with the rotor: what a current sensor's offset, an unlike phase, an unlike sensor and shorted turns add. Knows
// nothing of faults' names.
#ifndef DQW_WITNESS_Q15_H
#define DQW_WITNESS_Q15_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_estimator_block_q15.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Weights, where they stop at 8: of the full current; of R's unit; of the mean of L_d's and L_q's units; of
/// dqw_witness_short_q40 over R's unit, a conductance.
typedef struct dqw_witness_q15 {
    int32_t re_q28[DQW_WITNESS_INPUTS], im_q28[DQW_WITNESS_INPUTS];
    int64_t power_q52[DQW_WITNESS_INPUTS];  ///< mean squared input, of the full voltage
    int64_t across_q52;  ///< mean product of resistance's input, turned by 90 degrees, and reactance's
    uint16_t blocks;     ///< learned, up to the memory
} dqw_witness_q15;

/// Forget everything.
void dqw_witness_init_q15(dqw_witness_q15 *w);

/// Learn the residual of the block that the estimator has just learned. Without effect where the angle is not known,
/// the machine turns too slowly to tell a ripple from a constant, or so fast that a block averages it away.
///
/// Source   (E62) in docs/EQUATIONS.md: all inputs share one error, each has its own mean power as step
/// Format   inputs in Q26, errors in Q28, of the full voltage
/// Returns  true if it learned
/// Cost     about 60 products and 10 quotients of free exponents; one cosine and sine
/// Context  background
#define dqw_witness_learn_q15 DQW_SIZED(dqw_witness_learn_q15)
bool dqw_witness_learn_q15(dqw_witness_q15 *w, const dqw_estimator_q15 *e, const dqw_estimator_q15_block *b);

/// R's unit over that and reactance's at full speed: what 1 of the short's weight takes at R's unit. Q40, 0 .. 1.
int64_t dqw_witness_short_q40(const dqw_estimator_q15_config *config);

/// Mean of L_d and L_q, in their units, as part of the mean of those: the unit of the reactance's weight. Q24
int32_t dqw_witness_mean_L_q24(const dqw_estimator_q15_config *config, int32_t Ld_q24, int32_t Lq_q24);

/// Size of a weight, and its standard deviation (of one of its two parts); INT32_MAX for what is not known.
/// Source   (E62) in docs/EQUATIONS.md
/// Format   Q28
int32_t dqw_witness_size_q28(const dqw_witness_q15 *w, enum dqw_witness_input input);
int32_t dqw_witness_sd_q28(const dqw_witness_q15 *w, const dqw_estimator_q15 *t, enum dqw_witness_input input);

/// Mean speed of what it remembers: reactance's input over resistance's, turned by 90 degrees; 0 where there is none.
/// Source   (E177) in docs/EQUATIONS.md
/// Format   Q24
int32_t dqw_witness_speed_q24(const dqw_witness_q15 *w);

#ifdef __cplusplus
}
#endif
#endif
