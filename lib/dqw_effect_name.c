#include "dqw_effect_kind.h"

#include <stddef.h>
#include <stdint.h>

// What both arithmetics know of an effect, a row each: its name, weights, what it asks of samples, its shape.
// clang-format off
#define ROWS(ROW) \
    ROW(DEAD_TIME, "dead_time", 1, DQW_NEEDS_ANGLE, WIDTH) \
    ROW(SATURATION, "saturation", 5, 0, WIDTH) \
    ROW(CROSS_SATURATION, "cross_saturation", 3, 0, WIDTH) \
    ROW(WINDING_TEMPERATURE, "winding_temperature", 1, DQW_NEEDS_WINDING, HEAT) \
    ROW(MAGNET_TEMPERATURE, "magnet_temperature", 1, DQW_NEEDS_MAGNET, HEAT) \
    ROW(IRON_LOSS, "iron_loss", 1, DQW_NEEDS_LAST, MACHINE) \
    ROW(FLUX_HARMONICS, "flux_harmonics", 4, DQW_NEEDS_ANGLE, ORDER) \
    ROW(CURRENT_OFFSET, "current_offset", 2, DQW_NEEDS_ANGLE, MACHINE) \
    ROW(CURRENT_GAIN_MISMATCH, "current_gain_mismatch", 2, DQW_NEEDS_ANGLE, MACHINE) \
    ROW(ANGLE_OFFSET, "angle_offset", 1, 0, MACHINE) \
    ROW(DELAY, "delay", 1, DQW_NEEDS_LAST, FREE) \
    ROW(SKIN_EFFECT, "skin_effect", 1, 0, FREE) \
    ROW(PHASE_RESISTANCE_IMBALANCE, "phase_resistance_imbalance", 2, DQW_NEEDS_ANGLE, FREE) \
    ROW(VOLTAGE_OFFSET, "voltage_offset", 2, 0, FREE) \
    ROW(FLUX_MAP, "flux_map", 2, 0, MAP) \
    ROW(COULOMB_FRICTION, "coulomb_friction", 1, DQW_NEEDS_SHAFT, WIDTH) \
    ROW(DIRECTION_ASYMMETRY, "direction_asymmetry", 1, DQW_NEEDS_SHAFT, WIDTH) \
    ROW(STRIBECK_FRICTION, "stribeck_friction", 1, DQW_NEEDS_SHAFT, WIDTHS) \
    ROW(COGGING_TORQUE, "cogging_torque", 2, DQW_NEEDS_SHAFT, WIDTH) \
    ROW(LOAD_TORQUE, "load_torque", 1, DQW_NEEDS_SHAFT, FREE)
// clang-format on

// Apart: a firmware that prints no name does not hold them.
#define TEXT(name, text, weights, needs, shape) [DQW_EFFECT_##name] = text,
#define NUMBERS(name, text, weights, needs, shape) [DQW_EFFECT_##name] = {weights, needs, DQW_SHAPE_##shape},

static const char *const texts[] = {[DQW_EFFECT_NONE] = "none", ROWS(TEXT)};

static const struct {
    uint8_t weights, needs, shape;
} rows[] = {ROWS(NUMBERS)};

// An effect whose name stands last in its list has a row, or this does not compile; lint sees the others.
typedef char rows_are_complete[sizeof rows / sizeof rows[0] == DQW_EFFECT_NAMES ? 1 : -1];

int dqw_effect_weights(enum dqw_effect_name name)
{
    return (unsigned)name < DQW_EFFECT_NAMES ? rows[name].weights : 0;
}

unsigned dqw_effect_needs(enum dqw_effect_name name)
{
    return (unsigned)name < DQW_EFFECT_NAMES ? rows[name].needs : 0u;
}

enum dqw_effect_shape dqw_effect_shape_of(enum dqw_effect_name name)
{
    return (unsigned)name < DQW_EFFECT_NAMES ? (enum dqw_effect_shape)rows[name].shape : DQW_SHAPE_FREE;
}

bool dqw_effect_is_map(const int16_t *map)
{
    if (map == NULL || map[0] < 2 || map[1] < 0 || map[1] >= map[0] || map[2] < 2) return false;
    return map[2] <= (DQW_EFFECT_MAP_NUMBERS - DQW_EFFECT_MAP_HEAD) / (2 * map[0]);
}

bool dqw_effect_is_mechanical(enum dqw_effect_name name)
{
    return (dqw_effect_needs(name) & DQW_NEEDS_SHAFT) != 0;
}

const char *dqw_effect_text(enum dqw_effect_name name)
{
    return (unsigned)name < DQW_EFFECT_NAMES && texts[name] != NULL ? texts[name] : "?";
}
