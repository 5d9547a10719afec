#include "dqw_window.h"

#include <stddef.h>

#define HALF_MAX 10000

enum dqw_status dqw_window_init(dqw_window *w, int half, int signals)
{
    if (w == NULL) return DQW_ERR_NULL;
    if (half < 1 || half > HALF_MAX || signals < 1 || signals > DQW_WINDOW_SIGNALS) return DQW_ERR_SIZE;
    const dqw_window zero = {.half = 0};
    *w = zero;
    w->half = (uint16_t)half;
    w->signals = (uint8_t)signals;
    return DQW_OK;
}

static void clear(volatile dqw_window_part *p, int signals)
{
    for (int i = 0; i < signals; i++) p->cell[i].sum = p->cell[i].fall = 0.0f;
    p->fall_weight = 0;
    p->valid = 0;
}

void dqw_window_restart(dqw_window *w)
{
    clear(&w->part[w->over.now], w->signals);
    w->at = 0;
    w->over.follows = false;
}

void dqw_window_refuse(dqw_window *w)
{
    dqw_window_part *p = &w->part[w->over.now];
    w->at++;
    for (int i = 0; i < w->signals; i++) p->cell[i].fall += p->cell[i].sum;
    p->fall_weight += p->valid;
}

bool dqw_window_turn(dqw_window *w)
{
    if (!dqw_handover_turn(&w->over)) {
        dqw_window_restart(w);
        return false;
    }
    w->at = 0;
    return true;
}

uint32_t dqw_window_join(dqw_window *w, dqw_window_rise *r, float block[], float sum[])
{
    // All that the interrupt wrote is read by volatile reads, as the flag that guards it.
    volatile dqw_window_part *p = &w->part[dqw_handover_part(&w->over)];
    const bool joins = r->has && dqw_handover_followed(&w->over);
    const uint16_t valid = p->valid;
    const uint32_t fall_weight = p->fall_weight;
    const uint32_t top = (uint32_t)w->half + 1u;
    // [WIN.1] is there enough of the half before and of this one for a block
    const bool enough = joins && 4 * (valid + r->valid) >= 3 * 2 * w->half;
    const float scale = enough ? 1.0f / (float)(r->weight + fall_weight) : 0.0f;
    // [WIN.2] the half before, rising, and this one, falling, are the block; this one rises in the next
    // fall_weight < 5.1e7, top * valid < 1.1e8
    const float top_f = (float)top;
    sum[0] = p->cell[0].sum;
    sum[1] = p->cell[1].sum;
    for (int i = 0; i < w->signals; i++) {
        const float fall = p->cell[i].fall;
        if (enough) block[i] = (r->rise[i] + fall) * scale;
        r->rise[i] = top_f * p->cell[i].sum - fall;
    }
    r->weight = top * valid - fall_weight;
    r->valid = valid;
    r->has = true;
    clear(p, w->signals);
    return enough ? (uint32_t)DQW_EVENT_BLOCK : joins ? (uint32_t)DQW_EVENT_INCOMPLETE : 0u;
}
