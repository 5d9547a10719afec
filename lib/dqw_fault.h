// Which fault is it? Each fault leaves a pattern in what the tracker and the witness learned; the pattern that leaves least unexplained
// names it.
#ifndef DQW_FAULT_H
#define DQW_FAULT_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum dqw_fault_name {
    DQW_FAULT_NONE = 0,
    DQW_FAULT_OVER_TEMPERATURE,  ///< R beyond what the temperature limit allows
    DQW_FAULT_DEMAGNETISATION,   ///< flux down, R not up
    DQW_FAULT_TURN_SHORT,        ///< a ripple at twice the frequency that follows the induced voltage; flux a little down
    DQW_FAULT_PHASE_CONNECTION,  ///< one phase's R up: a ripple at twice the frequency that follows the current
    DQW_FAULT_CURRENT_OFFSET,    ///< a ripple once a turn
    DQW_FAULT_CURRENT_GAIN,      ///< one phase's sensor: a ripple at twice the frequency that follows current and speed; R, L with it
    DQW_FAULT_ENCODER_OFFSET,    ///< the magnet's flux shows on the other axis
    DQW_FAULT_BEARING_WEAR,      ///< friction up, in both directions
    DQW_FAULT_INVERTER_FAULT,    ///< dead time changed
    DQW_FAULT_UNKNOWN,           ///< changed, and no pattern fits: trace it
    DQW_FAULT_NAMES
};

/// What changed, in deviations of its uncertainty: 0 where nothing did.
enum dqw_fault_sign {
    DQW_SIGN_R = 0,
    DQW_SIGN_LD,
    DQW_SIGN_LQ,
    DQW_SIGN_PSI,
    DQW_SIGN_DEAD_TIME,
    DQW_SIGN_ANGLE,
    DQW_SIGN_OFFSET_RE,
    DQW_SIGN_OFFSET_IM,
    DQW_SIGN_RESISTANCE_RE,
    DQW_SIGN_RESISTANCE_IM,
    DQW_SIGN_REACTANCE_RE,
    DQW_SIGN_REACTANCE_IM,
    DQW_SIGN_SHORT_RE,
    DQW_SIGN_SHORT_IM,
    DQW_SIGNS
};

/// What the machine is, for the patterns.
typedef struct dqw_fault_machine {
    float R_ohm, L_H;
} dqw_fault_machine;

typedef struct dqw_fault_verdict {
    enum dqw_fault_name name;
    float confidence;  ///< 0 .. 1: how much of what changed the pattern explains, against the next best one
    uint8_t phase;     ///< 0, 1, 2: a, b, c, where the fault has one
} dqw_fault_verdict;

/// Name what changed.
///
/// Source   (E64) in docs/EQUATIONS.md
/// Shape    change[], unit[]: DQW_SIGNS, read only. change: R, L_d, L_q, flux as parts of the healthy ones, V, rad, then the witness' weights, SI;
///          unit: deviation of each that means nothing, > 0, infinite where it is not known
/// Returns  DQW_FAULT_UNKNOWN where no pattern explains most of it
/// Cost     about 2000 flops: once an event
/// Context  background; no state
dqw_fault_verdict dqw_fault_name_it(const float change[], const float unit[], dqw_fault_machine machine);

#ifdef __cplusplus
}
#endif
#endif
