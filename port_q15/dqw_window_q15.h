// Triangular blocks of consecutive pairs, in whole numbers: nothing is rounded until the block is read.
#ifndef DQW_WINDOW_Q15_H
#define DQW_WINDOW_Q15_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "dqw_gate.h"
#include "dqw_q15.h"
#include "dqw_size.h"
#include "dqw_status.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Most signals: a block's, dead time's, and what effects add on each axis.
#define DQW_WINDOW_Q15_SIGNALS (11 + 2 * DQW_EFFECT_WEIGHTS)

/// Most pairs in half a window: h (h + 1) 2^17 < 2^31.
#define DQW_WINDOW_Q15_HALF 100

typedef struct dqw_window_q15 {
    int32_t sum[DQW_WINDOW_Q15_SIGNALS];   ///< this half: sum of x. |sum| <= half 2^17
    int32_t fall[DQW_WINDOW_Q15_SIGNALS];  ///< this half: sum of those sums, in which pair j weighs half + 1 - j
    int32_t rise[DQW_WINDOW_Q15_SIGNALS];  ///< the half before, weighted by j
    uint16_t fall_weight, rise_weight;     ///< <= 5050
    uint8_t half, at, valid, rise_valid;
    uint8_t signals;
    bool has_rise;
} dqw_window_q15;

/// Make an empty window of 2 half pairs.
///
/// Source   (E15) in docs/EQUATIONS.md
/// Range    half 1 .. DQW_WINDOW_Q15_HALF pairs, signals 1 .. DQW_WINDOW_Q15_SIGNALS
/// Returns  DQW_OK; DQW_ERR_NULL or DQW_ERR_SIZE, and then *w is untouched
enum dqw_status dqw_window_init_q15(dqw_window_q15 *w, int half, int signals);

/// Forget what is in the window: after a gap in time.
void dqw_window_restart_q15(dqw_window_q15 *w);

/// Add a pair: the part that runs every period. x[signals], NULL for a pair that the gate refused.
///
/// Source   (E15) in docs/EQUATIONS.md
/// Range    |x| <= 2^17; signals: the window's; a constant here lets the compiler unroll
/// Cost     2 additions a signal
/// Context  ISR safe; dqw_window_end_q15() must follow
static inline void dqw_window_add_q15(dqw_window_q15 *w, const int32_t x[], int signals)
{
    // [WIN.1] gather: the sum of the sums weighs pair j by half + 1 - j
    w->at++;
    if (x != NULL) {
        DQW_Q_UNROLL for (int i = 0; i < signals; i++)
        {
            w->sum[i] += x[i];
            w->fall[i] += w->sum[i];
        }
        w->valid++;
    } else {
        for (int i = 0; i < signals; i++) w->fall[i] += w->sum[i];
    }
    w->fall_weight = (uint16_t)(w->fall_weight + w->valid);
}

/// Is half a window full?
static inline bool dqw_window_full_q15(const dqw_window_q15 *w)
{
    return w->at >= w->half;
}

/// End half a window.
///
/// Source   (E15) in docs/EQUATIONS.md
/// Shape    block[signals]: weighted sums, written where the event is DQW_EVENT_BLOCK; |block| < 2^31
/// Returns  DQW_EVENT_BLOCK, DQW_EVENT_INCOMPLETE where too much was refused, 0 for the first half; *weight the sum of the weights
/// Context  ISR safe; after dqw_window_add_q15, where dqw_window_full_q15
uint32_t dqw_window_end_q15(dqw_window_q15 *w, int32_t block[], uint16_t *weight);

#ifdef __cplusplus
}
#endif
#endif
