// A half of a window from the interrupt to the background: one flag says whose it is. The interrupt sets it, and from
// then on leaves the half alone; the background clears it when it has read and emptied all, by volatile accesses before
// it. One core: an interrupt sees what the background wrote, in its order.
#ifndef DQW_HANDOVER_H
#define DQW_HANDOVER_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_state.h"

#ifdef __cplusplus
extern "C" {
#endif

/// A half is full: hand it over and go on in the other place.
/// Returns  false where the background still has the half before: then this one is lost
/// Context  interrupt
static inline bool dqw_handover_turn(dqw_handover *h)
{
    if (h->pending) return false;
    h->followed = h->follows;
    h->follows = true;
    h->now ^= 1u;
    h->pending = true;
    return true;
}

/// Is a half handed over? In which part is it, and does it follow the one before?
/// Context  background
static inline bool dqw_handover_waits(const dqw_handover *h)
{
    return *(const volatile bool *)&h->pending;
}
static inline unsigned dqw_handover_part(const dqw_handover *h)
{
    return 1u - *(const volatile uint8_t *)&h->now;
}
static inline bool dqw_handover_followed(const dqw_handover *h)
{
    return *(const volatile bool *)&h->followed;
}

/// The interrupt may hand over the next one.
/// Context  background
static inline void dqw_handover_release(dqw_handover *h)
{
    *(volatile bool *)&h->pending = false;
}

#ifdef __cplusplus
}
#endif
#endif
