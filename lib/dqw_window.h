// Consecutive pairs gathered into blocks under a triangular weight. The weight is zero at both ends, so a current
// difference becomes the difference of two means and its noise all but vanishes; blocks overlap by half. The interrupt
// gathers halves, in two places by turns; the background joins two of them that follow each other to a block.
#ifndef DQW_WINDOW_H
#define DQW_WINDOW_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "dqw_handover.h"
#include "dqw_number.h"
#include "dqw_parts.h"
#include "dqw_size.h"
#include "dqw_status.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Make an empty window of 2 half pairs.
///
/// Source   (E15) in docs/EQUATIONS.md
/// Range    half 1 .. 10000 pairs, signals 1 .. DQW_WINDOW_SIGNALS
/// Returns  DQW_OK; DQW_ERR_NULL or DQW_ERR_SIZE, and then *w is untouched
#define dqw_window_init DQW_SIZED(dqw_window_init)
enum dqw_status dqw_window_init(dqw_window *w, int half, int signals);

/// Forget what is being gathered: after a gap in time.
/// Context  interrupt
void dqw_window_restart(dqw_window *w);

/// Take one signal of a pair.
///
/// Source   (E15) in docs/EQUATIONS.md: the sum of the sums weighs pair j by half + 1 - j
/// Cost     2 flops
/// Context  interrupt; dqw_window_count() once for all signals of the pair
DQW_INLINE void dqw_window_gather(dqw_window_cell *cell, float x)
{
    const float sum =
        cell->sum + x;  // NOLINT(clang-analyzer-core.UndefinedBinaryOperatorResult): cleared by init, restart and join
    cell->sum = sum;
    cell->fall += sum;
}

/// Where the signals of this pair go.
static inline dqw_window_cell *dqw_window_cells(dqw_window *w)
{
    return w->part[w->over.now].cell;
}

/// The pair is whole; or the gate refused it.
/// Cost     refused: one flop a signal
/// Context  interrupt; dqw_window_full() after it
DQW_INLINE void dqw_window_count(dqw_window *w)
{
    dqw_window_part *p = &w->part[w->over.now];
    w->at++;
    p->valid++;
    p->fall_weight += p->valid;
}
void dqw_window_refuse(dqw_window *w);

/// True where a half is full and dqw_window_turn() has something to do.
static inline bool dqw_window_full(const dqw_window *w)
{
    return w->at >= w->half;
}

/// A half is full: hand it over and go on in the other place.
///
/// Returns  false where the background still has the half before: then this one is lost
/// Cost     a few instructions; one store a signal where it is lost
/// Context  interrupt
bool dqw_window_turn(dqw_window *w);

/// Join the half that was handed over with the one before, and clear its place.
///
/// Source   (E15) in docs/EQUATIONS.md: any weighted sum of exact pair equations is exact
/// Shape    block[signals] written when a block is ready; sum[2]: the plain sums of the half's first two signals, and
///          what it counts
/// Returns  0, or DQW_EVENT_BLOCK when block[] is ready, or DQW_EVENT_INCOMPLETE when over a quarter of it was refused
/// Cost     6 flops a signal, one division
/// Context  background, between dqw_handover_waits() and dqw_handover_release()
uint32_t dqw_window_join(dqw_window *w, dqw_window_rise *r, float block[], float sum[]);

#ifdef __cplusplus
}
#endif
#endif
