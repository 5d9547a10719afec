#include "dqw_window_q15.h"

#include "dqw_q15.h"

enum dqw_status dqw_window_init_q15(dqw_window_q15 *w, int half, int signals)
{
    if (w == NULL) return DQW_ERR_NULL;
    if (half < 1 || half > DQW_WINDOW_Q15_HALF || signals < 1 || signals > DQW_WINDOW_Q15_SIGNALS) return DQW_ERR_SIZE;
    const dqw_window_q15 zero = {0};
    *w = zero;
    w->half = (uint8_t)half;
    w->signals = (uint8_t)signals;
    return DQW_OK;
}

static void begin_half(dqw_window_q15 *w)
{
    w->fall_weight = 0;
    w->at = w->valid = 0;
}

void dqw_window_restart_q15(dqw_window_q15 *w)
{
    for (int i = 0; i < w->signals; i++) w->sum[i] = w->fall[i] = 0;
    begin_half(w);
    w->has_rise = false;
}

uint32_t dqw_window_end_q15(dqw_window_q15 *w, int32_t block[], uint16_t *weight)
{
    // [WIN.2] join the half before, rising, with this one, falling
    const bool enough = w->has_rise && 4 * (w->valid + w->rise_valid) >= 3 * 2 * w->half;
    const uint32_t event = enough ? (uint32_t)DQW_EVENT_LEARNED : w->has_rise ? (uint32_t)DQW_EVENT_INCOMPLETE : 0u;
    const int signals = w->signals;
    if (enough) {
        *weight = (uint16_t)(w->rise_weight + w->fall_weight);
        // Both together are below h (h + 1) 2^17 < 2^31. A full house needs no look for the end.
        if (signals == DQW_WINDOW_Q15_SIGNALS)
            DQW_Q_UNROLL for (int i = 0; i < DQW_WINDOW_Q15_SIGNALS; i++) block[i] = w->rise[i] + w->fall[i];
        else
            for (int i = 0; i < signals; i++) block[i] = w->rise[i] + w->fall[i];
    }
    // [WIN.3] this half rises in the next block
    // |top sum| <= 101 100 2^17 < 2^31. All there may be, so that the loop has no end to look for: what is unused is 0.
    const int32_t top = w->half + 1;
    DQW_Q_UNROLL for (int i = 0; i < DQW_WINDOW_Q15_SIGNALS; i++)
    {
        w->rise[i] = top * w->sum[i] - w->fall[i];
        w->sum[i] = w->fall[i] = 0;
    }
    w->rise_weight = (uint16_t)(top * w->valid - w->fall_weight);
    w->rise_valid = w->valid;
    w->has_rise = true;
    begin_half(w);
    return event;
}
