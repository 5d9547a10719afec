// What stands on a motor's nameplate, and what follows from it: every configuration's defaults start here.
#ifndef DQW_NAMEPLATE_H
#define DQW_NAMEPLATE_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// What is on a motor's nameplate.
typedef struct dqw_nameplate {
    float dt_s;           ///< PWM period
    float v_V;            ///< rated phase voltage, peak: as a rule the DC link's over the root of 3
    float i_A;            ///< rated phase current, peak
    float w_m_rad_s;      ///< highest mechanical speed
    uint16_t pole_pairs;  ///< 0: not known
} dqw_nameplate;

#ifdef __cplusplus
}
#endif
#endif
