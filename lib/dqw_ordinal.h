// The Ordinal Learner: consecutive pairs {x, y}_{j-1} -> {x, y}_j of a first-order circuit, and R from its two weights.
#ifndef DQW_ORDINAL_H
#define DQW_ORDINAL_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_gain.h"
#include "dqw_status.h"

#ifdef __cplusplus
extern "C" {
#endif

/// What stands for y's own past.
enum dqw_ordinal_form {
    /// y's own past, z^-1 y, is what the neuron itself put out: noise on y then biases nothing. The default.
    DQW_ORDINAL_OUTPUT_ERROR = 0,
    /// z^-1 y is measured, as in the paper: biased by noise on y (10 % noise reads R 20 to 30 % high).
    DQW_ORDINAL_PAIRS,
};

/// How R and L are read from the weights.
enum dqw_ordinal_discretisation {
    DQW_ORDINAL_EXACT = 0,  ///< x held from sample to sample
    /// the paper's backward difference, (P21) with its signs corrected: from z^-1 y it reads R high by T R / 2 L
    DQW_ORDINAL_BACKWARD,
};

/// What an Ordinal Learner is told at the start.
typedef struct dqw_ordinal_config {
    float dt_s;                                      ///< sampling period, > 0
    float x_base;                                    ///< base of x, V, > 0
    float y_base;                                    ///< base of y, A, > 0
    float R_ohm;                                     ///< start value, > 0
    float L_H;                                       ///< start value, > 0
    enum dqw_ordinal_form form;                      ///< what z^-1 y is
    enum dqw_ordinal_discretisation discretisation;  ///< how R and L are read
} dqw_ordinal_config;

/// An Ordinal Learner.
typedef struct dqw_ordinal {
    dqw_gain gain;
    float b_pu, a;      ///< weights of x and of z^-1 y; output error: as the last epoch left them
    float delta_pu[2];  ///< output error: the correction of {b, a} that this epoch is learning
    float w_o;          ///< weight of the constant input, per unit of y_base: convergence indicator, see dqw_learner
    float y_hat_pu;     ///< output error: the neuron's own output
    float s_pu[2];      ///< output error: its sensitivity to {b, a}
    float x_last_pu, y_last_pu;
    float x_scale, y_scale, dt_s;
    uint32_t learned, skipped, epochs;
    enum dqw_ordinal_form form;
    enum dqw_ordinal_discretisation discretisation;
    bool started;
    uint8_t restless;  ///< epochs in a row that moved the weights
    bool from_pairs;   ///< output error: this epoch learns from pairs, for a start near enough to be linear
    bool converged;
} dqw_ordinal;

/// Make an Ordinal Learner for L dy/dt = x - R y.
///
/// Source   (P16) to (P21), the sign slips of (P21) corrected; (E9), (E11), (E12) in docs/EQUATIONS.md
/// Returns  DQW_OK; DQW_ERR_NULL or DQW_ERR_RANGE, and then *o is untouched
#define dqw_ordinal_init DQW_SIZED(dqw_ordinal_init)
enum dqw_status dqw_ordinal_init(dqw_ordinal *o, const dqw_ordinal_config *config);

/// Show the next sample of an epoch, in the order of time.
///
/// Source   (E9), (E12) in docs/EQUATIONS.md
/// Units    x_V: mean voltage across R and L from this sample to the next; y_A: the current at this sample
/// Range    any float; a sample that is not finite, or beyond 1000 bases, is skipped and counted, and the chain starts
///          anew after it
/// Cost     about 40 flops; no loop depends on data
/// Context  ISR safe; one writer per object
void dqw_ordinal_step(dqw_ordinal *o, float x_V, float y_A);

/// End an epoch: take its correction over, forget its gain.
///
/// Returns  true once an epoch has moved both weights by less than 1e-4 of themselves
/// Context  background
bool dqw_ordinal_end_epoch(dqw_ordinal *o);

/// R from the weight of x.  Source (E10), (E11) in docs/EQUATIONS.md.  Needs no inductance with the exact form.
/// Units    ohm; L_H in H is used by the backward difference alone. NaN where the weights have no such meaning
float dqw_ordinal_R_from_x(const dqw_ordinal *o, float L_H);

/// R from the weight of z^-1 y.  Source (E10), (E11) in docs/EQUATIONS.md
/// Units    ohm; L_H in H. NaN where the weights have no such meaning
float dqw_ordinal_R_from_y(const dqw_ordinal *o, float L_H);

#ifdef __cplusplus
}
#endif
#endif
