// Domain knowledge of a permanent-magnet machine in whole numbers: what a block of samples says of it. Per unit of the
// full scales: resistance v/i, inductance v dt/i, flux v dt.
#ifndef DQW_MODEL_Q15_H
#define DQW_MODEL_Q15_H

#include <stdint.h>

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

/// What the end correction must know of a machine.
typedef struct dqw_machine_q15 {
    int64_t R_q40, L_q40[2];  ///< per unit of the full scales, d and q
    int64_t turn_q28;         ///< electrical angle a period at full speed, rad
} dqw_machine_q15;

/// Signals of the pair that `now` ends, as dqw_window_q15 gathers them: |x| <= 2^17, sums of two (the voltage alone) in
/// Q15, products in Q16.
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

/// Electrical angle per period at full speed of so many pole pairs, rad, Q28.
int64_t dqw_scale_turn_q28(const dqw_scale *scale, uint32_t pole_pairs);

/// A window's sums over their weight, or a settled row's, as a block.
///
/// Source   (E13), (E15) in docs/EQUATIONS.md
/// Range    weight >= 1
/// Cost     a division of 32 bits, 9 products of 32 by 32 bits
dqw_block_q15 dqw_model_block_q15(const int32_t sums[], uint16_t weight);

/// Replace the trapezoid means of a block's currents by the exact ones.
///
/// Source   (E16) in docs/EQUATIONS.md
/// Range    as dqw_model_bow in lib/; without effect where R or an inductance is not positive
/// Context  once a block; no state
void dqw_model_correct_q15(dqw_block_q15 *b, const dqw_machine_q15 *known);

#ifdef __cplusplus
}
#endif
#endif
