// Domain knowledge of a permanent-magnet machine: what each axis' Learner is shown, and what its weights mean.
#ifndef DQW_MODEL_H
#define DQW_MODEL_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_axis.h"
#include "dqw_sample.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Signals of one consecutive pair, and of a block of them. Means over the period; di is the slope.
typedef struct dqw_block {
    float v_d_V, v_q_V;
    float i_d_A, i_q_A;
    float di_d_A_s, di_q_A_s;
    float wi_d_A_rad_s, wi_q_A_rad_s;  ///< w_m times current
    float w_m_rad_s;
} dqw_block;

/// Signals in a dqw_block, in the order of its fields.
#define DQW_BLOCK_SIGNALS 9

/// Inputs of an axis' neuron, in this order. The d-axis has no flux input.
enum dqw_model_input { DQW_IN_R = 0, DQW_IN_L, DQW_IN_CROSS, DQW_IN_FLUX };
#define DQW_D_INPUTS 3
#define DQW_Q_INPUTS 4

/// What the weights of both axes say together. A parameter whose bit is missing from `known` has no meaning.
typedef struct dqw_parameters {
    float R_ohm, Ld_H, Lq_H, psi_Wb;
    float R_sd_ohm, Ld_sd_H, Lq_sd_H, psi_sd_Wb;
    float misfit_pu2;         ///< mean squared residual, per block, that one machine for both axes adds to the axes' own
    float pole_pairs_raw;     ///< p as the cross weights tell it, before it is taken for an integer; NaN where they cannot
    float pole_pairs_raw_sd;  ///< its evidence
    uint16_t pole_pairs;      ///< given, or the integer that the evidence leaves; 0: not known
    uint8_t known;            ///< DQW_KNOWS_* bits
#if DQW_EFFECT_WEIGHTS > 0
    float effect[DQW_EFFECT_WEIGHTS];  ///< the effects' weights, SI, in the order of the configuration
    float effect_sd[DQW_EFFECT_WEIGHTS];
#endif
} dqw_parameters;

enum dqw_model_known {
    DQW_KNOWS_R = 1 << 0,
    DQW_KNOWS_LD = 1 << 1,
    DQW_KNOWS_LQ = 1 << 2,
    DQW_KNOWS_PSI = 1 << 3,
    DQW_KNOWS_POLE_PAIRS = 1 << 4,
};

/// A parameter counts as known below this ratio of standard deviation to value.
#define DQW_KNOWN_RATIO 0.25f

/// One consecutive pair: row k-1 and row k.
///
/// Source   (P6), (P7) integrated over one period; (E13) in docs/EQUATIONS.md
/// Units    SI; dt_s > 0
/// Cost     25 flops
/// Context  ISR safe; no state
dqw_block dqw_model_pair(const dqw_sample *before, const dqw_sample *now, float dt_s);

/// A settled row: no slope.
/// Source   (P6), (P7) with d/dt = 0; (E14) in docs/EQUATIONS.md
dqw_block dqw_model_static(const dqw_sample *s);

/// Replace the trapezoid means of a block's currents by the exact ones, as far as R, L and p are known.
///
/// Source   Euler-Maclaurin end correction for a voltage held in the stationary frame; (E16) in docs/EQUATIONS.md
/// Range    without effect where an inductance is not positive, R dt / L or w_e dt is above 1, or the correction is not small
/// Cost     35 flops, 2 divisions
/// Context  ISR safe; no state
void dqw_model_correct(dqw_block *b, const dqw_parameters *known, float dt_s);

/// What the end correction must know of a machine.
typedef struct dqw_machine {
    float R_ohm, Ld_H, Lq_H, pole_pairs;
} dqw_machine;

/// The same, of a machine that is known.
///
/// Source   (E16) in docs/EQUATIONS.md
/// Range    as dqw_model_correct
/// Cost     35 flops, 2 divisions
/// Context  ISR safe; no state
void dqw_model_bow(dqw_block *b, const dqw_machine *known, float dt_s);

/// Inputs of the axes' neurons for a block: x_d[DQW_D_INPUTS] with target v_d, x_q[DQW_Q_INPUTS] with target v_q.
/// Source   (E13), (E14) in docs/EQUATIONS.md
void dqw_model_inputs(const dqw_block *b, float x_d[], float x_q[]);

/// How the axes' residuals weigh against each other in what both say of R, L_d and L_q.
enum dqw_model_weight {
    DQW_WEIGHT_EACH = 0,  ///< each by its own variance: right for noise
    DQW_WEIGHT_COMMON,    ///< both alike: settled points, where most of what is left is not noise
};

/// Weights of both axes to R, L_d, L_q, psi and p, each weighed by what was learned of it. Inputs beyond an axis' own are
/// effects' (dqw_effect.h), as many and in the same order on both axes: one joint system with the rest.
///
/// Source   generalised least squares over both axes; (E18), (E22) in docs/EQUATIONS.md
/// Units    pole_pairs: the given number, 0 if p is to be found from the cross weights
/// Range    a parameter is known where it is positive, its deviation is below a quarter of it, and its regressors are not
///          mostly noise
/// Cost     about 800 flops, with n effect weights 5 (4 + n)^3 more: for the background, or once a block
/// Context  reads d and q only
dqw_parameters dqw_model_read(const dqw_axis *d, const dqw_axis *q, uint16_t pole_pairs, enum dqw_model_weight weight);

#ifdef __cplusplus
}
#endif
#endif
