// The window over the drive's signals, rows refused where they are limited: every sum after every row, and every block.
#include "dqw_window_q15.h"
#include "target/hash.h"
#include "target/stimulus.h"

#define SIGNALS 5

static void put(hash *h, const dqw_window_q15 *w)
{
    for (int i = 0; i < SIGNALS; i++) {
        hash_put(h, w->sum[i]);
        hash_put(h, w->fall[i]);
        hash_put(h, w->rise[i]);
    }
    hash_put(h, w->fall_weight);
    hash_put(h, w->rise_weight);
    hash_put(h, w->at);
    hash_put(h, w->valid);
    hash_put(h, w->rise_valid);
    hash_put(h, w->has_rise);
}

hash hash_window(void)
{
    static stimulus s;
    static dqw_window_q15 w;
    hash h = HASH_EMPTY;
    stimulus_start(&s);
    hash_put(&h, dqw_window_init_q15(&w, 20, SIGNALS));
    for (int k = 0; k < 3000; k++) {
        stimulus_next(&s);
        const int32_t x[SIGNALS] = {s.v_d_q15, s.i_d_q15 * 2, s.i_q_q15 * 4, -s.w_m_q15, 1 << 17};
        dqw_window_add_q15(&w, s.limited || (k / 200 % 3 == 2 && k % 3 == 0) ? NULL : x, SIGNALS);
        if (k % 1000 == 999) dqw_window_restart_q15(&w);
        put(&h, &w);
        if (!dqw_window_full_q15(&w)) continue;
        int32_t block[SIGNALS] = {0};
        uint16_t weight = 0;
        hash_put(&h, dqw_window_end_q15(&w, block, &weight));
        for (int i = 0; i < SIGNALS; i++) hash_put(&h, block[i]);
        hash_put(&h, weight);
        put(&h, &w);
    }
    return h;
}
