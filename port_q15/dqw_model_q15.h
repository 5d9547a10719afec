// Domain knowledge of a permanent-magnet machine in whole numbers: what each axis' neuron is shown, and what its weights mean. Per unit of
// the full scales: resistance v/i, inductance v dt/i, flux v dt.
#ifndef DQW_MODEL_Q15_H
#define DQW_MODEL_Q15_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_axis_q15.h"
#include "dqw_q15.h"
#include "dqw_scale.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Signals of a block, Q28 of the full scales: means, the currents' steps in a period, speed times current.
typedef struct dqw_block_q15 {
    int32_t v_d, v_q, i_d, i_q, di_d, di_q, wi_d, wi_q, w_m;
} dqw_block_q15;

/// Signals in a dqw_block_q15, in the order of its fields.
#define DQW_BLOCK_Q15_SIGNALS 9

/// Inputs of an axis' neuron, in this order, as in dqw_model.h: R, L, the other axis' L through the speed; on q the flux.
#define DQW_D_Q15_INPUTS 3
#define DQW_Q_Q15_INPUTS 4

enum dqw_parameter_q15 { DQW_R_Q15 = 0, DQW_LD_Q15, DQW_LQ_Q15, DQW_PSI_Q15, DQW_PARAMETERS_Q15 };

/// What the weights of both axes say together.
typedef struct dqw_parameters_q15 {
    int64_t value_q40[DQW_PARAMETERS_Q15];  ///< per unit of the full scales: times v/i, v dt/i, v dt/i, v dt they are SI
    int64_t sd_q40[DQW_PARAMETERS_Q15];     ///< INT64_MAX: not known
    uint16_t pole_pairs;                    ///< given, or found; 0: not known
    uint8_t known;                          ///< bits 0 .. 3 as the parameters, bit 4 the pole pairs
#if DQW_EFFECT_WEIGHTS > 0
    int64_t effect_q40[DQW_EFFECT_WEIGHTS];  ///< the effects' weights, per unit of their inputs' bases, in the order of the configuration
    int64_t effect_sd_q40[DQW_EFFECT_WEIGHTS];
#endif
} dqw_parameters_q15;

/// Signals of the pair that `now` ends, as dqw_window_q15 gathers them: |x| <= 2^17, sums of two (the voltage alone) in Q15, products in Q16.
///
/// Source   (P6), (P7) integrated over one period; (E13) in docs/EQUATIONS.md
/// Shape    pair[DQW_BLOCK_Q15_SIGNALS], written
/// Range    both samples admitted by the gate
/// Cost     4 products of 16 by 16 bits
/// Context  ISR safe; no state
static inline void dqw_model_pair_q15(const dqw_sample_q15 *before, const dqw_sample_q15 *now, int32_t pair[])
{
    pair[0] = before->v_d_q15;
    pair[1] = before->v_q_q15;
    pair[2] = before->i_d_q15 + now->i_d_q15;
    pair[3] = before->i_q_q15 + now->i_q_q15;
    pair[4] = now->i_d_q15 - before->i_d_q15;
    pair[5] = now->i_q_q15 - before->i_q_q15;
    // Q30 to Q16. Admitted signals are within 32766, so that two products and the rounding stay below 2^31
    pair[6] = dqw_q_round32(before->w_m_q15 * before->i_d_q15 + now->w_m_q15 * now->i_d_q15, 14);
    pair[7] = dqw_q_round32(before->w_m_q15 * before->i_q_q15 + now->w_m_q15 * now->i_q_q15, 14);
    pair[8] = before->w_m_q15 + now->w_m_q15;
}

/// Electrical angle per period of one pole pair at full speed, rad, Q28.
int64_t dqw_scale_angle_q28(const dqw_scale *scale);

/// The same of the scale's pole pairs.
int64_t dqw_scale_turn_q28(const dqw_scale *scale);

/// A window's sums over their weight, or a settled row's, as a block.
///
/// Source   (E13), (E15) in docs/EQUATIONS.md
/// Range    weight >= 1
/// Cost     a division of 32 bits, 9 products of 32 by 32 bits
dqw_block_q15 dqw_model_block_q15(const int32_t sums[], uint16_t weight);

/// A settled row as a block's sums of weight 1: no slope.
///
/// Source   (P6), (P7) with d/dt = 0; (E14) in docs/EQUATIONS.md
/// Shape    sums[DQW_BLOCK_Q15_SIGNALS], written
/// Context  ISR safe; no state
static inline void dqw_model_row_q15(const dqw_sample_q15 *s, int32_t sums[])
{
    dqw_model_pair_q15(s, s, sums);
}

/// Replace the trapezoid means of a block's currents by the exact ones, as far as R, L and p are known.
///
/// Source   (E16) in docs/EQUATIONS.md
/// Range    as dqw_model_correct in lib/
/// Context  once a block; no state
void dqw_model_correct_q15(dqw_block_q15 *b, const dqw_parameters_q15 *known, const dqw_scale *scale);

/// Inputs of the axes' neurons, Q28: x_d[DQW_D_Q15_INPUTS], x_q[DQW_Q_Q15_INPUTS].
/// Source   (E13), (E14) in docs/EQUATIONS.md
void dqw_model_inputs_q15(const dqw_block_q15 *b, int32_t x_d[], int32_t x_q[]);

/// Weights of both axes to R, L_d, L_q, psi and p, each weighed by what was learned of it. Solves both axes on the way. Inputs beyond an axis'
/// own are effects' (dqw_effect_q15.h), as many and in the same order on both axes: one joint system with the rest.
///
/// Source   (E18), (E22) in docs/EQUATIONS.md
/// Range    a parameter is known where it is positive, its deviation is below a quarter of it, and its regressors are not mostly noise
/// Cost     three times dqw_normal_solve_q15
/// Context  background, or once in a few blocks
dqw_parameters_q15 dqw_model_read_q15(dqw_axis_q15 *d, dqw_axis_q15 *q, const dqw_scale *scale, bool settled);

#ifdef __cplusplus
}
#endif
#endif
