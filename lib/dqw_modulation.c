#include "dqw_modulation.h"

// Furthest from zero, but for one in the last place.
static int32_t size(int32_t x)
{
    return x < 0 ? ~x : x;
}

uint8_t dqw_modulation_resting(enum dqw_modulation modulation, const int32_t v[3])
{
    int32_t key[3];
    for (int k = 0; k < 3; k++) {
        switch (modulation) {
        case DQW_MODULATION_CLAMPED_LOW: key[k] = ~v[k]; break;
        case DQW_MODULATION_CLAMPED_HIGH: key[k] = v[k]; break;
        case DQW_MODULATION_CLAMPED_60: key[k] = size(v[k]); break;
        default: return 0;
        }
    }
    const int most = key[1] > key[0] ? 1 : 0;
    return (uint8_t)(1u << (key[2] > key[most] ? 2 : most));
}
