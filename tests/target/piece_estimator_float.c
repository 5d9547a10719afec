// The estimator's interrupt part in float, dead time's input with it; its background beside it. HELD: its voltage acts
// a period later, and is held in the stationary frame.
#include "dqw_estimator.h"
#include "target/board.h"
#include "target/piece.h"
#include "target/stimulus_float.h"

#ifndef HELD
#define HELD false
#endif

static const dqw_estimator_config config = {.dt_s = (float)STIMULUS_DT_NS * 1e-9f,
                                            .v_base_V = 14,
                                            .i_base_A = 6,
                                            .w_base_rad_s = 110,
                                            .R_ohm = 0.4f,
                                            .Ld_H = 0.7e-3f,
                                            .Lq_H = 1.9e-3f,
                                            .psi_Wb = 12e-3f,
                                            .pole_pairs = STIMULUS_PAIRS,
                                            .dead_time_width_A = 0.2f,
                                            .follow = true,
                                            .stale_limit = 10,
                                            .modulation = DQW_MODULATION_CLAMPED_60,
                                            .angle = true,
                                            .encoder_offset = true,
                                            .noise_on_inputs = true,
                                            .voltage_next = HELD,
                                            .voltage_held = HELD};
static dqw_estimator e;
static dqw_sample sample;
static bool limited;
const uint32_t piece_bytes = sizeof e;

void piece_start(void)
{
    if (dqw_estimator_init(&e, &config) != DQW_OK) board_end("no estimator\n", 2);
}

void piece_load(const stimulus *s)
{
    sample = stimulus_float(s);
    limited = s->limited;
}

void piece_step(void) { (void)dqw_estimator_sample(&e, &sample, limited); }

void piece_background(void) { (void)dqw_estimator_background(&e); }
