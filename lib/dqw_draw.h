// Which samples a reservoir keeps, and which of them an epoch shows. Integers and booleans only, so that float and
// fixed point draw alike.
#ifndef DQW_DRAW_H
#define DQW_DRAW_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct dqw_draw {
    uint32_t capacity, draws, held, seen, state;
    uint32_t at;      ///< samples shown in this epoch
    uint32_t epochs;  ///< epochs completed
} dqw_draw;

/// An empty reservoir. seed 0 is taken as 1.
/// Returns  false for counts that it cannot have
static inline bool dqw_draw_init(dqw_draw *d, uint32_t capacity, uint32_t draws, uint32_t seed)
{
    const dqw_draw empty = {capacity, draws, 0, 0, seed != 0 ? seed : 1, 0, 0};
    *d = empty;
    return capacity >= 2 && draws >= 1 && draws <= capacity;
}

/// Uniform in 0 .. n-1: the high half of a 32 x 32 product, biased by less than n / 2^32.
static inline uint32_t dqw_draw_below(dqw_draw *d, uint32_t n)
{
    d->state ^= d->state << 13;
    d->state ^= d->state >> 17;
    d->state ^= d->state << 5;
    return (uint32_t)(((uint64_t)d->state * n) >> 32);
}

/// The place of a sample that is offered; capacity or more: it is not kept.
/// Source   (E8) in docs/EQUATIONS.md
static inline uint32_t dqw_draw_place(dqw_draw *d)
{
    // Past 2^32 - 1 samples the odds stay where they are.
    if (d->seen < UINT32_MAX) d->seen++;
    return d->held < d->capacity ? d->held++ : dqw_draw_below(d, d->seen);
}

/// Of all that are held, the place of one that this epoch has not shown: it changes places with that at d->at.
static inline uint32_t dqw_draw_next(dqw_draw *d)
{
    return d->at + dqw_draw_below(d, d->held - d->at);
}

/// It was shown.
/// Returns  true at the end of an epoch that has shown as many as it should
static inline bool dqw_draw_shown(dqw_draw *d)
{
    const bool whole = ++d->at >= d->draws;
    if (!whole && d->at < d->held) return false;
    d->at = 0;
    if (d->epochs < UINT32_MAX) d->epochs++;
    return whole;
}

#ifdef __cplusplus
}
#endif
#endif
