// What stands on a motor's nameplate, and what follows from it: every configuration's defaults start here.
#ifndef DQW_NAMEPLATE_H
#define DQW_NAMEPLATE_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct dqw_nameplate {
    float dt_s;           ///< PWM period
    float v_V;            ///< rated phase voltage, peak: as a rule the DC link's over the root of 3
    float i_A;            ///< rated phase current, peak
    float w_m_rad_s;      ///< highest mechanical speed
    uint16_t pole_pairs;  ///< 0: not known
} dqw_nameplate;

/// Pairs in half a block: a millisecond, less where the highest speed needs it.
///
/// Source   (E80) in docs/EQUATIONS.md
/// Range    any nameplate; a number that is none, or not positive, is as if it were not there, a period without one gives 20
/// Returns  5 .. 10000
/// Cost     3 divisions
/// Context  at start; no state
uint16_t dqw_nameplate_half_window(const dqw_nameplate *plate);

#ifdef __cplusplus
}
#endif
#endif
