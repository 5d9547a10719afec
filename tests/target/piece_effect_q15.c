// What the inputs of one list of effects cost in the interrupt, in Q15: the inputs of each pair, the heat, and the window's signals. LIST chooses the
// effect, by its number in dqw_effect_name.h; 0: none.
#include "dqw_effect_q15.h"
#include "dqw_window_q15.h"
#include "target/board.h"
#include "target/piece.h"
#include "target/stimulus_q15.h"

#ifndef LIST
#define LIST 0
#endif
#define PLAIN 11

static dqw_window_q15 window;
static int32_t pair[DQW_WINDOW_Q15_SIGNALS], block[DQW_WINDOW_Q15_SIGNALS];
static dqw_sample_q15 sample, last;

#if DQW_EFFECT_WEIGHTS > 0
#define MACHINE .R_uohm = 400000, .Ld_nH = 700000, .Lq_nH = 1900000, .psi_nWb = 12000000
#if LIST == 2 || LIST == 3
#define SHAPE .i_uA = 6000000
#elif LIST == 4 || LIST == 5
#define SHAPE .tau_us = 600000000, .i_uA = 6000000
#elif LIST == 7
#define SHAPE .order = 6
#else
#define SHAPE MACHINE
#endif
static const dqw_effect_q15_config list[] = {{.effect = (enum dqw_effect_name)LIST, SHAPE}};
static const dqw_scale scale = STIMULUS_SCALE;
static const dqw_effect_q15_base base = {.scale = &scale, .half_window = 20, .dead_time_apart = true};
static dqw_effect_q15 e;
const uint32_t piece_bytes = sizeof e + sizeof window;

static int start_effect(void)
{
    if (dqw_effect_init_q15(&e, list, LIST != 0, &base) != DQW_OK) board_end("no effect\n", 2);
    // The first sample ends no pair.
    (void)dqw_effect_pair_q15(&e, NULL, &sample, pair + PLAIN, pair + PLAIN + e.weights);
    (void)dqw_effect_pair_q15(&e, &sample, &sample, pair + PLAIN, pair + PLAIN + e.weights);
    return e.weights;
}

static bool take_effect(void)
{
    const bool there = dqw_effect_pair_q15(&e, &last, &sample, pair + PLAIN, pair + PLAIN + e.weights);
    dqw_effect_heat_q15(&e, sample.i_d_q15, sample.i_q_q15);
    return there;
}
#else
const uint32_t piece_bytes = sizeof window;
static int start_effect(void) { return 0; }
static bool take_effect(void) { return true; }
#endif

void piece_start(void)
{
    if (dqw_window_init_q15(&window, 20, PLAIN + 2 * start_effect()) != DQW_OK) board_end("no window\n", 2);
}

void piece_load(const stimulus *s)
{
    last = sample;
    sample = stimulus_sample(s);
}

void piece_step(void) { dqw_window_add_q15(&window, take_effect() ? pair : NULL, window.signals); }

void piece_background(void)
{
    uint16_t weight;
    if (dqw_window_full_q15(&window)) (void)dqw_window_end_q15(&window, block, &weight);
}
