// For the tracker's own files: a block as the joint neuron is shown it, and how noisy that is.
#ifndef DQW_TRACKER_ROWS_Q15_H
#define DQW_TRACKER_ROWS_Q15_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_tracker_q15.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Nominal parameters as parts of the full voltage at full scale of what they act on.
typedef struct dqw_tracker_nominal_q15 {
    int64_t R_q40;      ///< at the full current
    int64_t L_q40[2];   ///< at a step by the full current in one period, d and q
    int64_t X_q40[2];   ///< at full current and speed
    int64_t psi_q40;    ///< at full speed
    int64_t width_q40;  ///< of dead time, in full currents; 0: no dead time is learned
} dqw_tracker_nominal_q15;

/// One block's rows.
typedef struct dqw_tracker_rows_q15 {
    int32_t x_q28[2][DQW_TRACK_Q15_WEIGHTS];     ///< inputs of d and q
    int32_t y_q28[2];                            ///< targets
    int64_t var_q56[2][DQW_TRACK_Q15_WEIGHTS];   ///< variances of the inputs' noise,
    int64_t speed_q56[2];                        ///< covariance of the speed's two inputs in a row,
    int64_t dead_in_R_q56[2], R_in_dead_q56[2];  ///< and those of dead time's with R's
    int64_t least_q56[DQW_TRACK_Q15_WEIGHTS];    ///< power below which an input teaches nothing, without noise
} dqw_tracker_rows_q15;

/// Nominal values of a configuration; false where they do not fit: 8 times the full voltage, 2^12 times by a step.
bool dqw_tracker_nominal_of_q15(const dqw_tracker_q15_config *config, dqw_tracker_nominal_q15 *n);

/// The rows of the block that waits, from its sums.
///
/// Source   (E13), (E16), (E60) in docs/EQUATIONS.md
/// Cost     about 100 products of 64 bits
/// Context  background
void dqw_tracker_rows_of_q15(const dqw_tracker_q15 *t, dqw_tracker_rows_q15 *r);

/// One axis' row to the sums, around the weights as solved last; weighed by how little of that axis is noise.
///
/// Source   (E61), (E70) in docs/EQUATIONS.md
/// Format   weigh_q24 up to 8: one over the root of the axis' part of the variance
/// Returns  the error before the correction, Q28, bounded
/// Context  background
int32_t dqw_tracker_show_q15(dqw_tracker_q15 *t, int axis, const dqw_tracker_rows_q15 *r, uint32_t mask, int64_t weigh_q24);

/// Noise of the inputs turns the gradient by C w: put back, b += C w. Not where it is much of what was learned, there it could run away.
///
/// Source   (E60), (E70) in docs/EQUATIONS.md: (A^-1)(b + C w) is w + P C w
/// Format   by_q24[2]: the weighing of d and q, squared
/// Context  background
void dqw_tracker_take_noise_out_q15(dqw_tracker_q15 *t, const dqw_tracker_rows_q15 *r, const int64_t by_q24[], const uint32_t mask[]);

/// A parameter may wander: its variance grows with the time since it last grew, up to where it started or to what the sums can hold, 2^21.
///
/// Source   (E61), (E71) in docs/EQUATIONS.md
/// Context  background
void dqw_tracker_drift_q15(dqw_tracker_q15 *t);

/// Weights that explain all that was shown; the sums go on around them.
///
/// Source   (E70) in docs/EQUATIONS.md
/// Context  background
void dqw_tracker_solve_q15(dqw_tracker_q15 *t);

/// Variance of an axis' residual, and of both, never below that of the sampling, Q56.
///
/// Source   (E61) in docs/EQUATIONS.md
/// Context  background
int64_t dqw_tracker_variance_q56(const dqw_tracker_q15 *t, int axis);
int64_t dqw_tracker_common_variance_q56(const dqw_tracker_q15 *t);

#ifdef __cplusplus
}
#endif
#endif
