// The estimator's interrupt part in Q15, dead time's input with it; its background beside it. HELD: its voltage acts a
// period later, and is held in the stationary frame.
#include "dqw_estimator_q15.h"
#include "target/board.h"
#include "target/piece.h"
#include "target/stimulus_q15.h"

#ifndef HELD
#define HELD false
#endif

static const dqw_estimator_q15_config config = {.scale = STIMULUS_SCALE,
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
                                                .voltage_next = HELD,
                                                .voltage_held = HELD};
static dqw_estimator_q15 e;
static dqw_sample_q15 sample;
static bool limited;
const uint32_t piece_bytes = sizeof e;

void piece_start(void)
{
    if (dqw_estimator_init_q15(&e, &config) != DQW_OK) board_end("no estimator\n", 2);
}

void piece_load(const stimulus *s)
{
    sample = stimulus_sample(s);
    limited = s->limited;
}

void piece_step(void) { (void)dqw_estimator_sample_q15(&e, &sample, limited); }

void piece_background(void) { (void)dqw_estimator_background_q15(&e); }
