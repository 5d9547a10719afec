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
    int64_t R_q40;        ///< at the full current
    int64_t L_q40[2];     ///< at a step by the full current in one period, d and q
    int64_t X_q40[2];     ///< at full current and speed
    int64_t psi_q40;      ///< at full speed
    int64_t width_q40;    ///< of dead time, in full currents; 0: no dead time is learned
} dqw_tracker_nominal_q15;

/// One block's rows.
typedef struct dqw_tracker_rows_q15 {
    int32_t x_q28[2][DQW_TRACK_Q15_WEIGHTS];      ///< inputs of d and q
    int32_t y_q28[2];                             ///< targets
    int64_t var_q56[2][DQW_TRACK_Q15_WEIGHTS];    ///< variances of the inputs' noise,
    int64_t speed_q56[2];                         ///< covariance of the speed's two inputs in a row,
    int64_t dead_in_R_q56[2], R_in_dead_q56[2];   ///< and those of dead time's with R's
    int64_t least_q56[DQW_TRACK_Q15_WEIGHTS];     ///< power below which an input teaches nothing, without noise
} dqw_tracker_rows_q15;

/// Nominal values of a configuration; false where they do not fit: 8 times the full voltage, 2^12 times by a step.
bool dqw_tracker_nominal_of_q15(const dqw_tracker_q15_config *config, dqw_tracker_nominal_q15 *n);

/// The rows of the block that waits, from its sums.
///
/// Source   (E13), (E16), (E60) in docs/EQUATIONS.md
/// Cost     about 100 products of 64 bits
/// Context  background
void dqw_tracker_rows_of_q15(const dqw_tracker_q15 *t, dqw_tracker_rows_q15 *r);

#ifdef __cplusplus
}
#endif
#endif
