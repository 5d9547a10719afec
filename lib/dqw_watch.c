#include "dqw_watch.h"

#include <stddef.h>

// Looks that a fault settles before it is named, and that follow before the next: the witness, whose memory is 19
// looks, then shows 72 and 96 % of a step. A pattern wants the direction, a healthy value the rest as well.
#define NAMING_TICKS 24
#define REST_TICKS 60
// An unknown one, or R alone, is given so many looks more, twice, 84 and 90 %; one of two names six times, for weights
// that were opened are known better and better, and so is an unknown one while a ripple shows: inputs that are nearly
// alike take what is another's at first and give it back slowly.
#define EXTENSION_TICKS 10
#define UNKNOWN_EXTENDED 2u
#define UNSURE_EXTENDED 6u
#define RIPPLES (((1u << DQW_WITNESS_INPUTS) - 1u) << DQW_WATCH_OFFSET)
// And where its segment has not ended: so many until the next try.
#define SOON_TICKS 4
// Bands times looks that the sum must gather.
#define LIMIT_Q5 (5 * DQW_CHANGE_BAND_Q5)
// Halves of a window between two learned blocks that make a pause.
#define PAUSE 64u

void dqw_watch_init(dqw_watch *w)
{
    const dqw_watch zero = {0};
    *w = zero;
}

// No block was learned for so long that it makes a pause.
static bool paused(const dqw_watch *w, uint32_t now)
{
    return now - w->learned_at > PAUSE;
}

void dqw_watch_learned(dqw_watch *w, uint32_t at)
{
    const uint32_t pause = at - w->learned_at;
    const bool was_paused = paused(w, at);
    // The 16 bits of the healthy values' time must not come round.
    for (int channel = DQW_WATCH_R; channel <= DQW_WATCH_PSI; channel += DQW_WATCH_PSI)
        if ((dqw_watch_unfollowed(w, channel, w->learned_at) + (pause >> DQW_WATCH_FOLLOW_SHIFT) + 1u) >> 16 != 0)
            dqw_watch_follow(w, channel, at + (1u << DQW_WATCH_FOLLOW_SHIFT));
    w->learned_at = at;
    if (!was_paused) return;
    if (w->alarms == 0 && w->wait == 0)
        w->wait = (uint8_t)(pause < REST_TICKS * DQW_WATCH_TICK_BLOCKS ? pause / DQW_WATCH_TICK_BLOCKS : REST_TICKS);
}

int dqw_watch_stretch(dqw_watch *w, int way, bool unbroken)
{
    // Where blocks are missing, nobody knows how it accelerated.
    if (!unbroken || w->gathered * way <= 0) w->gathered = 0;
    if (!unbroken) return 0;
    w->gathered = (int8_t)(w->gathered + way);
    return w->gathered * way;
}

bool dqw_watch_reversal(dqw_watch *w, int way)
{
    const bool reversed = w->before * way < 0;
    if (reversed && w->reversals < DQW_WATCH_REVERSALS_MOST) w->reversals++;
    w->before = way > 0 ? 1 : -1;
    w->gathered = 0;
    return reversed;
}

static void alarm(dqw_watch *w, int channel)
{
    if (w->alarms == 0) w->wait = NAMING_TICKS;
    w->alarms |= (uint16_t)(1u << channel);
}

void dqw_watch_alarm_residual(dqw_watch *w)
{
    if (w->alarms == 0 && w->wait == 0) alarm(w, DQW_WATCH_RESIDUAL);
}

bool dqw_watch_block(dqw_watch *w)
{
    if (++w->blocks < DQW_WATCH_TICK_BLOCKS) return false;
    w->blocks = 0;
    return true;
}

enum dqw_watch_begins dqw_watch_begin(dqw_watch *w)
{
    if (w->resting) {
        w->resting = --w->wait > 0;
        return DQW_WATCH_ADOPTS;
    }
    if (w->alarms != 0) return DQW_WATCH_NAMES;
    if (w->wait == 0) return DQW_WATCH_SETTLES;
    w->wait--;
    return DQW_WATCH_PAUSES;
}

static void quiet(dqw_watch *w)
{
    for (int i = 0; i < DQW_WATCH_CHANNELS; i++) dqw_change_init(&w->change[i]);
    w->alarms = 0;
    w->extended = 0;
}

void dqw_watch_adopt(dqw_watch *w, uint32_t halves)
{
    for (int i = 0; i < DQW_WATCH_TEMPERATURE; i++) w->looks[i] = 0;
    w->reversals = 0;
    w->followed[0] = w->followed[1] = (uint16_t)(halves >> DQW_WATCH_FOLLOW_SHIFT);
    quiet(w);
}

void dqw_watch_restore(dqw_watch *w, const uint8_t looks[])
{
    for (int i = 0; i < DQW_WATCH_TEMPERATURE; i++) w->looks[i] = looks[i];
}

void dqw_watch_enter(dqw_watch *w)
{
    w->wait = 0;
    w->resting = false;
}

void dqw_watch_rest(dqw_watch *w)
{
    w->wait = REST_TICKS;
    w->resting = true;
}

static bool settles(const dqw_watch *w, int channel)
{
    return w->looks[channel] != DQW_WATCH_LOOKS_MOST && w->change[channel].sum_q5 == 0;
}

uint8_t dqw_watch_settle(dqw_watch *w, int channel, enum dqw_watch_known known, int32_t deviation_q5)
{
    const uint8_t coarse = DQW_WATCH_LOOKS_COARSE;
    const bool well = known == DQW_WATCH_KNOWN_WELL;
    uint8_t looks = w->looks[channel];
    if (well && looks <= coarse) {
        looks = coarse;
    } else {
        // What is half out of its band already may be a fault that begins.
        if (!settles(w, channel) || 2 * deviation_q5 > DQW_CHANGE_BAND_Q5 || (!well && looks > coarse)) return 0;
        if (known == DQW_WATCH_NOT_KNOWN) return looks == 0;
    }
    if (well || looks < coarse) looks++;
    w->looks[channel] = looks;
    return well ? (uint8_t)(looks - coarse) : looks;
}

bool dqw_watch_friction_settles(dqw_watch *w)
{
    if (!settles(w, DQW_WATCH_FRICTION)) return false;
    w->looks[DQW_WATCH_FRICTION] = w->reversals < DQW_WATCH_REVERSALS_MOST ? 0 : DQW_WATCH_LOOKS_MOST;
    return true;
}

uint16_t dqw_watch_unfollowed(const dqw_watch *w, int channel, uint32_t halves)
{
    return (uint16_t)((halves >> DQW_WATCH_FOLLOW_SHIFT) - w->followed[channel == DQW_WATCH_PSI]);
}

void dqw_watch_follow(dqw_watch *w, int channel, uint32_t halves)
{
    w->followed[channel == DQW_WATCH_PSI] = (uint16_t)(halves >> DQW_WATCH_FOLLOW_SHIFT);
}

bool dqw_watch_look(dqw_watch *w, const int32_t deviation_q5[])
{
    if (deviation_q5[DQW_WATCH_TEMPERATURE] == 0) w->too_hot = false;
    for (int i = 0; i < DQW_WATCH_CHANNELS; i++) {
        // Heat does not multiply the residual: what does may seem to be heat.
        if (i == DQW_WATCH_TEMPERATURE && (w->too_hot || deviation_q5[DQW_WATCH_RESIDUAL] >= DQW_CHANGE_BAND_Q5))
            continue;
        if (dqw_change_step(&w->change[i], deviation_q5[i], LIMIT_Q5)) alarm(w, i);
    }
    return w->alarms != 0 && --w->wait == 0;
}

bool dqw_watch_wants_a_segment(const dqw_watch *w)
{
    const uint32_t apart = RIPPLES | 1u << DQW_WATCH_FRICTION | 1u << DQW_WATCH_TEMPERATURE;
    return (w->alarms & ~apart) != 0;
}

void dqw_watch_later(dqw_watch *w)
{
    w->wait = SOON_TICKS;
}

int dqw_watch_worst(dqw_watch *w, const int32_t deviation_q5[], bool above)
{
    int worst = 0;
    int32_t most = -1;
    for (int i = 0; i < DQW_WATCH_CHANNELS; i++) {
        if (((uint32_t)w->alarms >> i & 1u) == 0 || deviation_q5[i] <= most) continue;
        most = deviation_q5[i];
        worst = i;
    }
    if (most >= DQW_CHANGE_BAND_Q5 || above) return worst;
    quiet(w);
    return -1;
}

uint8_t dqw_watch_since(const dqw_watch *w, int channel)
{
    return w->change[channel].above;
}

enum dqw_why dqw_watch_why(const dqw_watch *w, const dqw_stage *s, uint32_t now)
{
    if (s->name == DQW_STAGE_IN_SERVICE)
        return paused(w, now)   ? DQW_WHY_PAUSE
               : w->resting     ? DQW_WHY_RESTS
               : w->alarms != 0 ? DQW_WHY_NAMING
               : w->wait != 0   ? DQW_WHY_PAUSE
                                : DQW_WHY_IN_SERVICE;
    if (s->name != DQW_STAGE_DOMAIN) return DQW_WHYS;
    return s->back == DQW_BACK_NOT_CONVERGED ? DQW_WHY_NOT_CONVERGED
           : s->back == DQW_BACK_LEFT_BAND   ? DQW_WHY_LEFT_BAND
                                             : DQW_WHY_THRESHOLD;
}

bool dqw_watch_excited(const int16_t excess_q10[], int inputs)
{
    for (int i = 0; i < inputs; i++)
        if (excess_q10[i] > 0) return true;
    return false;
}

bool dqw_watch_stands(const dqw_watch *w)
{
    const uint8_t *looks = w->looks;
    return looks[DQW_WATCH_R] >= DQW_WATCH_LOOKS_LEAST && looks[DQW_WATCH_LQ] >= DQW_WATCH_LOOKS_LEAST &&
           looks[DQW_WATCH_PSI] >= DQW_WATCH_LOOKS_LEAST;
}

enum dqw_fault_name dqw_watch_fault_of(int channel, bool more)
{
    if (channel == DQW_WATCH_TEMPERATURE) return DQW_FAULT_OVER_TEMPERATURE;
    if (channel != DQW_WATCH_FRICTION) return DQW_FAULT_NONE;
    return more ? DQW_FAULT_BEARING_WEAR : DQW_FAULT_UNKNOWN;
}

enum dqw_watch_follows dqw_watch_named(dqw_watch *w, int channel, enum dqw_fault_name name, bool sure)
{
    if (channel == DQW_WATCH_TEMPERATURE) w->too_hot = true;
    // R takes up at first what others will explain.
    const bool ripples = channel != DQW_WATCH_RESIDUAL && (w->alarms & RIPPLES) != 0;
    const bool waits = name == DQW_FAULT_UNKNOWN ? ripples : !sure;
    const bool settles = name == DQW_FAULT_UNKNOWN || name == DQW_FAULT_RESISTANCE_RISE;
    if (w->extended < (waits ? UNSURE_EXTENDED : settles ? UNKNOWN_EXTENDED : 0u)) {
        w->extended++;
        w->wait = EXTENSION_TICKS;
        return DQW_WATCH_LATER;
    }
    if (name == DQW_FAULT_OVER_TEMPERATURE || name == DQW_FAULT_BEARING_WEAR) {
        dqw_change_init(&w->change[channel]);
        w->alarms = 0;
        w->extended = 0;
        if (channel == DQW_WATCH_FRICTION) w->looks[channel] = w->reversals = 0;
        return DQW_WATCH_APART;
    }
    // What nothing explains, and is above the threshold still, is another machine: back to stage 1.
    w->back = name == DQW_FAULT_UNKNOWN;
    return DQW_WATCH_RESTS;
}
