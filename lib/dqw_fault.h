// Which fault is it? Each fault leaves a pattern in what the estimator and the witness learned; the pattern that leaves
// least unexplained names it.
#ifndef DQW_FAULT_H
#define DQW_FAULT_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_fault_name.h"
#include "dqw_parts.h"

#ifdef __cplusplus
extern "C" {
#endif

/// What the machine is, for the patterns.
typedef struct dqw_fault_machine {
    float R_ohm, L_H;
    float w_e_rad_s;    ///< (E177)'s mean
    bool observed;      ///< by an observer's angle: its L_q tells nothing of the voltage
    float dead_time_V;  ///< healthy
} dqw_fault_machine;

/// Name what changed.
///
/// Source   (E64) in docs/EQUATIONS.md
/// Shape    change[], unit[]: DQW_SIGNS, read only. change: R, L_d, L_q, flux as parts of the healthy ones, V, rad,
///          then the witness' weights, SI, resistance's as the ripple at that speed; unit: deviation of each that
///          means nothing, > 0, DQW_UNKNOWN or more where it is not known
/// Returns  DQW_FAULT_UNKNOWN where no pattern explains most of it
/// Cost     about 2000 flops: once an event
/// Context  background; no state
#define dqw_fault_name_it DQW_SIZED(dqw_fault_name_it)
dqw_fault_verdict dqw_fault_name_it(const float change[], const float unit[], dqw_fault_machine machine);

#ifdef __cplusplus
}
#endif
#endif
