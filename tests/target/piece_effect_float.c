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

#if LIST == 1 || LIST == 2 || LIST == 3
#define SHAPE {6}
#elif LIST == 4 || LIST == 5
#define SHAPE {25, 600, 6}
#elif LIST == 7
#define SHAPE {6}
#elif LIST == 10
#define SHAPE {0.7e-3f, 1.9e-3f, 12e-3f}
#else
#define SHAPE {0.4f, 0.7e-3f, 1.9e-3f}
#endif

static const dqw_effect_config list[] = {{.effect = (enum dqw_effect_name)LIST, .shape = SHAPE}};
static const dqw_effect_base base = {(float)STIMULUS_DT_NS * 1e-9f, 14, 6, 110, STIMULUS_PAIRS, true};
static dqw_effect e;
static dqw_window window;
static dqw_sample sample, last;
static float block[DQW_WINDOW_SIGNALS];
static const float plain[PLAIN];
const uint32_t piece_bytes = sizeof e + sizeof window;

void piece_start(void)
{
    if (dqw_effect_init(&e, list, LIST != 0, &base) != DQW_OK) board_end("no effect\n", 2);
    (void)dqw_effect_gather(&e, NULL, &sample, window.cell + PLAIN);
    (void)dqw_effect_gather(&e, &sample, &sample, window.cell + PLAIN);
    if (dqw_window_init(&window, 20, PLAIN + 2 * e.weights) != DQW_OK) board_end("no window\n", 2);
}

void piece_load(const stimulus *s)
{
    last = sample;
    sample = stimulus_float(s);
}

void piece_step(void)
{
    dqw_effect_heat(&e, sample.i_d_A, sample.i_q_A);
    const bool there = dqw_effect_gather(&e, &last, &sample, window.cell + PLAIN);
    dqw_window_add(&window, there ? plain : NULL, there ? PLAIN : window.signals);
}

void piece_background(void)
{
    if (!dqw_window_full(&window)) return;
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
    *(volatile float *)&block[0] = d[0] + q[0];
}
