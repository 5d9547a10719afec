#include "dqw_random_q15.h"

#include <stddef.h>

enum dqw_status dqw_random_init_q15(dqw_random_q15 *r, const dqw_random_config_q15 *config)
{
    if (r == NULL || config == NULL || config->reservoir == NULL) return DQW_ERR_NULL;
    dqw_random_q15 n = {.reservoir = config->reservoir, .tolerance_q15 = config->tolerance_q15};
    if (!dqw_draw_init(&n.draw, config->capacity, config->draws, config->seed)) return DQW_ERR_SIZE;
    if (config->tolerance_q15 == 0) return DQW_ERR_RANGE;
    *r = n;
    return DQW_OK;
}

void dqw_random_put_q15(dqw_random_q15 *r, const int16_t x_q15[], int inputs, int16_t target_q15)
{
    // [RAN.1] a place in the reservoir, with odds that make it a fair sample
    const uint32_t slot = dqw_draw_place(&r->draw);
    if (slot >= r->draw.capacity) return;
    for (int i = 0; i < inputs && i < DQW_LEARNER_INPUTS_Q15; i++) r->reservoir[slot].x_q15[i] = x_q15[i];
    r->reservoir[slot].target_q15 = target_q15;
}

static bool settled(const dqw_random_q15 *r, const dqw_learner_q15 *l)
{
    int64_t moved_q31 = dqw_q_size64((int64_t)l->w_o_q31 - r->before_q31[DQW_LEARNER_INPUTS_Q15]);
    int64_t largest_q31 = 0;
    for (int i = 0; i < l->inputs; i++) {
        const int64_t change_q31 = dqw_q_size64((int64_t)l->w_q31[i] - r->before_q31[i]);
        const int64_t weight_q31 = dqw_q_size64(l->w_q31[i]);
        if (change_q31 > moved_q31) moved_q31 = change_q31;
        if (weight_q31 > largest_q31) largest_q31 = weight_q31;
    }
    return moved_q31 * (1 << 15) <= largest_q31 * r->tolerance_q15;  // each < 2^48
}

bool dqw_random_iterate_q15(dqw_random_q15 *r, dqw_learner_q15 *l)
{
    if (r->draw.held == 0) return r->converged;
    if (r->draw.at == 0) {
        for (int i = 0; i < l->inputs; i++) r->before_q31[i] = l->w_q31[i];
        r->before_q31[DQW_LEARNER_INPUTS_Q15] = l->w_o_q31;
    }

    // [RAN.2] one that was not shown in this epoch: the next place of a Fisher-Yates shuffle
    const uint32_t pick = dqw_draw_next(&r->draw);
    const dqw_random_sample_q15 s = r->reservoir[pick];
    r->reservoir[pick] = r->reservoir[r->draw.at];
    r->reservoir[r->draw.at] = s;
    (void)dqw_learner_learn_q15(l, s.x_q15, s.target_q15);

    // [RAN.3] converged where a whole epoch moved next to nothing
    if (dqw_draw_shown(&r->draw) && settled(r, l)) r->converged = true;
    return r->converged;
}

bool dqw_random_epoch_q15(dqw_random_q15 *r, dqw_learner_q15 *l)
{
    do (void)dqw_random_iterate_q15(r, l);
    while (r->draw.at != 0);
    return r->converged;
}
