// What the inputs of one list of effects cost in the interrupt, in float: what is gathered of each pair, the heat, and the window's signals. LIST
// chooses the effect, by its number in dqw_effect_name.h; 0: none. The background makes the inputs of the block.
#include "dqw_effect.h"
#include "target/board.h"
#include "target/piece.h"
#include "target/stimulus_float.h"

#ifndef LIST
#define LIST 0
#endif
#define PLAIN 11

static dqw_window window;
static dqw_sample sample, last;
static float block[DQW_WINDOW_SIGNALS];
static const float plain[PLAIN];

#if DQW_EFFECT_WEIGHTS > 0
#if LIST == 4 || LIST == 5
#define SHAPE                                                                                                                                                  \
    {                                                                                                                                                          \
        25, 600, 6                                                                                                                                             \
    }
#elif LIST == 10
#define SHAPE                                                                                                                                                  \
    {                                                                                                                                                          \
        0.7e-3f, 1.9e-3f, 12e-3f                                                                                                                               \
    }
#elif LIST == 6 || LIST == 8 || LIST == 9
#define SHAPE                                                                                                                                                  \
    {                                                                                                                                                          \
        0.4f, 0.7e-3f, 1.9e-3f                                                                                                                                 \
    }
#else
#define SHAPE                                                                                                                                                  \
    {                                                                                                                                                          \
        6                                                                                                                                                      \
    }
#endif
static const dqw_effect_config list[] = {{.effect = (enum dqw_effect_name)LIST, .shape = SHAPE}};
static const dqw_effect_base base = {(float)STIMULUS_DT_NS * 1e-9f, 14, 6, 110, STIMULUS_PAIRS, true};
static dqw_effect e;
const uint32_t piece_bytes = sizeof e + sizeof window;

static int start_effect(void)
{
    if (dqw_effect_init(&e, list, LIST != 0, &base) != DQW_OK) board_end("no effect\n", 2);
    // The first sample ends no pair.
    (void)dqw_effect_gather(&e, NULL, &sample, window.cell + PLAIN);
    (void)dqw_effect_gather(&e, &sample, &sample, window.cell + PLAIN);
    return e.weights;
}

static bool take_effect(void)
{
    dqw_effect_heat(&e, sample.i_d_A, sample.i_q_A);
    return dqw_effect_gather(&e, &last, &sample, window.cell + PLAIN);
}

static void end_half(void)
{
    dqw_effect_warm(&e, window.half);
    if (dqw_window_end(&window, block) != DQW_EVENT_LEARNED) return;
    float d[DQW_EFFECT_WEIGHTS];
    float q[DQW_EFFECT_WEIGHTS];
    for (int i = 0; i < e.weights; i++) {
        d[i] = block[PLAIN + 2 * i];
        q[i] = block[PLAIN + 2 * i + 1];
    }
    const dqw_block b = {block[0], block[1], block[2], block[3], block[4], block[5], block[6], block[7], block[8]};
    dqw_effect_inputs(&e, &b, d, q);
    for (int i = 0; i < e.weights; i++) *(volatile float *)&block[i] = d[i] + q[i];
}
#else
const uint32_t piece_bytes = sizeof window;
static int start_effect(void) { return 0; }
static bool take_effect(void) { return true; }
static void end_half(void) { (void)dqw_window_end(&window, block); }
#endif

void piece_start(void)
{
    if (dqw_window_init(&window, 20, PLAIN + 2 * start_effect()) != DQW_OK) board_end("no window\n", 2);
}

void piece_load(const stimulus *s)
{
    last = sample;
    sample = stimulus_float(s);
}

void piece_step(void)
{
    const bool there = take_effect();
    dqw_window_add(&window, there ? plain : NULL, there ? PLAIN : window.signals);
}

void piece_background(void)
{
    if (dqw_window_full(&window)) end_half();
}
