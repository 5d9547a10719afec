// What the condition monitor decides, whatever arithmetic it measures with: when to look, when a healthy value stands,
// when something has changed, what follows an event. Integers and booleans only, so that float and fixed point decide
// alike.
#ifndef DQW_WATCH_H
#define DQW_WATCH_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_change.h"
#include "dqw_fault_name.h"
#include "dqw_state.h"
#include "dqw_why.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Blocks between two looks at every channel.
#define DQW_WATCH_TICK_BLOCKS 16
/// Looks over which a healthy value is a mean at most; of coarse ones, which its first well known one replaces; that it
/// needs; and over which neighbouring looks are alike.
#define DQW_WATCH_LOOKS_MOST UINT8_MAX
#define DQW_WATCH_LOOKS_COARSE 63
#define DQW_WATCH_LOOKS_LEAST 20
#define DQW_WATCH_LOOKS_ALIKE 20
/// Healthy values follow the temperature every so many halves of a window, a power of two.
#define DQW_WATCH_FOLLOW_SHIFT 8
/// Friction: blocks in one mean torque; reversals remembered, and needed.
#define DQW_WATCH_STRETCH_BLOCKS 32
#define DQW_WATCH_REVERSALS_MOST 32
#define DQW_WATCH_REVERSALS_LEAST 8

/// What a look begins with.
enum dqw_watch_begins {
    DQW_WATCH_PAUSES = 0,  ///< nothing: it waits
    DQW_WATCH_ADOPTS,      ///< healthy values as they are now
    DQW_WATCH_SETTLES,     ///< healthy values follow the temperature and settle; then every channel is looked at
    DQW_WATCH_NAMES,       ///< every channel is looked at, an event is being named
};

/// What follows an event.
enum dqw_watch_follows {
    DQW_WATCH_LATER = 0,  ///< it is not named yet: what nothing explains may still be settling
    DQW_WATCH_APART,      ///< it is named; it moves no other channel, the others are watched on
    DQW_WATCH_RESTS,      ///< it is named; all healthy values are taken anew
};

/// The joint neuron's weight that a channel below DQW_WATCH_OFFSET watches.
static inline int dqw_watch_weight(int channel)
{
    return channel <= DQW_WATCH_ANGLE ? channel : channel - DQW_WATCH_ANGLE - 1 + DQW_PARAMETERS;
}

/// A flux map's.
static inline bool dqw_watch_is_map(int channel)
{
    return channel > DQW_WATCH_ANGLE && channel < DQW_WATCH_OFFSET;
}

/// A channel whose band is a part of the healthy value, which is no weight about zero.
static inline bool dqw_watch_is_part(int channel)
{
    return channel <= DQW_WATCH_PSI || dqw_watch_is_map(channel);
}

/// Nothing seen yet.
#define dqw_watch_init DQW_SIZED(dqw_watch_init)
void dqw_watch_init(dqw_watch *w);

/// A block was learned at half `at`. After a pause nothing is named until the weights have caught up with what has
/// changed meanwhile: for as long as it was, a second at most.
void dqw_watch_learned(dqw_watch *w, uint32_t at);

/// A stretch's block in direction `way`, 0 for none; `unbroken`: it follows the last one.
/// Returns  blocks of the stretch, 0 where it counts for nothing, DQW_WATCH_STRETCH_BLOCKS where it is complete
int dqw_watch_stretch(dqw_watch *w, int way, bool unbroken);

/// A stretch is complete: does it follow one in the other direction? Counts the reversal.
bool dqw_watch_reversal(dqw_watch *w, int way);

/// A residual above the threshold, while nothing else is being named.
void dqw_watch_alarm_residual(dqw_watch *w);

/// One block in service: true where it is time for a look.
bool dqw_watch_block(dqw_watch *w);

/// Begin a look.
/// Source   Fig. 1; (E63), (E65) in docs/EQUATIONS.md
enum dqw_watch_begins dqw_watch_begin(dqw_watch *w);

/// Healthy values were taken as they are: they settle anew.
void dqw_watch_adopt(dqw_watch *w, uint32_t halves);

/// Healthy values come from a store: as many looks as they are the mean of.
void dqw_watch_restore(dqw_watch *w, const uint8_t looks[]);

/// Service begins: whatever a pause or a rest before it left to wait for is over.
void dqw_watch_enter(dqw_watch *w);

/// Watch nothing for a while, healthy values are taken meanwhile: after an event.
void dqw_watch_rest(dqw_watch *w);

/// How well a channel is known for its healthy value to be learned.
enum dqw_watch_known { DQW_WATCH_NOT_KNOWN = 0, DQW_WATCH_KNOWN, DQW_WATCH_KNOWN_WELL };

/// A look at a channel below DQW_WATCH_FRICTION: its healthy value settles, unless it stands or seems to change. What
/// coarse looks made is off by what they were: the first at which it is known well takes their place.
/// Returns  looks that the healthy value is the mean of, with this one; 0 where it stays as it is
uint8_t dqw_watch_settle(dqw_watch *w, int channel, enum dqw_watch_known known, int32_t deviation_q5);

/// The same of friction, which is a mean already: it stands as it is when its memory is full.
bool dqw_watch_friction_settles(dqw_watch *w);

/// Halves of a window, in 256, since healthy R (channel DQW_WATCH_R) or flux last followed; and: it does now.
uint16_t dqw_watch_unfollowed(const dqw_watch *w, int channel, uint32_t halves);
void dqw_watch_follow(dqw_watch *w, int channel, uint32_t halves);

/// Look at every channel.
///
/// Source   (E63) in docs/EQUATIONS.md
/// Shape    deviation_q5[DQW_WATCH_CHANNELS]: size of each change over its band, Q5; 0 where it is not known
/// Returns  true where there is an event to be named
bool dqw_watch_look(dqw_watch *w, const int32_t deviation_q5[]);

/// Does anything show that a segment of its own tells? A ripple is in none of its inputs: there it would be a weight's.
/// Source   (E105) in docs/EQUATIONS.md
bool dqw_watch_wants_a_segment(const dqw_watch *w);

/// It is not time yet to name that event: look again in a while.
void dqw_watch_later(dqw_watch *w);

/// The channel of that event: the one furthest out of its band; -1 where all are back within and the residual is not
/// `above` its threshold: then nothing has changed.
int dqw_watch_worst(dqw_watch *w, const int32_t deviation_q5[], bool above);

/// Looks since the sum of a channel began to grow.
uint8_t dqw_watch_since(const dqw_watch *w, int channel);

/// Why it watches nothing at half `now`, or is not in service; DQW_WHYS while it learns: then what was learned says it.
enum dqw_why dqw_watch_why(const dqw_watch *w, const dqw_stage *s, uint32_t now);

/// Does the motion teach any weight now?
bool dqw_watch_excited(const int16_t excess_q10[], int inputs);

/// Healthy R, L_q and flux stand: they may be stored.
bool dqw_watch_stands(const dqw_watch *w);

/// A channel that a fault's pattern does not name: the fault it is, or DQW_FAULT_NONE.
enum dqw_fault_name dqw_watch_fault_of(int channel, bool more);

/// The event of this channel has a name; not `sure` where another one explains it nearly as well.
/// Source   Fig. 1; (E65) in docs/EQUATIONS.md
enum dqw_watch_follows dqw_watch_named(dqw_watch *w, int channel, enum dqw_fault_name name, bool sure);

#ifdef __cplusplus
}
#endif
#endif
