// The monitor over the drive's signals until an event is told: the witness, the healthy values and what it decides,
// block by block; what is read and stored at its end; then patterns of every fault.
#include "dqw_estimator_random_q15.h"
#include "dqw_monitor_q15.h"
#include "dqw_q15.h"
#include "target/hash.h"
#include "target/hash_room.h"
#include "target/stimulus_q15.h"

static void put_block(hash *h, const dqw_monitor_q15 *m)
{
    for (int k = 0; k < DQW_WITNESS_INPUTS; k++) {
        hash_put(h, m->witness.re_q28[k]);
        hash_put(h, m->witness.im_q28[k]);
        hash_put(h, m->witness.power_q52[k]);
    }
    hash_put(h, m->estimator.recent_q54);
    hash_put(h, m->friction_q24);
    hash_put(h, m->spread_q48);
}

static void put_look(hash *h, const dqw_monitor_q15 *m)
{
    for (int i = 0; i < DQW_WATCH_OFFSET; i++) hash_put(h, m->healthy.weight_q24[i]);
    for (int i = 0; i < DQW_WATCH_CHANNELS; i++) hash_put(h, m->watch.change[i].sum_q5);
    hash_put(h, m->healthy.hottest_q16);
    hash_put(h, m->healthy.residual_q54);
    hash_put(h, m->estimator.stage.name);
    hash_put(h, m->watch.alarms);
}

static void put_verdict(hash *h, dqw_fault_verdict_q15 v)
{
    hash_put(h, v.name);
    hash_put(h, v.confidence_q15);
    hash_put(h, v.phase);
}

static void put_end(hash *h, const dqw_monitor_q15 *m)
{
    for (int i = 0; i < DQW_WATCH_CHANNELS; i++) {
        const dqw_reading_q15 r = dqw_monitor_read_q15(m, (enum dqw_monitor_channel)i);
        hash_put(h, r.value_q40);
        hash_put(h, r.sd_q40);
        hash_put(h, r.usable);
        hash_put(h, dqw_monitor_sensitivity_q15(m, (enum dqw_monitor_channel)i));
        hash_put(h, dqw_monitor_unwatched_q15(m, (enum dqw_monitor_channel)i));
    }
    hash_put(h, dqw_monitor_why_q15(m));
    dqw_monitor_stored_q15 stored;
    if (dqw_monitor_store_q15(m, &stored)) hash_put(h, stored.check);
}

static uint32_t run(hash *h, bool lent)
{
    // Not static: the smallest board's data are full.
    stimulus s;
    dqw_estimator_random_q15 memory;
    dqw_monitor_q15 *m = &hash_shared.monitor;
    const dqw_monitor_q15_config config = {
        .estimator = {.scale = STIMULUS_SCALE,
                      .R_uohm = 400000,
                      .Ld_nH = 700000,
                      .Lq_nH = 1900000,
                      .psi_nWb = 12000000,
                      .dead_time_width_mA = 200,
                      .follow = true,
                      .stale_limit = 10,
                      .half_window = 4,
                      .angle = true,
                      .encoder_offset = true,
                      .noise_on_inputs = true,
                      .threshold_ppm = 400000,
                      .random = lent ? &memory : NULL},
        .band_ppm = {500000, 500000, 500000, 100000, 200000, 500000, 100000, 900000, 900000, 100000},
        .J_nkgm2 = 100000};
    uint32_t events = 0;
    dqw_estimator_random_init_q15(&memory);
    stimulus_start(&s);
    hash_put(h, dqw_monitor_init_q15(m, &config));
    for (int k = 1; k <= (lent ? 6000 : 40000); k++) {
        stimulus_next(&s);
        dqw_sample_q15 sample = stimulus_sample(&s);
        // From here on, much more flux.
        if (k > 16000) sample.v_q_q15 = dqw_q15_sat(sample.v_q_q15 + sample.w_m_q15 / 2);
        // Bits without sense would last in the residual, and nothing be known.
        const bool limited = s.limited || k % 2500 > 2470 || k % 2500 < 3;
        hash_put(h, dqw_monitor_sample_q15(m, &sample, limited));
        if (!m->estimator.window.over.pending) continue;
        dqw_monitor_change_q15 change;
        const bool told = dqw_monitor_background_q15(m) && dqw_monitor_event_q15(m, &change);
        put_block(h, m);
        if (m->watch.blocks == 0) put_look(h, m);
        if (dqw_monitor_stage_q15(m) == DQW_STAGE_DOMAIN) hash_put(h, dqw_monitor_define_q15(m, &config));
        if (!told) continue;
        events++;
        hash_put(h, change.value_q40);
        hash_put(h, change.sd_q40);
        hash_put(h, change.healthy_q40);
        hash_put(h, (int64_t)change.since);
        put_verdict(h, change.fault);
    }
    put_end(h, m);
    return events;
}

hash hash_monitor(void)
{
    hash h = HASH_EMPTY;
    // Without an event, the hash would be of half of it.
    if (run(&h, false) == 0) return 0;
    (void)run(&h, true);
    stimulus s;
    stimulus_start(&s);
    for (int n = 0; n < 200; n++) {
        int32_t change_q24[DQW_SIGNS];
        int32_t unit_q24[DQW_SIGNS];
        for (int i = 0; i < DQW_SIGNS; i++) {
            change_q24[i] = (int32_t)(stimulus_any(&s) / 4294967296);
            unit_q24[i] = (int32_t)(stimulus_bits(&s) >> (4 + n % 20)) + 1;
        }
        const dqw_fault_machine_q15 machine = {(int32_t)(stimulus_bits(&s) >> 6),
                                               (int32_t)(stimulus_bits(&s) >> 6),
                                               (int64_t)stimulus_bits(&s) << 8,
                                               (int32_t)(stimulus_bits(&s) >> 1),
                                               n % 2 == 1,
                                               (int32_t)(stimulus_bits(&s) >> 6)};
        put_verdict(&h, dqw_fault_name_it_q15(change_q24, unit_q24, machine));
    }
    return h;
}
