// Segments of the drive's signals as inputs, whose weights scatter, and one of them steps: sums now and then, bands and
// what agrees after every segment, moves.
#include "dqw_q15.h"
#include "dqw_segment_q15.h"
#include "target/hash.h"
#include "target/hash_room.h"
#include "target/stimulus.h"

enum { N = DQW_FOLLOWED };

static void put_end(hash *h, const dqw_segment_q15 *s)
{
    for (int i = 0; i < N; i++) {
        hash_put(h, s->band_q28[i]);
        hash_put(h, s->up_q11[i]);
        hash_put(h, s->down_q11[i]);
    }
    for (int k = 0; k < 2; k++) {
        hash_put(h, s->ever[k].mean_q30);
        hash_put(h, s->ever[k].variance_q31);
    }
}

static void put_sums(hash *h, const dqw_segment_q15 *s)
{
    for (int i = 0; i < N * (N + 1) / 2; i++) hash_put(h, s->a[i]);
    for (int i = 0; i < N; i++) hash_put(h, s->b[i]);
    for (int k = 0; k < 2; k++) {
        hash_put(h, s->now[k].mean_q30);
        hash_put(h, s->now[k].variance_q31);
    }
    hash_put(h, s->a_bits * 256 + s->b_bits);
}

hash hash_segment(void)
{
    static stimulus s;
    static dqw_segment_q15_known known;
    dqw_segment_q15 *g = &hash_shared.segment;
    hash h = HASH_EMPTY;
    int openings = 0;
    for (int i = 0; i < N; i++) {
        known.least_q28[i] = 200000 << i % 3;
        known.model_q28[i] = i % 2 == 0 ? 1000000 : 0;
        known.wide_q28[i] = 80000000;
    }
    stimulus_start(&s);
    dqw_segment_init_q15(g, known.least_q28);
    int32_t off_q28[N] = {0};
    for (int k = 1; k <= 8000; k++) {
        stimulus_next(&s);
        const int32_t x_q28[N] = {s.i_d_q15 * 1024,
                                  s.i_q_q15 * 2048,
                                  s.w_m_q15 * 8192,
                                  (s.i_d_q15 - s.v_d_q15) * 512,
                                  s.w_m_q15 < 0 ? -9 : 9 << 20,
                                  s.v_q_q15 * 4096,
                                  k % 64 * 65536};
        int64_t e_q28 = s.v_d_q15 * 4;
        for (int i = 0; i < N; i++) e_q28 += dqw_q_round64((int64_t)x_q28[i] * off_q28[i], 28);
        dqw_segment_row_q15(g, x_q28, dqw_q31_sat(e_q28));
        if (k % 50 == 0) put_sums(&h, g);
        if (!dqw_segment_block_q15(g, s.w_m_q15 * 8192, s.i_q_q15 * 8192, 40, 300)) continue;
        int32_t move_q24[N];
        const int changed = dqw_segment_end_q15(g, (int64_t)1 << 38, &known, move_q24);
        hash_put(&h, changed);
        put_end(&h, g);
        for (int i = 0; i < N; i++)
            off_q28[i] = (int32_t)(stimulus_bits(&s) % 400000u) - 200000 + (k > 4000 && i == 2 ? 9000000 : 0);
        if (changed < 0) continue;
        openings++;
        for (int i = 0; i < N; i++) hash_put(&h, move_q24[i]);
    }
    // Without an opening, the hash would be of half of it.
    return openings > 0 ? h : 0;
}
