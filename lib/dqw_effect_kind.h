// Of the machine, or of its shaft?
#ifndef DQW_EFFECT_KIND_H
#define DQW_EFFECT_KIND_H

#include <stdbool.h>

#include "dqw_effect_name.h"

#ifdef __cplusplus
extern "C" {
#endif

/// True for the effects of the shaft.
bool dqw_effect_is_mechanical(enum dqw_effect_name name);

#ifdef __cplusplus
}
#endif
#endif
