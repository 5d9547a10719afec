// Compile-time sizes that several files share. Set them for all of lib/ alike, with -D.
#ifndef DQW_SIZE_H
#define DQW_SIZE_H

#include "dqw_parameter.h"

/// Most weights that the effects of one estimator may have together (dqw_effect.h), 0 .. 24. 0: a firmware without
/// effects pays nothing.
#ifndef DQW_EFFECT_WEIGHTS
#define DQW_EFFECT_WEIGHTS 12
#endif

#if DQW_EFFECT_WEIGHTS < 0 || DQW_EFFECT_WEIGHTS > 24
#error "DQW_EFFECT_WEIGHTS is 0 .. 24: an axis' inputs are bits of one word"
#endif

/// Weights of a flux map that stand first among the effects, behind the joint neuron's own: followed and watched as
/// those are. Where there is no room for them there are none.
#if DQW_EFFECT_WEIGHTS >= 2
#define DQW_MAP_WEIGHTS 2
#else
#define DQW_MAP_WEIGHTS 0
#endif

/// Weights that are followed by segments of driving.
#define DQW_FOLLOWED (DQW_PARAMETERS + DQW_MAP_WEIGHTS)

/// Most inputs that a Learner takes, the constant input not counted: the joint neuron's own, and the effects'.
#define DQW_LEARNER_INPUTS (DQW_PARAMETERS + DQW_EFFECT_WEIGHTS)

/// The name that a linker sees of a function that makes an object: with the size in it, so that a program built with
/// two sizes does not link.
#define DQW_SIZED(name) DQW_SIZED_WITH(name, DQW_EFFECT_WEIGHTS)
/// DQW_SIZED's steps: the number's own text.
#define DQW_SIZED_WITH(name, weights) DQW_SIZED_AS(name, weights)
/// DQW_SIZED's steps: the name with it.
#define DQW_SIZED_AS(name, weights) name##_w##weights

#endif
