// The faults that the monitor has a name for, and the signs that they leave.
#ifndef DQW_FAULT_NAME_H
#define DQW_FAULT_NAME_H

#include "dqw_size.h"

#ifdef __cplusplus
extern "C" {
#endif

/// What has happened to a machine.
enum dqw_fault_name {
    DQW_FAULT_NONE = 0,
    DQW_FAULT_OVER_TEMPERATURE,  ///< R beyond what the temperature limit allows
    DQW_FAULT_DEMAGNETISATION,   ///< flux down, R not up
    DQW_FAULT_TURN_SHORT,  ///< a ripple at twice the frequency that follows the induced voltage; flux a little down
    DQW_FAULT_PHASE_CONNECTION,  ///< one phase's R up: a ripple at twice the frequency that follows the current
    DQW_FAULT_CURRENT_OFFSET,    ///< a ripple once a turn
    /// one phase's sensor: a ripple at twice the frequency that follows current and speed; R, L with it
    DQW_FAULT_CURRENT_GAIN,
    DQW_FAULT_ENCODER_OFFSET,   ///< the magnet's flux shows on the other axis
    DQW_FAULT_BEARING_WEAR,     ///< friction up, in both directions
    DQW_FAULT_INVERTER_FAULT,   ///< dead time up
    DQW_FAULT_RESISTANCE_RISE,  ///< all phases' R up, alike and faster than heat
    DQW_FAULT_VOLTAGE_SCALE,    ///< R, L and flux changed by one factor: it is the voltage's
    DQW_FAULT_UNKNOWN,          ///< changed, and no pattern fits: trace it
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
#if DQW_MAP_WEIGHTS > 0
    DQW_SIGN_MAP_D,
    DQW_SIGN_MAP_Q,
#endif
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

#ifdef __cplusplus
}
#endif
#endif
