// The shaft over the drive's signals, plain and with every effect of the shaft: events, blocks and weights after every
// step.
#include "dqw_shaft_q15.h"
#include "target/hash.h"
#include "target/hash_room.h"
#include "target/stimulus.h"

static void put_state(hash *h, const dqw_shaft_q15 *m)
{
    const int inputs = m->inputs;
    for (int i = 0; i < inputs * (inputs + 1) / 2; i++) hash_put(h, m->normal.a_q32[i]);
    for (int i = 0; i < inputs; i++) {
        hash_put(h, m->normal.b_q32[i]);
        hash_put(h, m->w_q40[i]);
        hash_put(h, m->sd_q40[i]);
    }
    hash_put(h, m->normal.c_q32);
    hash_put(h, m->error_q56);
    hash_put(h, m->lag_q56);
    for (int i = 0; i < DQW_SHAFT_PARAMETERS; i++) {
        const dqw_reading_q15 r = dqw_shaft_read_q15(m, (enum dqw_shaft_parameter)i);
        hash_put(h, r.value_q40);
        hash_put(h, r.sd_q40);
        hash_put(h, r.usable);
    }
}

static void run(hash *h, const dqw_shaft_q15_config *config)
{
    static stimulus s;
    dqw_shaft_q15 *m = &hash_shared.shaft;
    stimulus_start(&s);
    hash_put(h, dqw_shaft_init_q15(m, config));
    for (int k = 1; k <= 5000; k++) {
        stimulus_next(&s);
        // What turns the shaft here is the drive's current.
        const uint32_t events = dqw_shaft_sample_q15(m, s.i_q_q15, s.w_m_q15, s.theta_e_turn, s.limited);
        hash_put(h, events);
        hash_put(h, dqw_shaft_background_q15(m));
        for (int i = 0; i < m->window.signals; i++) hash_put(h, m->window.part[m->window.over.now].cell[i].fall);
        if (events != 0) put_state(h, m);
        if (k % 2000 == 0) dqw_shaft_missing_q15(m, (uint32_t)(k / 2000));
    }
    put_state(h, m);
}

hash hash_shaft(void)
{
    static const dqw_torque_q15_config effects[] = {
        {.effect = DQW_EFFECT_DIRECTION_ASYMMETRY, .width_urad_s = 1000000},
        {.effect = DQW_EFFECT_STRIBECK_FRICTION,
         .width_urad_s = 1000000,
         .fall_urad_s = 20000000,
         .start_uNm = {40000}},
        {.effect = DQW_EFFECT_COGGING_TORQUE, .periods = 12},
        {.effect = DQW_EFFECT_LOAD_TORQUE},
    };
    dqw_shaft_q15_config config = {.scale = {1500000, 1000 * STIMULUS_W, 1000000},
                                   .J_gmm2 = 2000000,
                                   .B_nNms_rad = 1000000,
                                   .coulomb = true,
                                   .standstill_urad_s = 500000};
    hash h = HASH_EMPTY;
    run(&h, &config);
    config.coulomb_width_urad_s = 1000000;
    config.effects = effects;
    config.effect_count = 4;
    run(&h, &config);
    return h;
}
