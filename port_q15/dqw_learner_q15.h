// The Learner in fixed point: one neuron. It knows nothing of motors.
#ifndef DQW_LEARNER_Q15_H
#define DQW_LEARNER_Q15_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_q15.h"
#include "dqw_status.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Most inputs that a Learner takes, the constant input not counted: with seven, a sum of products in Q28 could leave
/// 32 bits.
#define DQW_LEARNER_INPUTS_Q15 6

/// What a neuron is told at the start.
typedef struct dqw_learner_config_q15 {
    int inputs;              ///< 1 .. DQW_LEARNER_INPUTS_Q15
    uint16_t step_size_q15;  ///< normalised step, 0 < step_size < 2; 16384, a half, is a good start
    bool noisy_inputs;       ///< inputs as noisy as the target, per unit: minimise the orthogonal distance
    bool indicator;          ///< watch the weight of a constant input, W_o, as convergence indicator
} dqw_learner_config_q15;

/// One neuron. Signals are per unit of their full scales, and so are the weights: |w| <= 1, where they stop. That loses
/// nothing: it is the nearest point to where they would go, and so no farther from any point within. Choose full scales
/// with which the truth lies within.
typedef struct dqw_learner_q15 {
    int32_t w_q31[DQW_LEARNER_INPUTS_Q15];
    /// Weight of the constant input 1: 0 when nothing is left to learn. It watches, as in dqw_learner, errors up to 1.
    int32_t w_o_q31;
    uint32_t learned;  ///< samples learned
    uint16_t step_size_q15;
    uint8_t inputs;
    bool noisy_inputs;
    bool indicator;
} dqw_learner_q15;

/// Make a Learner, all weights zero.
///
/// Source   Fig. 2
/// Returns  DQW_OK; DQW_ERR_NULL, DQW_ERR_SIZE or DQW_ERR_RANGE, and then *l is untouched
/// Context  at start; one writer per object
enum dqw_status dqw_learner_init_q15(dqw_learner_q15 *l, const dqw_learner_config_q15 *config);

/// Forward mode: the output for these inputs.
///
/// Source   (P12); (E4) in docs/EQUATIONS.md
/// Shape    x_q15[inputs], read only
/// Format   the rounded top 16 bits of a weight times Q15; returns Q28
/// Range    any x_q15; |output| <= inputs, no sum leaves 32 bits
/// Cost     n products of 16 by 16 bits
/// Context  ISR safe; reads *l only
int32_t dqw_learner_forward_q15(const dqw_learner_q15 *l, const int16_t x_q15[]);

/// Learning mode: predict, compare, correct; one normalised step.
///
/// Source   (P13), (P14); (E5), with noisy_inputs (E6), in docs/EQUATIONS.md
/// Shape    x_q15[inputs], read only
/// Format   returns Q28; the step is computed in 64 bits
/// Range    any x_q15, target_q15; whether a signal is beyond its full scale is the gate's question. An error of which
///          the step takes more than one full scale is learned as one
/// Returns  the error before the correction
/// Cost     2 n + 4 products of 32 by 32 bits; one inverse, with noisy_inputs two. No loop depends on data but a search
///          for a leading one
/// Context  ISR safe, though made for the background: in an interrupt take dqw_learner_step_pu_q15; one writer per
///          object
int32_t dqw_learner_learn_q15(dqw_learner_q15 *l, const int16_t x_q15[], int16_t target_q15);

/// The paper's neuron and nothing else: predict, compare, correct. With a constant n the compiler unrolls it.
///
/// Source   (P13), (P14); (E5) in docs/EQUATIONS.md
/// Shape    w_q31[n] read and written, x_q15[n] read only; n in 1 .. DQW_LEARNER_INPUTS_Q15
/// Format   products of 16 by 16 bits from the weights' rounded top halves; the gain has 29 fraction bits, the
///          correction 31
/// Range    any; a weight stops at +-1. Inputs of -32768, which a gate keeps out, may make the error wrong by 4 where
///          two weights stand at -1. Where step_size |error| is above norm / 2 it is learned as that: with a step size
///          up to a half an error up to 1 is learned whole. No step stalls above a gain of 2^-30: at step size 0.001
///          that is an error of 1e-6
/// Returns  the error before the correction, Q28
/// Cost     2 n products of 16 by 16 bits, n of 32 by 32 (where a core keeps no upper half 2 n of 16 by 16), 4 for the
///          gain, one inverse; no loop depends on data
/// Context  ISR safe; one writer per w_q31
static inline int32_t dqw_learner_step_pu_q15(int32_t w_q31[], const int16_t x_q15[], int n, int16_t target_q15,
                                              uint16_t step_size_q15)
{
    // [LMS.1] to [LMS.3] of dqw_learner_learn, the constant input counted in the norm
    int32_t e_q28 = target_q15 * (1 << 13);
    uint32_t norm_q28 = 1u << 28;
    // From the last pair: an input without a partner comes while most registers are free.
    DQW_Q_UNROLL
    for (int i = (n - 1) / 2 * 2; i >= 0; i -= 2) {
        // |y_q30| < 2^31 for |x_q15| <= 32767
        uint32_t y_q30 = (uint32_t)dqw_q30_mul(w_q31[i], x_q15[i]) + 2u;
        uint32_t norm_q30 = (uint32_t)(x_q15[i] * x_q15[i]);
        if (i + 1 < n) {
            y_q30 += (uint32_t)dqw_q30_mul(w_q31[i + 1], x_q15[i + 1]);
            norm_q30 += (uint32_t)(x_q15[i + 1] * x_q15[i + 1]);
        }
        e_q28 -= dqw_q_floor32(dqw_q_signed32(y_q30), 2);  // |e_q28| <= (1 + n) 2^28 < 2^31
        norm_q28 += norm_q30 >> 2;                         // norm_q28 <= (1 + n) 2^28
    }
    const uint32_t inverse_q16 = dqw_q16_inverse((norm_q28 + (1u << 12)) >> 13);
    // |e| <= 1 + |x|_1 and norm = 1 + |x|^2: |e / norm| <= (1 + sqrt(1 + n)) / 2 < 2, and |g| < 4 before its bound
    const int32_t ratio_q28 = dqw_q_mul32x16(e_q28, inverse_q16, 16);
    const int32_t g_q29 = dqw_q28_sat(dqw_q_mul32x16(ratio_q28, step_size_q15, 14));
    DQW_Q_UNROLL
    for (int i = 0; i < n; i++) w_q31[i] = dqw_q31_add(w_q31[i], dqw_q31_mul(g_q29, x_q15[i]));
    return e_q28;
}

/// The weight of input i, per unit of the full scales: target_full / x_full of input i makes it one in SI.
///
/// Source   (P15); (E7) in docs/EQUATIONS.md
/// Range    i in 0 .. inputs-1; 0 outside
/// Context  ISR safe
int32_t dqw_learner_weight_q15(const dqw_learner_q15 *l, int i);

/// Set a weight, per unit: a nominal value to start from.
///
/// Source   (P15); (E7) in docs/EQUATIONS.md
/// Returns  DQW_OK, DQW_ERR_NULL, or DQW_ERR_SIZE for i out of range
enum dqw_status dqw_learner_set_weight_q15(dqw_learner_q15 *l, int i, int32_t w_q31);

#ifdef __cplusplus
}
#endif
#endif
