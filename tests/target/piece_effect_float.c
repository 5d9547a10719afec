// The estimator's interrupt part in float with one effect. LIST chooses it, by its number in dqw_effect_name.h; 0:
// none.
#include "dqw_estimator.h"
#include "target/board.h"
#include "target/piece.h"
#include "target/stimulus_float.h"

#ifndef LIST
#define LIST 0
#endif

// clang-format off
#if LIST == 4 || LIST == 5
#define SHAPE {25, 600, 6}
#elif LIST == 10
#define SHAPE {0.7e-3f, 1.9e-3f, 12e-3f}
#elif LIST == 15
#define SHAPE {0.01f, 0.5f, 0.5f}, .map = map
#elif LIST == 6 || LIST == 8 || LIST == 9
#define SHAPE {0.4f, 0.7e-3f, 1.9e-3f}
#else
#define SHAPE {6}
#endif
// clang-format on

#if LIST == 15
static const int16_t map[DQW_EFFECT_MAP_HEAD + 2 * 21 * 21] = {21, 12, 21, 1000, 2000};
#endif
#if DQW_EFFECT_WEIGHTS > 0
static const dqw_effect_config list[] = {{.effect = (enum dqw_effect_name)LIST, .shape = SHAPE}};
#endif
static const dqw_estimator_config config = {.dt_s = (float)STIMULUS_DT_NS * 1e-9f,
                                            .v_base_V = 14,
                                            .i_base_A = 6,
                                            .w_base_rad_s = 110,
                                            .pole_pairs = STIMULUS_PAIRS,
                                            .dead_time_width_A = 0.2f,
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
