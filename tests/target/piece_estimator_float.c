// The estimator's step in float: most of them gather, one in twenty learns a block. Its background learns from the reservoirs.
#include "dqw_estimator.h"
#include "target/board.h"
#include "target/piece.h"
#include "target/stimulus_float.h"

static dqw_estimator e;
static dqw_random_sample reservoir_d[20], reservoir_q[20];
static const dqw_estimator_config config = {.dt_s = (float)STIMULUS_DT_NS * 1e-9f,
                                            .v_base_V = 14,
                                            .i_base_A = 6,
                                            .w_base_rad_s = 110,
                                            .R_ohm = 0.4f,
                                            .Ld_H = 0.7e-3f,
                                            .Lq_H = 1.9e-3f,
                                            .psi_Wb = 12e-3f,
                                            .pole_pairs = STIMULUS_PAIRS,
                                            .stale_limit = 10,
                                            .reservoir_d = reservoir_d,
                                            .reservoir_q = reservoir_q,
                                            .reservoir = 20};
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

void piece_step(void) { (void)dqw_estimator_step(&e, &sample, limited); }

void piece_background(void) { dqw_estimator_background(&e); }
