// One axis' terminal Learner: all Learners of the axis share one neuron and one error, and know how sure they are.
#ifndef DQW_AXIS_H
#define DQW_AXIS_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_gain.h"
#include "dqw_learner.h"
#include "dqw_status.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Blocks over which residual statistics are kept: a plain sum would stop growing in single precision.
#define DQW_AXIS_MEMORY 65536u

/// Start variance of a per-unit weight: 1000 bases of standard deviation, so that a start value is no prior.
#define DQW_AXIS_P0 1e6f

typedef struct dqw_axis {
    dqw_learner neuron;
    dqw_gain gain;
    // Means over all blocks, later over about the last DQW_AXIS_MEMORY: of the squared error, of the product of
    // neighbouring errors, of the squared target; and of the squared error over about the last 50.
    float error_pu2, lag_pu2, target_pu2, recent_pu2;
    float error_last_pu;
    uint32_t blocks;
} dqw_axis;

/// Make an axis from a Learner's configuration; its step size plays no part, the gain replaces it.
/// Returns  as dqw_learner_init
enum dqw_status dqw_axis_init(dqw_axis *a, const dqw_learner_config *config);

/// Learn one block.
///
/// Source   (E17) in docs/EQUATIONS.md: w += K e, the neuron's law with a gain that weighs in all that came before
/// Shape    x[inputs] read only
/// Units    x, target in their own units
/// Range    any float; a block that is not finite, or beyond 1e5 bases, is skipped and counted. Inputs whose bit in `excited` is 0 predict, but do not learn
/// Returns  the error before the correction, in the target's unit; 0 if skipped
/// Cost     as dqw_gain_step plus 8 n flops; no loop depends on data
/// Context  ISR safe; one writer per object
float dqw_axis_learn(dqw_axis *a, const float x[], float target, uint32_t excited);

/// Variance of one block's residual, per unit, and by how much neighbouring blocks' likeness widens a deviation.
/// Source   (E20) in docs/EQUATIONS.md
float dqw_axis_variance_pu2(const dqw_axis *a);
float dqw_axis_inflation(const dqw_axis *a);

/// Standard deviation of weight i in the target's unit per the input's unit; infinite where nothing was learned.
/// Source   (E20) in docs/EQUATIONS.md
float dqw_axis_weight_sd(const dqw_axis *a, int i);

/// Root mean square of the residual over that of the target, over all blocks and over about the last 50; 0 before the first block.
float dqw_axis_relative_residual(const dqw_axis *a);
float dqw_axis_relative_residual_recent(const dqw_axis *a);

#ifdef __cplusplus
}
#endif
#endif
