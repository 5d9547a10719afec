// Domain knowledge of a permanent-magnet machine: what a block of samples says of it.
#ifndef DQW_MODEL_H
#define DQW_MODEL_H

#include "dqw_sample.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Signals of a block of consecutive pairs. Means over the periods; di is the slope.
typedef struct dqw_block {
    float v_d_V, v_q_V;
    float i_d_A, i_q_A;
    float di_d_A_s, di_q_A_s;
    float wi_d_A_rad_s, wi_q_A_rad_s;  ///< w_m times current
    float w_m_rad_s;
} dqw_block;

/// Signals in a dqw_block, in the order of its fields.
#define DQW_BLOCK_SIGNALS 9

/// One consecutive pair: row k-1 and row k.
///
/// Source   (P6), (P7) integrated over one period; (E13) in docs/EQUATIONS.md
/// Units    SI; dt_s > 0
/// Cost     25 flops
/// Context  any; no state
dqw_block dqw_model_pair(const dqw_sample *before, const dqw_sample *now, float dt_s);

/// A settled row: a pair with itself has no slope.
/// Source   (P6), (P7) with d/dt = 0; (E14) in docs/EQUATIONS.md
static inline dqw_block dqw_model_static(const dqw_sample *s)
{
    return dqw_model_pair(s, s, 1.0f);
}

/// What the end correction must know of a machine.
typedef struct dqw_machine {
    float R_ohm, Ld_H, Lq_H, pole_pairs;
} dqw_machine;

/// Replace the trapezoid means of a block's currents by the exact ones.
///
/// Source   Euler-Maclaurin end correction for a voltage held in the stationary frame; (E16) in docs/EQUATIONS.md
/// Range    without effect where an inductance is not positive, R dt / L or w_e dt is above 1, or the correction is not
///          small
/// Cost     35 flops, 2 divisions
/// Context  background; no state
void dqw_model_bow(dqw_block *b, const dqw_machine *known, float dt_s);

#ifdef __cplusplus
}
#endif
#endif
