#include "dqw_random_q15.h"

#include <stddef.h>

static uint32_t next(uint32_t *state)
{
    uint32_t s = *state;
    s ^= s << 13;
    s ^= s >> 17;
    s ^= s << 5;
    *state = s;
    return s;
}

// Uniform in 0 .. n-1: the high half of a 32 x 32 product, biased by less than n / 2^32.
static uint32_t below(uint32_t *state, uint32_t n)
{
    return (uint32_t)(((uint64_t)next(state) * n) >> 32);
}

enum dqw_status dqw_random_init_q15(dqw_random_q15 *r, const dqw_random_config_q15 *config)
{
    if (r == NULL || config == NULL || config->reservoir == NULL) return DQW_ERR_NULL;
    if (config->capacity < 2 || config->draws < 1 || config->draws > config->capacity) return DQW_ERR_SIZE;
    if (config->tolerance_q15 == 0) return DQW_ERR_RANGE;
    const dqw_random_q15 zero = {0};
    *r = zero;
    r->reservoir = config->reservoir;
    r->capacity = config->capacity;
    r->draws = config->draws;
    r->state = config->seed != 0 ? config->seed : 1;
    r->tolerance_q15 = config->tolerance_q15;
    return DQW_OK;
}

void dqw_random_put_q15(dqw_random_q15 *r, const int16_t x_q15[], int inputs, int16_t target_q15)
{
    // [RAN.1] a place in the reservoir, with odds that make it a fair sample
    // Past 2^32 - 1 samples the odds stay where they are.
    if (r->seen < UINT32_MAX) r->seen++;
    uint32_t slot = r->held;
    if (r->held < r->capacity)
        r->held++;
    else
        slot = below(&r->state, r->seen);
    if (slot >= r->capacity) return;
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
    if (r->held == 0) return r->converged;
    if (r->at == 0) {
        for (int i = 0; i < l->inputs; i++) r->before_q31[i] = l->w_q31[i];
        r->before_q31[DQW_LEARNER_INPUTS_Q15] = l->w_o_q31;
    }

    // [RAN.2] one that was not shown in this epoch: the next place of a Fisher-Yates shuffle
    const uint32_t pick = r->at + below(&r->state, r->held - r->at);
    const dqw_random_sample_q15 s = r->reservoir[pick];
    r->reservoir[pick] = r->reservoir[r->at];
    r->reservoir[r->at] = s;
    (void)dqw_learner_learn_q15(l, s.x_q15, s.target_q15);

    // [RAN.3] converged where a whole epoch moved next to nothing
    r->at++;
    if (r->at >= r->draws || r->at >= r->held) {
        if (r->at >= r->draws && settled(r, l)) r->converged = true;
        r->at = 0;
        if (r->epochs < UINT32_MAX) r->epochs++;
    }
    return r->converged;
}

bool dqw_random_epoch_q15(dqw_random_q15 *r, dqw_learner_q15 *l)
{
    if (r->held == 0) return r->converged;
    do (void)dqw_random_iterate_q15(r, l);
    while (r->at != 0);
    return r->converged;
}
