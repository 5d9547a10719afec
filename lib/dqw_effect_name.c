#include "dqw_effect_kind.h"

#include <stdint.h>

// What whole numbers say of an effect, a row each; both arithmetics read it.
static const struct {
    uint8_t weights, needs;
} rows[DQW_EFFECT_NAMES] = {
    [DQW_EFFECT_DEAD_TIME] = {1, DQW_NEEDS_ANGLE},
    [DQW_EFFECT_SATURATION] = {5, 0},
    [DQW_EFFECT_CROSS_SATURATION] = {3, 0},
    [DQW_EFFECT_WINDING_TEMPERATURE] = {1, DQW_NEEDS_WINDING},
    [DQW_EFFECT_MAGNET_TEMPERATURE] = {1, DQW_NEEDS_MAGNET},
    [DQW_EFFECT_IRON_LOSS] = {1, DQW_NEEDS_LAST},
    [DQW_EFFECT_FLUX_HARMONICS] = {4, DQW_NEEDS_ANGLE},
    [DQW_EFFECT_CURRENT_OFFSET] = {2, DQW_NEEDS_ANGLE},
    [DQW_EFFECT_CURRENT_GAIN_MISMATCH] = {2, DQW_NEEDS_ANGLE},
    [DQW_EFFECT_ANGLE_OFFSET] = {1, 0},
    [DQW_EFFECT_DELAY] = {1, DQW_NEEDS_LAST},
    [DQW_EFFECT_SKIN_EFFECT] = {1, 0},
    [DQW_EFFECT_PHASE_RESISTANCE_IMBALANCE] = {2, DQW_NEEDS_ANGLE},
    [DQW_EFFECT_VOLTAGE_OFFSET] = {2, 0},
    [DQW_EFFECT_COULOMB_FRICTION] = {1, DQW_NEEDS_SHAFT},
    [DQW_EFFECT_DIRECTION_ASYMMETRY] = {1, DQW_NEEDS_SHAFT},
    [DQW_EFFECT_STRIBECK_FRICTION] = {1, DQW_NEEDS_SHAFT},
    [DQW_EFFECT_COGGING_TORQUE] = {2, DQW_NEEDS_SHAFT},
    [DQW_EFFECT_LOAD_TORQUE] = {1, DQW_NEEDS_SHAFT},
};

int dqw_effect_weights(enum dqw_effect_name name)
{
    return (unsigned)name < DQW_EFFECT_NAMES ? rows[name].weights : 0;
}

unsigned dqw_effect_needs(enum dqw_effect_name name)
{
    return (unsigned)name < DQW_EFFECT_NAMES ? rows[name].needs : 0u;
}

bool dqw_effect_is_mechanical(enum dqw_effect_name name)
{
    return (dqw_effect_needs(name) & DQW_NEEDS_SHAFT) != 0;
}
