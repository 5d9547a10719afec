// Consecutive pairs gathered into blocks under a triangular weight, in whole numbers: nothing is rounded until the
// block is read. The interrupt gathers halves, in two places by turns; the background joins two of them that follow
// each other to a block.
#ifndef DQW_WINDOW_Q15_H
#define DQW_WINDOW_Q15_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "dqw_gate.h"
#include "dqw_handover.h"
#include "dqw_q15.h"
#include "dqw_size.h"
#include "dqw_status.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Most signals that a window gathers: a block's, dead time's and a resting leg's, and two of each weight of an effect.
#define DQW_WINDOW_Q15_SIGNALS (13 + 2 * DQW_EFFECT_WEIGHTS)

/// Most pairs in half a window: h (h + 1) 2^17 < 2^31.
#define DQW_WINDOW_Q15_HALF 100

/// One signal of a half.
typedef struct dqw_window_q15_cell {
    int32_t sum;   ///< of x. |sum| <= half 2^17
    int32_t fall;  ///< sum of those sums, in which pair j weighs half + 1 - j
} dqw_window_q15_cell;

/// A half that is being gathered, or was handed over.
typedef struct dqw_window_q15_part {
    dqw_window_q15_cell cell[DQW_WINDOW_Q15_SIGNALS];
    uint16_t fall_weight;  ///< <= 5050
    uint8_t valid;         ///< pairs in it
} dqw_window_q15_part;

/// The interrupt's side.
typedef struct dqw_window_q15 {
    dqw_window_q15_part part[2];
    uint8_t half, at;  ///< pairs in a half; of them passed
    uint8_t signals;
    dqw_handover over;
} dqw_window_q15;

/// The background's side: the half before, rising.
typedef struct dqw_window_q15_rise {
    int32_t rise[DQW_WINDOW_Q15_SIGNALS];  ///< weighted by j
    uint16_t weight;                       ///< <= 5050
    uint8_t valid;
    bool has;
} dqw_window_q15_rise;

/// Make an empty window of 2 half pairs.
///
/// Source   (E15) in docs/EQUATIONS.md
/// Range    half 1 .. DQW_WINDOW_Q15_HALF pairs, signals 1 .. DQW_WINDOW_Q15_SIGNALS
/// Returns  DQW_OK; DQW_ERR_NULL or DQW_ERR_SIZE, and then *w is untouched
#define dqw_window_init_q15 DQW_SIZED(dqw_window_init_q15)
enum dqw_status dqw_window_init_q15(dqw_window_q15 *w, int half, int signals);

/// Forget what is being gathered: after a gap in time.
/// Context  interrupt
void dqw_window_restart_q15(dqw_window_q15 *w);

/// Take one signal of a pair.
///
/// Source   (E15) in docs/EQUATIONS.md: the sum of the sums weighs pair j by half + 1 - j
/// Range    |x| <= 2^17
/// Cost     2 additions
/// Context  interrupt; dqw_window_count_q15() once for all signals of the pair
static inline void dqw_window_gather_q15(dqw_window_q15_cell *cell, int32_t x)
{
    const int32_t sum = cell->sum + x;
    cell->sum = sum;
    cell->fall += sum;
}

/// Where the signals of this pair go.
static inline dqw_window_q15_cell *dqw_window_cells_q15(dqw_window_q15 *w)
{
    return w->part[w->over.now].cell;
}

/// The pair is whole; or the gate refused it.
/// Cost     refused: an addition a signal
/// Context  interrupt; dqw_window_full_q15() after it
static inline void dqw_window_count_q15(dqw_window_q15 *w)
{
    dqw_window_q15_part *p = &w->part[w->over.now];
    w->at++;
    p->valid++;
    p->fall_weight = (uint16_t)(p->fall_weight + p->valid);
}
void dqw_window_refuse_q15(dqw_window_q15 *w);

/// True where a half is full and dqw_window_turn_q15() has something to do.
static inline bool dqw_window_full_q15(const dqw_window_q15 *w)
{
    return w->at >= w->half;
}

/// A half is full: hand it over and go on in the other place.
///
/// Returns  false where the background still has the half before: then this one is lost
/// Cost     a few instructions; one store a signal where it is lost
/// Context  interrupt
bool dqw_window_turn_q15(dqw_window_q15 *w);

/// Join the half that was handed over with the one before, and clear its place.
///
/// Source   (E15) in docs/EQUATIONS.md: any weighted sum of exact pair equations is exact
/// Shape    block[signals], weighted sums, and *weight, the sum of the weights, written when a block is ready; |block|
///          < 2^31. sum[2]: the plain sums of the half's first two signals
/// Returns  0, or DQW_EVENT_BLOCK when block[] is ready, or DQW_EVENT_INCOMPLETE when over a quarter of it was refused
/// Cost     a product and 3 additions a signal
/// Context  background, between dqw_handover_waits() and dqw_handover_release()
uint32_t dqw_window_join_q15(dqw_window_q15 *w, dqw_window_q15_rise *r, int32_t block[], uint16_t *weight,
                             int32_t sum[]);

#ifdef __cplusplus
}
#endif
#endif
