#include "dqw_window_q15.h"

enum dqw_status dqw_window_init_q15(dqw_window_q15 *w, int half, int signals)
{
    if (w == NULL) return DQW_ERR_NULL;
    if (half < 1 || half > DQW_WINDOW_Q15_HALF || signals < 1 || signals > DQW_WINDOW_Q15_SIGNALS) return DQW_ERR_SIZE;
    const dqw_window_q15 zero = {.half = 0};
    *w = zero;
    w->half = (uint8_t)half;
    w->signals = (uint8_t)signals;
    return DQW_OK;
}

static void clear(dqw_window_q15_part *p, int signals)
{
    for (int i = 0; i < signals; i++) p->cell[i].sum = p->cell[i].fall = 0;
    p->fall_weight = 0;
    p->valid = 0;
}

void dqw_window_restart_q15(dqw_window_q15 *w)
{
    clear(&w->part[w->over.now], w->signals);
    w->at = 0;
    w->over.follows = false;
}

void dqw_window_refuse_q15(dqw_window_q15 *w)
{
    dqw_window_q15_part *p = &w->part[w->over.now];
    w->at++;
    for (int i = 0; i < w->signals; i++) p->cell[i].fall += p->cell[i].sum;
    p->fall_weight = (uint16_t)(p->fall_weight + p->valid);
}

bool dqw_window_turn_q15(dqw_window_q15 *w)
{
    if (!dqw_handover_turn(&w->over)) {
        dqw_window_restart_q15(w);
        return false;
    }
    w->at = 0;
    return true;
}

uint32_t dqw_window_join_q15(dqw_window_q15 *w, dqw_window_q15_rise *r, int32_t block[], uint16_t *weight,
                             int32_t sum[])
{
    // All that the interrupt wrote is read by volatile reads, as the flag that guards it.
    volatile dqw_window_q15_part *p = &w->part[dqw_handover_part(&w->over)];
    const bool joins = r->has && dqw_handover_followed(&w->over);
    const uint8_t valid = p->valid;
    const uint16_t fall_weight = p->fall_weight;
    const int32_t top = w->half + 1;
    // [WIN.1] is there enough of the half before and of this one for a block
    const bool enough = joins && 4 * (valid + r->valid) >= 3 * 2 * w->half;
    if (enough) *weight = (uint16_t)(r->weight + fall_weight);
    // [WIN.2] the half before, rising, and this one, falling, are the block; this one rises in the next
    // |top sum| <= 101 100 2^17 < 2^31; the two together are below h (h + 1) 2^17.
    for (int i = 0; i < w->signals; i++) {
        const int32_t plain = p->cell[i].sum;
        const int32_t fall = p->cell[i].fall;
        p->cell[i].sum = p->cell[i].fall = 0;
        if (i < 2) sum[i] = plain;
        if (enough) block[i] = r->rise[i] + fall;
        r->rise[i] = top * plain - fall;
    }
    p->fall_weight = 0;
    p->valid = 0;
    r->weight = (uint16_t)(top * valid - fall_weight);
    r->valid = valid;
    r->has = true;
    return enough ? (uint32_t)DQW_EVENT_BLOCK : joins ? (uint32_t)DQW_EVENT_INCOMPLETE : 0u;
}
