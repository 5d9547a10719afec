// The interrupt's step of the condition monitor in Q15, with memory for stage 2; its background beside it.
#include "dqw_estimator_random_q15.h"
#include "dqw_monitor_q15.h"
#include "target/board.h"
#include "target/piece.h"
#include "target/stimulus_q15.h"

static dqw_estimator_random_q15 lent;
static const dqw_monitor_q15_config config = {.estimator = {.scale = STIMULUS_SCALE,
                                                            .R_uohm = 400000,
                                                            .Ld_nH = 700000,
                                                            .Lq_nH = 1900000,
                                                            .psi_nWb = 12000000,
                                                            .dead_time_width_mA = 200,
                                                            .drift_ppm = 10000,
                                                            .stale_limit = 10,
                                                            .angle = true,
                                                            .encoder_offset = true,
                                                            .noise_on_inputs = true,
                                                            .random = &lent},
                                              .J_nkgm2 = 100000};
static dqw_monitor_q15 m;
static dqw_sample_q15 sample;
static bool limited;
const uint32_t piece_bytes = sizeof m;

void piece_start(void)
{
    dqw_estimator_random_init_q15(&lent);
    if (dqw_monitor_init_q15(&m, &config) != DQW_OK) board_end("no monitor\n", 2);
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
}
