// What an effect is made of and asks for: weights, of the machine or of its shaft, and of which samples.
#ifndef DQW_EFFECT_KIND_H
#define DQW_EFFECT_KIND_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_effect_name.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Bits of dqw_effect_needs().
enum {
    DQW_NEEDS_ANGLE = 1 << 0,    ///< electrical, of every sample
    DQW_NEEDS_LAST = 1 << 1,     ///< the row before a pair
    DQW_NEEDS_WINDING = 1 << 2,  ///< the winding's temperature, or a heating state
    DQW_NEEDS_MAGNET = 1 << 3,   ///< the magnet's
    DQW_NEEDS_SHAFT = 1 << 4     ///< it is of the shaft
};

/// What the numbers of a shape may be.
enum dqw_effect_shape {
    DQW_SHAPE_FREE,     ///< there are none
    DQW_SHAPE_WIDTH,    ///< one, above 0
    DQW_SHAPE_WIDTHS,   ///< two, above 0
    DQW_SHAPE_HEAT,     ///< T_0, time constant, current
    DQW_SHAPE_ORDER,    ///< whole, 1 .. DQW_EFFECT_ORDERS
    DQW_SHAPE_MACHINE,  ///< three of R, L_d, L_q, psi: 0 or above, not all 0
    DQW_SHAPE_MAP       ///< three, above 0, and a table
};

/// Which of them an effect's are; free where there is no such name.
enum dqw_effect_shape dqw_effect_shape_of(enum dqw_effect_name name);

/// Weights of an effect; 0 where there is no such name.
int dqw_effect_weights(enum dqw_effect_name name);

/// What an effect asks for; 0 where there is no such name.
unsigned dqw_effect_needs(enum dqw_effect_name name);

/// True where a flux map's table has two nodes or more each way, zero current among them, and the room that is allowed.
bool dqw_effect_is_map(const int16_t *map);

/// Bytes of a table.
static inline unsigned dqw_effect_map_bytes(const int16_t *map)
{
    return 2u * (DQW_EFFECT_MAP_HEAD + 2u * (unsigned)map[0] * (unsigned)map[2]);
}

/// True for the effects of the shaft.
bool dqw_effect_is_mechanical(enum dqw_effect_name name);

#ifdef __cplusplus
}
#endif
#endif
