// The tracker over the drive's signals, with dead time and drift and without: events, window, noise and what is handed over after every step, weights
// and sums after every block.
#include "dqw_tracker_q15.h"
#include "target/hash.h"
#include "target/stimulus_q15.h"

static void put_learned(hash *h, const dqw_tracker_q15 *t)
{
    for (int i = 0; i < DQW_TRACK_Q15_WEIGHTS * (DQW_TRACK_Q15_WEIGHTS + 1) / 2; i++) hash_put(h, t->normal.a_q32[i]);
    for (int i = 0; i < DQW_TRACK_Q15_WEIGHTS; i++) {
        hash_put(h, t->normal.b_q32[i]);
        hash_put(h, t->w_q24[i]);
        hash_put(h, t->cov_q40[i]);
        hash_put(h, t->excess_q10[i]);
        hash_put(h, dqw_tracker_sd_q15(t, (enum dqw_tracker_weight_q15)i));
    }
    for (int i = 0; i < DQW_TRACK_Q15_SCORES; i++) {
        hash_put(h, t->score2_q68[i]);
        hash_put(h, t->score_lag_q68[i]);
    }
    for (int axis = 0; axis < 2; axis++) {
        hash_put(h, t->error_q56[axis]);
        hash_put(h, t->e_q28[axis]);
        hash_put(h, t->step_q15[axis]);
    }
    hash_put(h, t->follow_q15);
    hash_put(h, t->learned);
    hash_put(h, t->restarts);
    hash_put(h, t->blocks);
}

static void put_step(hash *h, const dqw_tracker_q15 *t)
{
    for (int i = 0; i < DQW_TRACK_Q15_SIGNALS; i++) {
        hash_put(h, t->window.sum[i]);
        hash_put(h, t->window.fall[i]);
    }
    hash_put(h, t->noise.i_d_q30);
    hash_put(h, t->noise.i_q_q30);
    hash_put(h, t->noise.w_q30);
    hash_put(h, t->slow_d_q28);
    hash_put(h, t->slow_q_q28);
    hash_put(h, t->slope_q15);
}

static void run(hash *h, bool angle)
{
    // Not static: the smallest board's data are full.
    stimulus s;
    dqw_tracker_q15 t;
    const dqw_tracker_q15_config config = {.scale = STIMULUS_SCALE,
                                           .R_uohm = 400000,
                                           .Ld_nH = 700000,
                                           .Lq_nH = 1900000,
                                           .psi_nWb = 12000000,
                                           .dead_time_width_mA = 200,
                                           .drift_ppm = angle ? 10000 : 0,
                                           .stale_limit = 10,
                                           .angle = angle,
                                           .noise_on_inputs = true};
    stimulus_start(&s);
    hash_put(h, dqw_tracker_init_q15(&t, &config));
    for (int k = 1; k <= 8000; k++) {
        stimulus_next(&s);
        const dqw_sample_q15 sample = stimulus_sample(&s);
        hash_put(h, dqw_tracker_sample_q15(&t, &sample, s.limited));
        if (k % 8 == 0) put_step(h, &t);
        if (k % 20 < 15 && dqw_tracker_waits_q15(&t)) {
            hash_put(h, dqw_tracker_learn_q15(&t));
            put_learned(h, &t);
        }
        if (k % 3000 == 0) dqw_tracker_gap_q15(&t, 77);
    }
}

hash hash_tracker(void)
{
    hash h = HASH_EMPTY;
    run(&h, true);
    run(&h, false);
    return h;
}
