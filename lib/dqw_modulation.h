// Which legs of the inverter switch. A leg that rests in a period has no dead time there. Integers alone, for both
// arithmetics.
#ifndef DQW_MODULATION_H
#define DQW_MODULATION_H

#include <stdbool.h>
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
static inline uint8_t dqw_modulation_resting(enum dqw_modulation modulation, const int32_t v[3])
{
    const bool low = modulation == DQW_MODULATION_CLAMPED_LOW;
    const bool far = modulation == DQW_MODULATION_CLAMPED_60;
    if (!low && !far && modulation != DQW_MODULATION_CLAMPED_HIGH) return 0;
    // The leg that rests has the largest of these; a size is wrong by one in the last place below zero.
    const int32_t a = low || (far && v[0] < 0) ? ~v[0] : v[0];
    const int32_t b = low || (far && v[1] < 0) ? ~v[1] : v[1];
    const int32_t c = low || (far && v[2] < 0) ? ~v[2] : v[2];
    if (b > a) return c > b ? 4 : 2;
    return c > a ? 4 : 1;
}

#ifdef __cplusplus
}
#endif
#endif
