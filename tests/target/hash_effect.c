// The effects' inputs over the drive's signals, dynamic and settled: what was learned of all weights, and where the
// states stand.
#include "target/hash.h"
#include "target/hash_room.h"
#include "target/stimulus_q15.h"

#if DQW_EFFECT_WEIGHTS < 12
#error "the lists below have up to 12 weights"
#endif

#define MACHINE .R_uohm = 400000, .Ld_nH = 700000, .Lq_nH = 1900000, .psi_nWb = 12000000
static const int16_t map[] = {3, 2, 3, -30000, 100,  -20000, 8000,  -10000, 16000, 9000,  -5,
                              0, 0, 0, 12000,  9000, 7000,   20000, -7000,  32767, -32768};
// Every law once: lists that fit.
enum { LISTS = 5 };
static const dqw_effect_q15_config lists[LISTS][4] = {
    {{.effect = DQW_EFFECT_DEAD_TIME, .i_uA = 300000},
     {.effect = DQW_EFFECT_FLUX_HARMONICS, .order = 6},
     {.effect = DQW_EFFECT_CURRENT_OFFSET, MACHINE},
     {.effect = DQW_EFFECT_CURRENT_GAIN_MISMATCH, MACHINE}},
    {{.effect = DQW_EFFECT_SATURATION, .i_uA = 1000 * 1000 * STIMULUS_I},
     {.effect = DQW_EFFECT_CROSS_SATURATION, .i_uA = 1000 * 1000 * STIMULUS_I},
     {.effect = DQW_EFFECT_ANGLE_OFFSET, MACHINE},
     {.effect = DQW_EFFECT_VOLTAGE_OFFSET}},
    {{.effect = DQW_EFFECT_WINDING_TEMPERATURE, .tau_us = 100000, .row_us = 50},
     {.effect = DQW_EFFECT_MAGNET_TEMPERATURE, .T_0_cC = 2500},
     {.effect = DQW_EFFECT_IRON_LOSS, MACHINE},
     {.effect = DQW_EFFECT_DELAY}},
    {{.effect = DQW_EFFECT_SKIN_EFFECT, .start_q40 = {1 << 30}},
     {.effect = DQW_EFFECT_PHASE_RESISTANCE_IMBALANCE, .start_q40 = {1 << 30, -(1 << 30)}},
     {.effect = DQW_EFFECT_WINDING_TEMPERATURE, .T_0_cC = 2500},
     {.effect = DQW_EFFECT_MAGNET_TEMPERATURE, .tau_us = 100000}},
    {{.effect = DQW_EFFECT_FLUX_MAP, .psi_nWb = 9000000, .cell_d_uA = 2000000, .cell_q_uA = 1500000, .map = map},
     {.effect = DQW_EFFECT_SKIN_EFFECT},
     {.effect = DQW_EFFECT_VOLTAGE_OFFSET},
     {.effect = DQW_EFFECT_DELAY}},
};

static void put_inputs(hash *h, const dqw_effect_q15 *f)
{
    for (int i = 0; i < f->weights; i++) {
        hash_put(h, f->a_d[i]);
        hash_put(h, f->a_q[i]);
        hash_put(h, f->g_d[i]);
        hash_put(h, f->g_q[i]);
    }
    hash_put(h, f->late_d_q28);
    hash_put(h, f->late_q_q28);
    hash_put(h, f->heat_q60[0]);
    hash_put(h, f->heat_q60[1]);
}

static void put_learned(hash *h, const dqw_estimator_q15 *e)
{
    for (int i = 0; i < DQW_PARAMETERS; i++) hash_put(h, e->w_q24[i]);
    for (int k = 0; k < e->effect.count; k++) {
        int64_t w[DQW_EFFECT_STARTS];
        int64_t sd[DQW_EFFECT_STARTS];
        hash_put(h, dqw_estimator_read_effect_q15(e, k, w, sd));
        for (int i = 0; i < dqw_effect_weights(e->effect.list[k].effect); i++) {
            hash_put(h, w[i]);
            hash_put(h, sd[i]);
        }
    }
}

static void run(hash *h, int list, bool settled, int steps)
{
    static stimulus s;
    dqw_estimator_q15 *e = &hash_shared.estimator;
    const dqw_estimator_q15_config config = {.scale = STIMULUS_SCALE,
                                             .half_window = 10,
                                             .angle = true,
                                             .settled = settled,
                                             .effects = lists[list],
                                             .effect_count = 4};
    stimulus_start(&s);
    hash_put(h, dqw_estimator_init_q15(e, &config));
    for (int k = 1; k <= steps; k++) {
        stimulus_next(&s);
        dqw_sample_q15 sample = stimulus_sample(&s);
        sample.temp_winding_cC = (int16_t)(2500 + k);
        sample.temp_magnet_cC = (int16_t)(3500 - k / 2);
        hash_put(h, dqw_estimator_sample_q15(e, &sample, s.limited));
        hash_put(h, dqw_estimator_background_q15(e));
        put_inputs(h, &e->effect);
        if (k % 200 == 0) put_learned(h, e);
    }
    put_learned(h, e);
}

hash hash_effect(void)
{
    hash h = HASH_EMPTY;
    for (int list = 0; list < LISTS; list++) {
        run(&h, list, false, 1000);
        run(&h, list, true, 60);
    }
    return h;
}
