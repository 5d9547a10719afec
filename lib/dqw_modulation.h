// Which legs of the inverter switch. A leg that rests in a period has no dead time there. Integers alone, for both
// arithmetics.
#ifndef DQW_MODULATION_H
#define DQW_MODULATION_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// How the inverter makes its voltage.
enum dqw_modulation {
    DQW_MODULATION_CENTRED = 0,   ///< all three legs switch in every period: sine, third harmonic, space vectors
    DQW_MODULATION_CLAMPED_LOW,   ///< the lowest phase rests on the negative rail
    DQW_MODULATION_CLAMPED_HIGH,  ///< the highest phase rests on the positive rail
    DQW_MODULATION_CLAMPED_60,    ///< the phase furthest from the middle rests, each on its rail for 60 degrees
    DQW_MODULATION_MASK,          ///< dqw_sample's resting says it
    DQW_MODULATIONS
};

/// The leg that rests while these phase voltages are made.
///
/// Source   (E101) in docs/EQUATIONS.md
/// Shape    v[3]: of a, b, c; any numbers in the order of the voltages, those below zero negative
/// Returns  bit 0, 1 or 2 for a, b or c; 0 where none rests, or a mask says it
/// Context  ISR safe; no state
uint8_t dqw_modulation_resting(enum dqw_modulation modulation, const int32_t v[3]);

#ifdef __cplusplus
}
#endif
#endif
