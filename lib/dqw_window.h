// Consecutive pairs gathered into blocks under a triangular weight. The weight is zero at both ends, so a current
// difference becomes the difference of two means and its noise all but vanishes; blocks overlap by half.
#ifndef DQW_WINDOW_H
#define DQW_WINDOW_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "dqw_size.h"
#include "dqw_status.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Most signals that a window gathers: a block's, and what effects add on each axis, at least one.
#if DQW_EFFECT_WEIGHTS > 0
#define DQW_WINDOW_SIGNALS (11 + 2 * DQW_EFFECT_WEIGHTS)
#else
#define DQW_WINDOW_SIGNALS 11
#endif

typedef struct dqw_window {
    float sum[DQW_WINDOW_SIGNALS];   ///< this half: sum of x
    float fall[DQW_WINDOW_SIGNALS];  ///< this half: sum of those sums, in which pair j weighs half + 1 - j
    float rise[DQW_WINDOW_SIGNALS];  ///< the half before, weighted by j
    uint32_t fall_weight, rise_weight;
    uint16_t half, at, valid, rise_valid;
    uint8_t signals;
    bool has_rise;
} dqw_window;

/// Make an empty window of 2 half pairs.
///
/// Source   (E15) in docs/EQUATIONS.md
/// Range    half 1 .. 10000 pairs, signals 1 .. DQW_WINDOW_SIGNALS
/// Returns  DQW_OK; DQW_ERR_NULL or DQW_ERR_SIZE, and then *w is untouched
enum dqw_status dqw_window_init(dqw_window *w, int half, int signals);

/// Forget what is in the window: after a gap in time.
void dqw_window_restart(dqw_window *w);

/// Add a pair: the part of dqw_window_step that runs every period. x[signals], NULL for a pair that the gate refused.
///
/// Source   (E15) in docs/EQUATIONS.md
/// Range    signals: the window's; a constant here lets the compiler unroll
/// Cost     2 flops a signal
/// Context  ISR safe; dqw_window_end() must follow
static inline void dqw_window_add(dqw_window *w, const float x[], int signals)
{
    // [WIN.1] gather: the sum of the sums weighs pair j by half + 1 - j
    w->at++;
    if (x != NULL) {
        for (int i = 0; i < signals; i++) {
            w->sum[i] += x[i];
            w->fall[i] += w->sum[i];
        }
        w->valid++;
    } else {
        for (int i = 0; i < signals; i++) w->fall[i] += w->sum[i];
    }
    w->fall_weight += w->valid;
}

/// True where a half is full and dqw_window_end() has something to do.
static inline bool dqw_window_full(const dqw_window *w)
{
    return w->at >= w->half;
}

/// Close a half.
///
/// Source   (E15) in docs/EQUATIONS.md
/// Shape    block[signals] written when a block is ready
/// Returns  0, or DQW_EVENT_LEARNED when block[] is ready, or DQW_EVENT_INCOMPLETE when over a quarter of it was refused
/// Cost     6 flops a signal, one division
/// Context  as dqw_window_step
uint32_t dqw_window_end(dqw_window *w, float block[]);

/// Take the next pair; every `half` pairs a block is ready.
///
/// Source   (E15) in docs/EQUATIONS.md: any weighted sum of exact pair equations is exact
/// Shape    x[signals] read only, NULL for a pair that the gate refused; block[signals] written when a block is ready
/// Returns  0, or DQW_EVENT_LEARNED when block[] is ready, or DQW_EVENT_INCOMPLETE when over a quarter of it was refused
/// Cost     2 flops a signal; at a block's end 6 more, and one division
/// Context  ISR safe; one writer per object
uint32_t dqw_window_step(dqw_window *w, const float x[], float block[]);

#ifdef __cplusplus
}
#endif
#endif
