// What is on a motor's nameplate, and what follows from it.
#ifndef DQW_NAMEPLATE_H
#define DQW_NAMEPLATE_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct dqw_nameplate {
    float dt_s;           ///< PWM period
    float v_V, i_A;       ///< rated phase voltage and current, peak
    float w_m_rad_s;      ///< rated mechanical speed
    uint16_t pole_pairs;  ///< 0: not known
} dqw_nameplate;

uint16_t dqw_nameplate_half_window(const dqw_nameplate *plate);

#ifdef __cplusplus
}
#endif
#endif
