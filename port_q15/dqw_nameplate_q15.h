// What is on a motor's nameplate, in whole numbers, and what follows from it.
#ifndef DQW_NAMEPLATE_Q15_H
#define DQW_NAMEPLATE_Q15_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct dqw_nameplate_q15 {
    uint32_t dt_ns;       ///< PWM period
    uint32_t v_mV, i_mA;  ///< rated phase voltage and current, peak
    uint32_t w_mrad_s;    ///< rated mechanical speed
    uint16_t pole_pairs;  ///< 0: not known
} dqw_nameplate_q15;

#ifdef __cplusplus
}
#endif
#endif
