// The interrupt's step of the condition monitor in float; its background beside it. LENT: with memory for stage 2;
// STORED: with store and restore.
#include <stddef.h>

#include "dqw_estimator_random.h"
#include "dqw_monitor.h"
#include "target/board.h"
#include "target/piece.h"
#include "target/stimulus_float.h"

#ifdef LENT
static dqw_estimator_random lent;
#define RANDOM &lent
#else
#define RANDOM NULL
#endif
static const dqw_monitor_config config = {.estimator = {.dt_s = (float)STIMULUS_DT_NS * 1e-9f,
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
                                                        .random = RANDOM},
                                          .J_kgm2 = 1e-4f};
static dqw_monitor m;
static dqw_sample sample;
static bool limited;
#ifdef STORED
static dqw_monitor_stored stored;
#endif
const uint32_t piece_bytes = sizeof m;

void piece_start(void)
{
#ifdef LENT
    dqw_estimator_random_init(&lent);
#endif
    if (dqw_monitor_init(&m, &config) != DQW_OK) board_end("no monitor\n", 2);
#ifdef STORED
    (void)dqw_monitor_restore(&m, &stored);
#endif
}

void piece_load(const stimulus *s)
{
    sample = stimulus_float(s);
    limited = s->limited;
}

void piece_step(void) { (void)dqw_monitor_sample(&m, &sample, limited); }

void piece_background(void)
{
    dqw_monitor_change change;
    if (dqw_monitor_background(&m)) (void)dqw_monitor_event(&m, &change);
#ifdef STORED
    (void)dqw_monitor_store(&m, &stored);
#endif
}
