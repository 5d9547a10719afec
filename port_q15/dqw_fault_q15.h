// Which fault is it, in whole numbers: the patterns of dqw_fault.h, in parts of the nominal values.
#ifndef DQW_FAULT_Q15_H
#define DQW_FAULT_Q15_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_fault_name.h"

#ifdef __cplusplus
extern "C" {
#endif

/// What the machine is, for the patterns, in the witness' units.
typedef struct dqw_fault_machine_q15 {
    int32_t R_q24, L_q24;   ///< of the nominal R, of the mean of the nominal L_d and L_q
    int64_t short_q40;      ///< dqw_witness_short_q40()
    int32_t speed_q24;      ///< (E177)'s mean: reactance's input over resistance's
    bool observed;          ///< by an observer's angle: its L_q tells nothing of the voltage
    int32_t dead_time_q24;  ///< healthy
} dqw_fault_machine_q15;

/// Which fault it is.
typedef struct dqw_fault_verdict_q15 {
    enum dqw_fault_name name;  ///< DQW_FAULT_UNKNOWN where no pattern fits
    uint16_t confidence_q15;   ///< 0 .. 32768: how much of what changed the pattern explains, against the next best one
    uint8_t phase;             ///< 0, 1, 2: a, b, c, where the fault has one
} dqw_fault_verdict_q15;

/// Name what changed.
///
/// Source   (E64) in docs/EQUATIONS.md
/// Shape    change_q24[], unit_q24[]: DQW_SIGNS, read only
/// Format   Q24. change: R, L_d, L_q, flux as parts of the healthy ones, dead time in its weight's unit, rad, then the
///          witness' weights, resistance's as the ripple at that speed; unit: deviation of each that means nothing,
///          > 0; INT32_MAX where it is not known
/// Returns  DQW_FAULT_UNKNOWN where no pattern explains most of it
/// Cost     about 500 products of free exponents: once an event
/// Context  background; no state
#define dqw_fault_name_it_q15 DQW_SIZED(dqw_fault_name_it_q15)
dqw_fault_verdict_q15 dqw_fault_name_it_q15(const int32_t change_q24[], const int32_t unit_q24[],
                                            dqw_fault_machine_q15 machine);

#ifdef __cplusplus
}
#endif
#endif
