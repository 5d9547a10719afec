// What sets faults apart, in both arithmetics.
#ifndef DQW_FAULT_KIND_H
#define DQW_FAULT_KIND_H

#include <stdbool.h>

#include "dqw_fault_name.h"

#ifdef __cplusplus
extern "C" {
#endif

/// A change either way is this fault. No fault makes an inverter lose less.
static inline bool dqw_fault_either_sign(enum dqw_fault_name name)
{
    return name == DQW_FAULT_ENCODER_OFFSET || name == DQW_FAULT_CURRENT_GAIN || name == DQW_FAULT_VOLTAGE_SCALE;
}

/// It changes R, and no heat has.
static inline bool dqw_fault_moves_R(enum dqw_fault_name name)
{
    return name == DQW_FAULT_PHASE_CONNECTION || name == DQW_FAULT_CURRENT_GAIN || name == DQW_FAULT_RESISTANCE_RISE ||
           name == DQW_FAULT_VOLTAGE_SCALE;
}

/// A ripple twice a turn, or that there is none, is part of its pattern.
static inline bool dqw_fault_ripples(enum dqw_fault_name name)
{
    return name == DQW_FAULT_PHASE_CONNECTION || name == DQW_FAULT_CURRENT_GAIN || name == DQW_FAULT_TURN_SHORT ||
           name == DQW_FAULT_RESISTANCE_RISE;
}

#ifdef __cplusplus
}
#endif
#endif
