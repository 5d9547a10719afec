// Normal equations: the joint neuron's gain in the form that suits integers. Sums of products, exact to their last bit,
// solved when somebody asks for the weights. The same estimate as dqw_gain's recursion, and no error gathers from step
// to step.
#ifndef DQW_NORMAL_Q15_H
#define DQW_NORMAL_Q15_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_size.h"
#include "dqw_status.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Most inputs, those of the effects included, and one that only watches.
#define DQW_NORMAL_INPUTS (DQW_PARAMETERS + DQW_EFFECT_WEIGHTS + 1)

typedef struct dqw_normal_q15 {
    int64_t a_q32[DQW_NORMAL_INPUTS * (DQW_NORMAL_INPUTS + 1) /
                  2];                  ///< sums of x_i x_j, column by column of the upper triangle
    int64_t b_q32[DQW_NORMAL_INPUTS];  ///< sums of x_i y
    int64_t c_q32;                     ///< sum of y y
    uint8_t inputs;
} dqw_normal_q15;

/// Where the sum of inputs i, j stands, i <= j.
#define DQW_NORMAL_A(i, j) ((j) * ((j) + 1) / 2 + (i))

/// What the sums say.
typedef struct dqw_solution_q15 {
    int64_t w_q40[DQW_NORMAL_INPUTS];    ///< weights, per unit of the bases; |w| < 2^22
    int64_t cov_q40[DQW_NORMAL_INPUTS];  ///< diagonal of the inverse of the sums, per unit; INT64_MAX: never learned
    uint32_t out;                        ///< bit i: the pivot of input i vanished; its weight stays at its start
    int64_t left_q32;                    ///< sum of the squared residuals, >= 0
} dqw_solution_q15;

/// Nothing seen, weights start_q40[inputs] believed as much as a sum of prior_q32[inputs] would make them.
///
/// Source   (E17), (E70) in docs/EQUATIONS.md
/// Returns  DQW_OK; DQW_ERR_NULL, DQW_ERR_SIZE or DQW_ERR_RANGE, and then *n is untouched
#define dqw_normal_init_q15 DQW_SIZED(dqw_normal_init_q15)
enum dqw_status dqw_normal_init_q15(dqw_normal_q15 *n, int inputs, const int64_t prior_q32[],
                                    const int64_t start_q40[]);

/// Learn one row.
///
/// Source   (E70) in docs/EQUATIONS.md
/// Format   x_q28[inputs], y_q28
/// Range    |x|, |y| < 2^31; 2^31 rows of bases fit, then all sums halve
/// Cost     n (n + 3) / 2 + 1 products of 32 by 32 bits
/// Context  background, or once a block
void dqw_normal_add_q15(dqw_normal_q15 *n, const int32_t x_q28[], int32_t y_q28);

/// Weight i may have changed: its variance grows by q, as P grows in (E105); its value stays.
///
/// Source   (E71) in docs/EQUATIONS.md
/// Format   q_q40: per unit squared, per unit of the residual's variance; >= 0
/// Cost     n (n + 1) / 2 products of 32 by 32 bits, one division of 32
void dqw_normal_grow_q15(dqw_normal_q15 *n, int i, int64_t q_q40);

/// All rows so far count for a quarter.
///
/// Source   (E194) in docs/EQUATIONS.md
/// Cost     n (n + 3) + 2 shifts of 64 bits
void dqw_normal_forget_q15(dqw_normal_q15 *n);

/// Noughts: weights that start there, or whose start nobody asks for.
#define dqw_normal_nought_q40 DQW_SIZED(dqw_normal_nought_q40)
extern const int64_t dqw_normal_nought_q40[DQW_NORMAL_INPUTS];

/// Solve by Cholesky's factors of the sums, scaled by powers of two. Leaves out what was never learned.
///
/// Source   (E70) in docs/EQUATIONS.md
/// Shape    start_q40[inputs]: what a weight that was left out is
/// Cost     about n^3 / 2 products, n square roots and n divisions of 32 bits
#define dqw_normal_solve_q15 DQW_SIZED(dqw_normal_solve_q15)
void dqw_normal_solve_q15(const dqw_normal_q15 *n, const int64_t start_q40[], dqw_solution_q15 *out);

/// Of two rows of inputs, of each input what the others do not explain, as far as the sums know: P x, over each
/// weight's own P_ii; 0 of one that was never learned.
///
/// Source   (E103) in docs/EQUATIONS.md
/// Shape    x_q28[2][], read and written
/// Range    any; the result is bounded
/// Cost     as dqw_normal_solve_q15, about
#define dqw_normal_alone_q15 DQW_SIZED(dqw_normal_alone_q15)
void dqw_normal_alone_q15(const dqw_normal_q15 *n, int32_t x_q28[2][DQW_NORMAL_INPUTS]);

#ifdef __cplusplus
}
#endif
#endif
