#include "dqw_nameplate_q15.h"

#include <stddef.h>

#define LONGEST_NS UINT64_C(1000000)
// 1.1 rad over mrad/s, in nanoseconds: the witness sees ripples twice a turn up to 1.2 rad.
#define HALF_ANGLE UINT64_C(1100000000000)
// Fewer, and noise takes over: its variance in a slope goes with the third inverse power of their number.
#define LEAST 5
#define MOST 10000
#define WITHOUT_PERIOD 20

uint16_t dqw_nameplate_half_window_q15(const dqw_scale *scale)
{
    if (scale == NULL || scale->dt_ns == 0) return WITHOUT_PERIOD;
    const uint64_t w_e_mrad_s = (uint64_t)scale->pole_pairs * scale->w_full_mrad_s;  // below 2^48
    const uint64_t turning_ns = w_e_mrad_s != 0 ? HALF_ANGLE / w_e_mrad_s : LONGEST_NS;
    const uint64_t pairs = (turning_ns < LONGEST_NS ? turning_ns : LONGEST_NS) / scale->dt_ns;
    return (uint16_t)(pairs > MOST ? MOST : pairs < LEAST ? LEAST : pairs);
}
