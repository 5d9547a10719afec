#include "dqw_effect_kind.h"

#include <stdint.h>

int dqw_effect_weights(enum dqw_effect_name name)
{
    static const uint8_t weights[DQW_EFFECT_NAMES] = {0, 1, 5, 3, 1, 1, 1, 4, 2, 2, 1, 1, 1, 2, 2, 1, 1, 1, 2, 1};
    return (unsigned)name < DQW_EFFECT_NAMES ? weights[name] : 0;
}

bool dqw_effect_is_mechanical(enum dqw_effect_name name)
{
    return (unsigned)name >= DQW_EFFECT_COULOMB_FRICTION && (unsigned)name < DQW_EFFECT_NAMES;
}
