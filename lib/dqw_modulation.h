// Which legs of the inverter switch. A leg that rests in a period has no dead time there. Integers alone, for both
// arithmetics.
#ifndef DQW_MODULATION_H
#define DQW_MODULATION_H

#include <stdint.h>

#include "dqw_modulation_name.h"

#ifdef __cplusplus
extern "C" {
#endif

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
