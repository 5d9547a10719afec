// The mechanical axis over the drive's signals, plain and with every effect of the shaft: events, blocks and weights after every step.
#include "dqw_mechanical_q15.h"
#include "target/hash.h"
#include "target/hash_room.h"
#include "target/stimulus.h"

static void put_state(hash *h, const dqw_mechanical_q15 *m)
{
    const int inputs = m->axis.normal.inputs;
    for (int i = 0; i < inputs * (inputs + 1) / 2; i++) hash_put(h, m->axis.normal.a_q32[i]);
    for (int i = 0; i < inputs; i++) {
        hash_put(h, m->axis.normal.b_q32[i]);
        hash_put(h, m->axis.w_q40[i]);
    }
    hash_put(h, m->axis.normal.c_q32);
    hash_put(h, m->axis.error_q56);
    hash_put(h, m->axis.lag_q56);
    for (int i = 0; i < DQW_FRICTION_Q15_VALUES; i++) {
        hash_put(h, m->friction.value_q40[i]);
        hash_put(h, m->friction.sd_q40[i]);
    }
    hash_put(h, m->friction.known);
}

static void run(hash *h, const dqw_mechanical_q15_config *config)
{
    static stimulus s;
    dqw_mechanical_q15 *m = &hash_shared.mechanical;
    stimulus_start(&s);
    hash_put(h, dqw_mechanical_init_q15(m, config));
    for (int k = 1; k <= 5000; k++) {
        stimulus_next(&s);
        // What turns the shaft here is the drive's current.
        const uint32_t events = dqw_mechanical_step_q15(m, s.i_q_q15, s.w_m_q15, s.theta_e_turn, s.limited) | dqw_mechanical_background_q15(m);
        hash_put(h, events);
        for (int i = 0; i < m->window.signals; i++) hash_put(h, m->window.fall[i]);
        if (events != 0) put_state(h, m);
        if (k % 2000 == 0) dqw_mechanical_gap_q15(m);
    }
    dqw_mechanical_read_q15(m);
    put_state(h, m);
}

hash hash_mechanical(void)
{
    static const dqw_torque_q15_config effects[] = {
        {.effect = DQW_EFFECT_DIRECTION_ASYMMETRY, .width_urad_s = 1000000},
        {.effect = DQW_EFFECT_STRIBECK_FRICTION, .width_urad_s = 1000000, .fall_urad_s = 20000000, .start_uNm = {40000}},
        {.effect = DQW_EFFECT_COGGING_TORQUE, .periods = 12},
        {.effect = DQW_EFFECT_LOAD_TORQUE},
    };
    dqw_mechanical_q15_config config = {
        .scale = {1500000, 1000 * STIMULUS_W, 1000000}, .J_gmm2 = 2000000, .B_nNms_rad = 1000000, .coulomb = true, .standstill_urad_s = 500000};
    hash h = HASH_EMPTY;
    run(&h, &config);
    config.coulomb_width_urad_s = 1000000;
    config.effects = effects;
    config.effect_count = 4;
    run(&h, &config);
    return h;
}
