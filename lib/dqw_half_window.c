#include "dqw_half_window.h"

#include <stddef.h>

#include "dqw_number.h"

#define LONGEST_S 1e-3f
// Electrical angle of half a block: the witness sees ripples twice a turn up to 1.2.
#define HALF_ANGLE_RAD 1.1f
// Fewer, and noise takes over: its variance in a slope goes with the third inverse power of their number.
#define LEAST 5.0f
#define MOST 10000.0f
#define WITHOUT_PERIOD 20

uint16_t dqw_nameplate_half_window(const dqw_nameplate *plate)
{
    if (plate == NULL || !dqw_is_positive(plate->dt_s)) return WITHOUT_PERIOD;
    const float w_e_rad_s = (float)plate->pole_pairs * plate->w_m_rad_s;
    const float turning_s = dqw_is_positive(w_e_rad_s) ? HALF_ANGLE_RAD / w_e_rad_s : LONGEST_S;
    const float pairs = (turning_s < LONGEST_S ? turning_s : LONGEST_S) / plate->dt_s;
    return (uint16_t)(pairs > MOST ? MOST : pairs < LEAST ? LEAST : pairs);
}
