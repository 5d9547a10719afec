// The estimator over the drive's signals, following, with dead time behind legs that rest, a held voltage and an angle
// that is late, without all that, without but following, with the pole pairs to find, settled, and behind an encoder
// that is off: events, window, noise and what is handed over after every step, weights and sums after every block, what
// is read at the end.
#include "dqw_estimator_block_q15.h"
#include "dqw_transform_q15.h"
#include "target/hash.h"
#include "target/hash_room.h"
#include "target/stimulus_q15.h"

hash_room hash_shared;

static void put_lasting(hash *h, const dqw_estimator_q15 *e)
{
    const dqw_residual_q15 *k = &e->residual;
    const dqw_segment_q15 *s = &e->segment;
    for (int i = 0; i < DQW_PARAMETERS; i++) {
        hash_put(h, k->alone_q31[i]);
        hash_put(h, k->slow_alone_q31[i]);
        hash_put(h, s->band_q28[i]);
        hash_put(h, s->b[i]);
        hash_put(h, s->up_q11[i] * 65536 + s->down_q11[i]);
    }
    for (int i = 0; i < 4; i++) hash_put(h, k->calm_q28[i]);
    hash_put(h, k->lasting_q38[0]);
    hash_put(h, k->lasting_q38[1]);
    hash_put(h, k->lasting_q38[2]);
    hash_put(h, k->slow_q38);
    hash_put(h, s->segments);
    hash_put(h, k->opened);
}

static void put_learned(hash *h, const dqw_estimator_q15 *e)
{
    const int n = e->normal.inputs;
    for (int i = 0; i < n * (n + 1) / 2; i++) hash_put(h, e->normal.a_q32[i]);
    for (int i = 0; i < n; i++) hash_put(h, e->normal.b_q32[i]);
    for (int i = 0; i < DQW_PARAMETERS; i++) {
        hash_put(h, e->w_q24[i]);
        hash_put(h, e->cov_q40[i]);
        hash_put(h, e->excess_q10[i]);
        hash_put(h, dqw_estimator_sd_q24(e, i));
    }
    for (int i = 0; i < 4; i++) {
        hash_put(h, e->score2_q68[i]);
        hash_put(h, e->score_lag_q68[i]);
    }
    for (int axis = 0; axis < 2; axis++) {
        hash_put(h, e->error_q56[axis]);
        hash_put(h, e->e_q28[axis]);
        hash_put(h, e->given.step_q15[axis]);
    }
    put_lasting(h, e);
    hash_put(h, e->recent_q54);
    hash_put(h, e->turn_cosine_q30);
    hash_put(h, e->turn_sine_q30);
    hash_put(h, e->lag_num);
    hash_put(h, e->lag_den);
    hash_put(h, e->lag_rest);
    hash_put(h, e->lag_by);
    hash_put(h, e->given.follow_q15);
    hash_put(h, e->learned);
    hash_put(h, e->restarts);
    hash_put(h, e->blocks);
    hash_put(h, e->pole_pairs);
    hash_put(h, e->stage.name);
}

static void put_step(hash *h, const dqw_estimator_q15 *e)
{
    for (int i = 0; i < DQW_PLAIN_Q15_SIGNALS; i++) {
        hash_put(h, e->window.part[e->window.over.now].cell[i].sum);
        hash_put(h, e->window.part[e->window.over.now].cell[i].fall);
    }
    for (int k = 0; k <= DQW_NOISE_Q15_SUMS; k++) hash_put(h, e->noise.sum_q30[k]);
    hash_put(h, e->answered_q15);
    hash_put(h, e->slow_d_q28);
    hash_put(h, e->slow_q_q28);
    hash_put(h, e->slope_q15);
}

// As a drive sees it whose angle is off by 0.12 rad.
static void see_off(dqw_sample_q15 *s)
{
    enum { COSINE_Q15 = 32532, SINE_Q15 = 3923 };
    const dqw_alphabeta_q15 v = {s->v_d_q15, s->v_q_q15};
    const dqw_alphabeta_q15 i = {s->i_d_q15, s->i_q_q15};
    const dqw_dq_q15 v_off = dqw_park_q15(v, COSINE_Q15, SINE_Q15);
    const dqw_dq_q15 i_off = dqw_park_q15(i, COSINE_Q15, SINE_Q15);
    s->v_d_q15 = v_off.d;
    s->v_q_q15 = v_off.q;
    s->i_d_q15 = i_off.d;
    s->i_q_q15 = i_off.q;
}

static void run(hash *h, dqw_estimator_q15_config config, int steps, bool off)
{
    static stimulus s;
    dqw_estimator_q15 *e = &hash_shared.estimator;
    config.R_uohm = 400000;
    config.Ld_nH = 700000;
    config.psi_nWb = 12000000;
    config.stale_limit = 10;
    stimulus_start(&s);
    hash_put(h, dqw_estimator_init_q15(e, &config));
    for (int k = 1; k <= steps; k++) {
        stimulus_next(&s);
        dqw_sample_q15 sample = stimulus_sample(&s);
        sample.resting = (uint8_t)(k / 5 % 8);
        if (off) see_off(&sample);
        hash_put(h, dqw_estimator_sample_q15(e, &sample, s.limited));
        if (k % 8 == 0) put_step(h, e);
        if ((k % 20 < 15 || config.settled) && e->window.over.pending) {
            hash_put(h, dqw_estimator_background_q15(e));
            put_learned(h, e);
        }
        if (k % 3000 == 0) dqw_estimator_missing_q15(e, k % 2 != 0 ? 1 : 77);
    }
    for (int i = 0; i < DQW_PARAMETERS; i++) {
        const dqw_reading_q15 r = dqw_estimator_read_q15(e, (enum dqw_parameter)i);
        hash_put(h, r.value_q40);
        hash_put(h, r.sd_q40);
        hash_put(h, r.sd_change_q40);
        hash_put(h, r.usable);
    }
    hash_put(h, dqw_estimator_voltage_acts_q15(e));
}

hash hash_estimator(void)
{
    hash h = HASH_EMPTY;
    const dqw_estimator_q15_config whole = {.scale = STIMULUS_SCALE,
                                            .dead_time_width_mA = 200,
                                            .angle_late_ns = STIMULUS_DT_NS / 2,
                                            .modulation = DQW_MODULATION_CLAMPED_60,
                                            .angle = true,
                                            .encoder_offset = true,
                                            .follow = true,
                                            .noise_on_inputs = true,
                                            .voltage_next = true,
                                            .voltage_held = true};
    const dqw_estimator_q15_config plain = {.scale = STIMULUS_SCALE, .noise_on_inputs = true};
    dqw_estimator_q15_config follows = plain;
    follows.follow = follows.observed = true;
    follows.half_window = 4;
    dqw_estimator_q15_config poles = plain;
    poles.scale.pole_pairs = 0;
    const dqw_estimator_q15_config settled = {.scale = STIMULUS_SCALE, .settled = true};
    dqw_estimator_q15_config mask = whole;
    mask.modulation = DQW_MODULATION_MASK;
    mask.threshold_ppm = 500000;
    mask.voltage_next = mask.voltage_held = false;
    run(&h, whole, 6000, false);
    run(&h, plain, 6000, false);
    run(&h, follows, 24000, false);
    run(&h, poles, 6000, false);
    run(&h, settled, 300, false);
    run(&h, mask, 20000, true);
    // Without a turn, the hash would be of half of it.
    return hash_shared.estimator.turn_sine_q30 != 0 ? h : 0;
}
