// What follows from full scales for a configuration's defaults: dqw_nameplate in integers.
#ifndef DQW_NAMEPLATE_Q15_H
#define DQW_NAMEPLATE_Q15_H

#include <stdint.h>

#include "dqw_scale.h"

#ifdef __cplusplus
extern "C" {
#endif

/// What is on a motor's nameplate.
typedef struct dqw_nameplate_q15 {
    uint32_t dt_ns;       ///< PWM period
    uint32_t v_mV, i_mA;  ///< rated phase voltage and current, peak
    uint32_t w_mrad_s;    ///< rated mechanical speed
    uint16_t pole_pairs;  ///< 0: not known
} dqw_nameplate_q15;

/// Pairs in half a block: a millisecond, less where the full scale's speed needs it.
///
/// Source   (E80) in docs/EQUATIONS.md
/// Range    any scale; zero is as if it were not there, a period of zero gives 20
/// Returns  5 .. 10000
/// Cost     3 divisions of 64 bits
/// Context  at start; no state
uint16_t dqw_nameplate_half_window_q15(const dqw_scale *scale);

#ifdef __cplusplus
}
#endif
#endif
