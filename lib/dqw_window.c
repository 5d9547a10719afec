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
    for (int i = 0; i < w->signals; i++) w->flat[i] = w->ramp[i] = 0.0f;
    w->flat_weight = w->ramp_weight = 0.0f;
    w->at = w->valid = 0;
}

void dqw_window_restart(dqw_window *w)
{
    clear_half(w);
    w->has_rise = false;
}

uint32_t dqw_window_step(dqw_window *w, const float x[], float block[])
{
    // [WIN.1] gather: weight j on the way up; the way down is (half + 1) - j
    w->at++;
    if (x != NULL) {
        const float j = (float)w->at;
        for (int i = 0; i < w->signals; i++) {
            w->flat[i] += x[i];
            w->ramp[i] += j * x[i];
        }
        w->flat_weight += 1.0f;
        w->ramp_weight += j;
        w->valid++;
    }
    if (w->at < w->half) return 0;

    // [WIN.2] join the half before, rising, with this one, falling
    uint32_t event = 0;
    if (w->has_rise) {
        const float top = (float)w->half + 1.0f;
        if (4 * (w->valid + w->rise_valid) >= 3 * 2 * w->half) {
            const float scale = 1.0f / (w->rise_weight + top * w->flat_weight - w->ramp_weight);
            for (int i = 0; i < w->signals; i++) block[i] = (w->rise[i] + top * w->flat[i] - w->ramp[i]) * scale;
            event = DQW_EVENT_LEARNED;
        } else {
            event = DQW_EVENT_INCOMPLETE;
        }
    }

    // [WIN.3] this half rises in the next block
    for (int i = 0; i < w->signals; i++) w->rise[i] = w->ramp[i];
    w->rise_weight = w->ramp_weight;
    w->rise_valid = w->valid;
    w->has_rise = true;
    clear_half(w);
    return event;
}
