// The estimator over the drive's signals, dynamic and settled: events, blocks and weights after every step, what is known at the end.
#include "target/hash.h"
#include "target/hash_room.h"
#include "target/stimulus_q15.h"

static void put_axis(hash *h, const dqw_axis_q15 *a)
{
    const int inputs = a->normal.inputs;
    for (int i = 0; i < inputs * (inputs + 1) / 2; i++) hash_put(h, a->normal.a_q32[i]);
    for (int i = 0; i < inputs; i++) {
        hash_put(h, a->normal.b_q32[i]);
        hash_put(h, a->w_q40[i]);
        hash_put(h, a->start_q40[i]);
    }
    hash_put(h, a->normal.c_q32);
    hash_put(h, a->error_q56);
    hash_put(h, a->lag_q56);
    hash_put(h, a->recent_q56);
    hash_put(h, a->target_q56);
    hash_put(h, a->error_last_q28);
    hash_put(h, a->blocks);
}

static void put_state(hash *h, const dqw_estimator_q15 *e)
{
    put_axis(h, &e->d);
    put_axis(h, &e->q);
    for (int i = 0; i < DQW_PARAMETERS_Q15; i++) {
        hash_put(h, e->parameters.value_q40[i]);
        hash_put(h, e->parameters.sd_q40[i]);
    }
    hash_put(h, e->parameters.pole_pairs);
    hash_put(h, e->parameters.known);
    hash_put(h, e->stage.name);
    hash_put(h, e->stage.back);
    hash_put(h, e->events);
}

static void put_window(hash *h, const dqw_window_q15 *w)
{
    for (int i = 0; i < w->signals; i++) {
        hash_put(h, w->sum[i]);
        hash_put(h, w->fall[i]);
        hash_put(h, w->rise[i]);
    }
    hash_put(h, w->fall_weight);
    hash_put(h, w->rise_weight);
}

hash_room hash_shared;

static void run(hash *h, bool settled, int steps)
{
    static stimulus s;
    dqw_estimator_q15 *e = &hash_shared.estimator;
    const dqw_estimator_q15_config config = {
        .scale = STIMULUS_SCALE, .R_uohm = 400000, .Ld_nH = 700000, .Lq_nH = 1900000, .psi_nWb = 12000000, .stale_limit = 10, .settled = settled};
    stimulus_start(&s);
    hash_put(h, dqw_estimator_init_q15(e, &config));
    for (int k = 1; k <= steps; k++) {
        stimulus_next(&s);
        const dqw_sample_q15 sample = stimulus_sample(&s);
        const uint32_t events = dqw_estimator_step_q15(e, &sample, s.limited) | dqw_estimator_background_q15(e);
        hash_put(h, events);
        put_window(h, &e->window);
        if (events != 0) put_state(h, e);
        if (k % 2000 == 0) dqw_estimator_gap_q15(e);
    }
    dqw_estimator_read_q15(e);
    put_state(h, e);
}

hash hash_estimator(void)
{
    hash h = HASH_EMPTY;
    run(&h, false, 6000);
    run(&h, true, 300);
    return h;
}
