// The estimator's interrupt part in Q15 with one effect. LIST chooses it, by its number in dqw_effect_name.h; 0: none.
#include "dqw_estimator_q15.h"
#include "target/board.h"
#include "target/piece.h"
#include "target/stimulus_q15.h"

#ifndef LIST
#define LIST 0
#endif

#if LIST == 2 || LIST == 3
#define SHAPE .i_uA = 6000000
#elif LIST == 4 || LIST == 5
#define SHAPE .tau_us = 600000000, .i_uA = 6000000
#elif LIST == 15
#define SHAPE .psi_nWb = 10000000, .cell_d_uA = 500000, .cell_q_uA = 500000, .map = map
#elif LIST == 7
#define SHAPE .order = 6
#else
#define SHAPE .R_uohm = 400000, .Ld_nH = 700000, .Lq_nH = 1900000, .psi_nWb = 12000000
#endif

#if LIST == 15
static const int16_t map[DQW_EFFECT_MAP_HEAD + 2 * 21 * 21] = {21, 12, 21, 1000, 2000};
#endif
#if DQW_EFFECT_WEIGHTS > 0
static const dqw_effect_q15_config list[] = {{.effect = (enum dqw_effect_name)LIST, SHAPE}};
#endif
static const dqw_estimator_q15_config config = {.scale = STIMULUS_SCALE,
                                                .dead_time_width_mA = 200,
                                                .follow = true,
                                                .stale_limit = 10,
                                                .angle = true,
                                                .encoder_offset = true,
                                                .noise_on_inputs = true,
#if DQW_EFFECT_WEIGHTS > 0
                                                .effects = list,
                                                .effect_count = LIST != 0
#endif
};
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
