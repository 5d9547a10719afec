// The Learner: one neuron. It knows nothing of motors.
#ifndef DQW_LEARNER_H
#define DQW_LEARNER_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_number.h"
#include "dqw_size.h"
#include "dqw_status.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Asks for a loop of a few known turns to be unrolled where a size setting would not.
#if defined(__GNUC__) && !defined(__clang__)
#define DQW_UNROLL _Pragma("GCC unroll 8")
#else
#define DQW_UNROLL
#endif

/// What a neuron is told at the start.
typedef struct dqw_learner_config {
    int inputs;                        ///< 1 .. DQW_LEARNER_INPUTS
    float step_size;                   ///< normalised step, 0 < step_size < 2; 0.5 is a good start
    float x_base[DQW_LEARNER_INPUTS];  ///< what one unit of each input is, in the input's own unit; > 0. (P15)
    float y_base;       ///< the same for the target; > 0, and y_base / x_base, what a weight is counted in, too
    bool noisy_inputs;  ///< inputs as noisy as the target, per unit: minimise the orthogonal distance
    bool indicator;     ///< watch the weight of a constant input, W_o, as convergence indicator
} dqw_learner_config;

/// One neuron. Weights are kept per unit; dqw_learner_weight() restores them.
typedef struct dqw_learner {
    float w_pu[DQW_LEARNER_INPUTS];
    /// Weight of the constant input 1, per unit of y_base: 0 when nothing is left to learn. It watches: it is learned
    /// from the same error, but is no part of the output, where it would compete with the weight of an input that
    /// hardly varies.
    float w_o;
    float x_scale[DQW_LEARNER_INPUTS];
    float y_base;
    float step_size;
    uint32_t learned;  ///< samples learned
    uint32_t skipped;  ///< samples skipped because they were not finite
    uint8_t inputs;
    bool noisy_inputs;
    bool indicator;
} dqw_learner;

/// Make a Learner, all weights zero.
///
/// Source   Fig. 2; (P15)
/// Returns  DQW_OK; DQW_ERR_NULL, DQW_ERR_SIZE or DQW_ERR_RANGE, and then *l is untouched
/// Context  at start; one writer per object
#define dqw_learner_init DQW_SIZED(dqw_learner_init)
enum dqw_status dqw_learner_init(dqw_learner *l, const dqw_learner_config *config);

/// Forward mode: the output for these inputs.
///
/// Source   (P12); (E4) in docs/EQUATIONS.md
/// Shape    x[inputs], read only
/// Units    x in the inputs' own units; returns the target's own unit
/// Range    any float; non-finite in, non-finite out
/// Cost     3 n + 1 flops; no loop depends on data
/// Context  ISR safe; reads *l only
float dqw_learner_forward(const dqw_learner *l, const float x[]);

/// Learning mode: predict, compare, correct; one normalised step.
///
/// Source   (P13), (P14); (E5), with noisy_inputs (E6), in docs/EQUATIONS.md
/// Shape    x[inputs], read only
/// Units    x, target in their own units
/// Range    any float; a non-finite sample is skipped and counted
/// Returns  the error before the correction, in the target's unit; 0 if the sample was skipped
/// Cost     7 n + 10 flops, two divisions; no loop depends on data
/// Context  ISR safe; one writer per object
float dqw_learner_learn(dqw_learner *l, const float x[], float target);

/// The paper's neuron and nothing else, for signals that are per unit already: predict, compare, correct. With a
/// constant n the compiler unrolls it: docs/firmware.md has the instructions of both axes.
///
/// Source   (P13), (P14); (E5) in docs/EQUATIONS.md
/// Shape    w_pu[n] read and written, x_pu[n] read only
/// Units    per unit
/// Range    any float; an error that is not finite, or beyond 1000 bases, teaches nothing
/// Returns  the error before the correction
/// Cost     6 n + 4 flops, one division
/// Context  ISR safe; one writer per w_pu
static inline float dqw_learner_step_pu(float w_pu[], const float x_pu[], int n, float target_pu, float step_size)
{
    // [LMS.1] to [LMS.3] of dqw_learner_learn, the constant input counted in the norm
    float e_pu = target_pu;
    float norm = 1.0f;
    DQW_UNROLL
    for (int i = 0; i < n; i++) {
        e_pu -= w_pu[i] * x_pu[i];
        norm += x_pu[i] * x_pu[i];
    }
    if (dqw_within(e_pu, 1e3f)) {
        const float g = step_size * e_pu / norm;
        DQW_UNROLL
        for (int i = 0; i < n; i++) w_pu[i] += g * x_pu[i];
    }
    return e_pu;
}

/// The weight of input i in the target's unit per the input's unit.
///
/// Source   (P15); (E7) in docs/EQUATIONS.md
/// Range    i in 0 .. inputs-1; NaN outside
/// Context  ISR safe
float dqw_learner_weight(const dqw_learner *l, int i);

/// Set a weight, in the target's unit per the input's unit: a nominal value to start from. Refused as a whole if not
/// finite.
///
/// Source   (P15); (E7) in docs/EQUATIONS.md
/// Returns  DQW_OK, DQW_ERR_SIZE for i out of range, DQW_ERR_RANGE for a non-finite value
enum dqw_status dqw_learner_set_weight(dqw_learner *l, int i, float weight);

#ifdef __cplusplus
}
#endif
#endif
