#include "dqw_window.h"

#include <stddef.h>

#define HALF_MAX 10000

enum dqw_status dqw_window_init(dqw_window *w, int half, int signals)
{
    if (w == NULL) return DQW_ERR_NULL;
    if (half < 1 || half > HALF_MAX || signals < 1 || signals > DQW_WINDOW_SIGNALS) return DQW_ERR_SIZE;
    const dqw_window zero = {0};
    *w = zero;
    w->half = (uint16_t)half;
    w->signals = (uint8_t)signals;
    return DQW_OK;
}

static void clear_half(dqw_window *w)
{
    for (int i = 0; i < w->signals; i++) w->cell[i].sum = w->cell[i].fall = 0.0f;
    w->fall_weight = 0;
    w->at = w->valid = 0;
}

void dqw_window_restart(dqw_window *w)
{
    clear_half(w);
    w->has_rise = false;
}

uint32_t dqw_window_end(dqw_window *w, float block[])
{
    // [WIN.2] join the half before, rising, with this one, falling
    const bool enough = w->has_rise && 4 * (w->valid + w->rise_valid) >= 3 * 2 * w->half;
    const uint32_t event = enough ? (uint32_t)DQW_EVENT_LEARNED : w->has_rise ? (uint32_t)DQW_EVENT_INCOMPLETE : 0u;
    const float scale = enough ? 1.0f / (float)(w->rise_weight + w->fall_weight) : 0.0f;
    // [WIN.3] this half rises in the next block
    // fall_weight < 5.1e7, top * valid < 1.1e8
    const uint32_t top = (uint32_t)w->half + 1u;
    const float top_f = (float)top;
    const int n = w->signals;
    for (int i = 0; i < n; i++) {
        const float sum = w->cell[i].sum;
        const float fall = w->cell[i].fall;
        if (enough) block[i] = (w->rise[i] + fall) * scale;
        w->rise[i] = top_f * sum - fall;
        w->cell[i].sum = 0.0f;
        w->cell[i].fall = 0.0f;
    }
    w->rise_weight = top * w->valid - w->fall_weight;
    w->rise_valid = w->valid;
    w->has_rise = true;
    w->fall_weight = 0;
    w->at = w->valid = 0;
    return event;
}

uint32_t dqw_window_step(dqw_window *w, const float x[], float block[])
{
    dqw_window_add(w, x, w->signals);
    return dqw_window_full(w) ? dqw_window_end(w, block) : 0;
}
