// The window over the drive's signals, rows refused where they are limited, halves lost at times: every sum after every
// row, and every block.
#include "dqw_window_q15.h"
#include "target/hash.h"
#include "target/stimulus.h"

#define SIGNALS 5

static void put(hash *h, const dqw_window_q15 *w, const dqw_window_q15_rise *r)
{
    for (int k = 0; k < 2; k++) {
        for (int i = 0; i < SIGNALS; i++) {
            hash_put(h, w->part[k].cell[i].sum);
            hash_put(h, w->part[k].cell[i].fall);
        }
        hash_put(h, w->part[k].fall_weight);
        hash_put(h, w->part[k].valid);
    }
    for (int i = 0; i < SIGNALS; i++) hash_put(h, r->rise[i]);
    hash_put(h, r->weight);
    hash_put(h, r->valid);
    hash_put(h, r->has);
    hash_put(h, w->at);
    hash_put(h, w->over.now);
    hash_put(h, w->over.follows);
    hash_put(h, w->over.followed);
}

static void take_pair(dqw_window_q15 *w, const int32_t x[])
{
    for (int i = 0; i < SIGNALS; i++) dqw_window_gather_q15(&dqw_window_cells_q15(w)[i], x[i]);
    dqw_window_count_q15(w);
}

hash hash_window(void)
{
    static stimulus s;
    static dqw_window_q15 w;
    static dqw_window_q15_rise r;
    hash h = HASH_EMPTY;
    stimulus_start(&s);
    hash_put(&h, dqw_window_init_q15(&w, 20, SIGNALS));
    for (int k = 0; k < 3000; k++) {
        stimulus_next(&s);
        const int32_t x[SIGNALS] = {s.v_d_q15, s.i_d_q15 * 2, s.i_q_q15 * 4, -s.w_m_q15, 1 << 17};
        if (s.limited || (k / 200 % 3 == 2 && k % 3 == 0))
            dqw_window_refuse_q15(&w);
        else
            take_pair(&w, x);
        if (k % 1000 == 999) dqw_window_restart_q15(&w);
        put(&h, &w, &r);
        if (!dqw_window_full_q15(&w)) continue;
        hash_put(&h, dqw_window_turn_q15(&w));
        if (k / 20 % 7 == 6) continue;
        int32_t block[SIGNALS] = {0};
        int32_t sum[2];
        uint16_t weight = 0;
        hash_put(&h, dqw_window_join_q15(&w, &r, block, &weight, sum));
        dqw_handover_release(&w.over);
        for (int i = 0; i < SIGNALS; i++) hash_put(&h, block[i]);
        for (int i = 0; i < 2; i++) hash_put(&h, sum[i]);
        hash_put(&h, weight);
        put(&h, &w, &r);
    }
    return h;
}
