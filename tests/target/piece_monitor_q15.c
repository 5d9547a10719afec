// The interrupt's step of the condition monitor in Q15; its background beside it. LENT: with memory for stage 2;
// STORED: with store and restore.
#include "dqw_estimator_random_q15.h"
#include "dqw_monitor_q15.h"
#include "target/board.h"
#include "target/piece.h"
#include "target/stimulus_q15.h"

#ifdef LENT
static dqw_estimator_random_q15 lent;
#define RANDOM &lent
#else
#define RANDOM NULL
#endif
#ifdef STORED
static dqw_monitor_stored_q15 stored;
#endif
static const dqw_monitor_q15_config config = {.estimator = {.scale = STIMULUS_SCALE,
                                                            .R_uohm = 400000,
                                                            .Ld_nH = 700000,
                                                            .Lq_nH = 1900000,
                                                            .psi_nWb = 12000000,
                                                            .dead_time_width_mA = 200,
                                                            .follow = true,
                                                            .stale_limit = 10,
                                                            .modulation = DQW_MODULATION_CLAMPED_60,
                                                            .angle = true,
                                                            .encoder_offset = true,
                                                            .noise_on_inputs = true,
                                                            .random = RANDOM},
                                              .J_nkgm2 = 100000};
static dqw_monitor_q15 m;
static dqw_sample_q15 sample;
static bool limited;
const uint32_t piece_bytes = sizeof m;

void piece_start(void)
{
#ifdef LENT
    dqw_estimator_random_init_q15(&lent);
#endif
    if (dqw_monitor_init_q15(&m, &config) != DQW_OK) board_end("no monitor\n", 2);
#ifdef STORED
    (void)dqw_monitor_restore_q15(&m, &stored);
#endif
}

void piece_load(const stimulus *s)
{
    sample = stimulus_sample(s);
    limited = s->limited;
}

void piece_step(void) { (void)dqw_monitor_sample_q15(&m, &sample, limited); }

void piece_background(void)
{
    dqw_monitor_change_q15 change;
    if (dqw_monitor_background_q15(&m)) (void)dqw_monitor_event_q15(&m, &change);
#ifdef STORED
    (void)dqw_monitor_store_q15(&m, &stored);
#endif
}
