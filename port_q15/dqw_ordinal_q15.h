// The Ordinal Learner in fixed point: consecutive pairs {x, y}_{j-1} -> {x, y}_j of a first-order circuit, and R from
// its two weights.
//
// The float one learns by a recursion, sample by sample; this one by the sums of its normal equations, solved when the
// epoch ends. It is the same estimate, without rounding from step to step. So weights move at the end of an epoch only,
// and the indicator watches the error of those that the last epoch left.
#ifndef DQW_ORDINAL_Q15_H
#define DQW_ORDINAL_Q15_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_status.h"

#ifdef __cplusplus
extern "C" {
#endif

/// As enum dqw_ordinal_form.
enum dqw_ordinal_form_q15 { DQW_ORDINAL_OUTPUT_ERROR_Q15 = 0, DQW_ORDINAL_PAIRS_Q15 };

/// As enum dqw_ordinal_discretisation.
enum dqw_ordinal_discretisation_q15 { DQW_ORDINAL_EXACT_Q15 = 0, DQW_ORDINAL_BACKWARD_Q15 };

/// What an Ordinal Learner is told at the start.
typedef struct dqw_ordinal_config_q15 {
    uint32_t dt_ns;                                      ///< sampling period, 1 .. 10^9
    uint32_t x_full_mV;                                  ///< full scale of x, 1 .. 10^7
    uint32_t y_full_mA;                                  ///< full scale of y, 1 .. 10^7
    uint32_t R_uohm;                                     ///< start value, > 0
    uint32_t L_nH;                                       ///< start value, > 0
    enum dqw_ordinal_form_q15 form;                      ///< what z^-1 y is
    enum dqw_ordinal_discretisation_q15 discretisation;  ///< how R and L are read
} dqw_ordinal_config_q15;

/// An Ordinal Learner.
typedef struct dqw_ordinal_q15 {
    int64_t sum[5];     ///< of the regressors' products, 00, 01, 11, and of theirs with the error
    int32_t b_q27;      ///< weight of x, per unit, as the last epoch left it: |b| <= 8
    int32_t a_q31;      ///< weight of z^-1 y
    int32_t w_o_q27;    ///< mean error, per unit: convergence indicator, see dqw_learner
    int32_t y_hat_q27;  ///< output error: the neuron's own output, |y_hat| <= 8
    int32_t s_q19[2];   ///< output error: its sensitivity to {b, a}, |s| <= 2048
    uint32_t dt_ns, x_full_mV, y_full_mA;
    uint32_t summed;  ///< pairs in the sums
    uint32_t learned, skipped, epochs;
    int16_t x_last_q15, y_last_q15;
    uint8_t form, discretisation;
    uint8_t restless;  ///< epochs in a row that moved the weights
    bool started;
    bool from_pairs;  ///< output error: this epoch learns from pairs, for a start near enough to be linear
    bool converged;
} dqw_ordinal_q15;

/// Make an Ordinal Learner for L dy/dt = x - R y.
///
/// Source   (P16) to (P21), the sign slips of (P21) corrected; (E9), (E11), (E12) in docs/EQUATIONS.md
/// Range    b = (1 - exp(-R dt / L)) x_full / (R y_full), what a period of full voltage does to the current, per unit:
///          2^-12 .. 4 at the start
/// Returns  DQW_OK; DQW_ERR_NULL or DQW_ERR_RANGE, and then *o is untouched
enum dqw_status dqw_ordinal_init_q15(dqw_ordinal_q15 *o, const dqw_ordinal_config_q15 *config);

/// Show the next sample of an epoch, in the order of time.
///
/// Source   (E9), (E12) in docs/EQUATIONS.md
/// Format   x_q15: mean voltage across R and L from this sample to the next; y_q15: the current at this sample
/// Range    any; -32768, -32767 and 32767 count as beyond the full scale: skipped and counted, and the chain starts
///          anew after it. An epoch of more than 2^18 pairs, with pairs alone all epochs together of more than 2^31,
///          learns nothing from what is beyond that
/// Cost     pairs: 5 products of 16 by 16 bits, 2 of 32 by 32; output error: 10 of 32 by 32. No loop
/// Context  ISR safe; one writer per object
void dqw_ordinal_step_q15(dqw_ordinal_q15 *o, int16_t x_q15, int16_t y_q15);

/// End an epoch: solve, take its correction over, forget its sums (pairs alone never forget).
///
/// Returns  true once an epoch has moved both weights by less than 1e-4 of themselves
/// Cost     10 products, 2 quotients of 64 bits
/// Context  background
bool dqw_ordinal_end_epoch_q15(dqw_ordinal_q15 *o);

/// R from the weight of x.  Source (E10), (E11) in docs/EQUATIONS.md.  Needs no inductance with the exact form.
/// Format   micro-ohm; L_nH is used by the backward difference alone. 0 where the weights have no such meaning
int32_t dqw_ordinal_R_from_x_q15(const dqw_ordinal_q15 *o, uint32_t L_nH);

/// R from the weight of z^-1 y.  Source (E10), (E11) in docs/EQUATIONS.md
/// Format   micro-ohm
int32_t dqw_ordinal_R_from_y_q15(const dqw_ordinal_q15 *o, uint32_t L_nH);

#ifdef __cplusplus
}
#endif
#endif
