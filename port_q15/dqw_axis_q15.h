// The neuron of one axis: its weights, the normal equations that correct them, and what it leaves unexplained.
#ifndef DQW_AXIS_Q15_H
#define DQW_AXIS_Q15_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_normal_q15.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Blocks over which the residual's statistics are means.
#define DQW_AXIS_Q15_MEMORY 10000u

/// Blocks that only teach.
#define DQW_AXIS_Q15_FIRST 8u

/// What a start value is believed: a millionth of one block of full scale.
#define DQW_AXIS_Q15_PRIOR_Q32 4295

typedef struct dqw_axis_q15 {
    dqw_normal_q15 normal;
    int64_t w_q40[DQW_NORMAL_INPUTS];      ///< as solved last, per unit of the full scales
    int64_t start_q40[DQW_NORMAL_INPUTS];  ///< what a weight is that was never learned
    int64_t error_q56;                     ///< mean squared residual,
    int64_t lag_q56;                       ///< its product with the last one's,
    int64_t recent_q56;                    ///< the same over the last fifty blocks,
    int64_t target_q56;                    ///< and the mean squared target
    int32_t error_last_q28;
    uint32_t blocks;
} dqw_axis_q15;

/// Make an axis. start_q40[inputs]: per unit of the full scales.
///
/// Source   (E17), (E70) in docs/EQUATIONS.md
/// Returns  as dqw_normal_init_q15
enum dqw_status dqw_axis_init_q15(dqw_axis_q15 *a, int inputs, const int64_t start_q40[]);

/// Learn a block: predict, compare, gather. The weights themselves move at dqw_axis_solve_q15().
///
/// Source   (E4), (E70) in docs/EQUATIONS.md
/// Format   x_q28[inputs], target_q28
/// Shape    excited: bit i where input i is large enough to teach its weight
/// Returns  the error before the correction, Q28, bounded
/// Cost     n (n + 3) / 2 + 4 products of 32 by 32 bits, n of 64 by 32
/// Context  one writer per object
int32_t dqw_axis_learn_q15(dqw_axis_q15 *a, const int32_t x_q28[], int32_t target_q28, uint32_t excited);

/// Weights, covariances and what is left, from all that was learned.
/// Cost     dqw_normal_solve_q15
/// Context  background, or once in a few blocks
void dqw_axis_solve_q15(dqw_axis_q15 *a, dqw_solution_q15 *out);

/// Variance of a block's residual, Q56, and the part of 1 by which the likeness of neighbours widens it, Q20.
/// Source   (E20) in docs/EQUATIONS.md
int64_t dqw_axis_variance_q56(const dqw_axis_q15 *a, const dqw_solution_q15 *s);
int64_t dqw_axis_inflation_q20(const dqw_axis_q15 *a);

#ifdef __cplusplus
}
#endif
#endif
