#include "dqw_random.h"

#include <math.h>
#include <stddef.h>

#include "dqw_number.h"

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

enum dqw_status dqw_random_init(dqw_random *r, const dqw_random_config *config)
{
    if (r == NULL || config == NULL || config->reservoir == NULL) return DQW_ERR_NULL;
    if (config->capacity < 2 || config->draws < 1 || config->draws > config->capacity) return DQW_ERR_SIZE;
    if (!dqw_is_positive(config->tolerance)) return DQW_ERR_RANGE;
    const dqw_random zero = {0};
    *r = zero;
    r->reservoir = config->reservoir;
    r->capacity = config->capacity;
    r->draws = config->draws;
    r->state = config->seed != 0 ? config->seed : 1;
    r->tolerance = config->tolerance;
    return DQW_OK;
}

void dqw_random_put(dqw_random *r, const float x[], int inputs, float target)
{
    // What cannot be learned takes no place.
    if (!dqw_is_finite(target)) return;
    for (int i = 0; i < inputs && i < DQW_LEARNER_INPUTS; i++)
        if (!dqw_is_finite(x[i])) return;
    // [RAN.1] a place in the reservoir, with odds that make it a fair sample
    // Past 2^32 - 1 samples the odds stay where they are.
    if (r->seen < UINT32_MAX) r->seen++;
    uint32_t slot = r->held;
    if (r->held < r->capacity)
        r->held++;
    else
        slot = below(&r->state, r->seen);
    if (slot >= r->capacity) return;
    for (int i = 0; i < inputs && i < DQW_LEARNER_INPUTS; i++) r->reservoir[slot].x[i] = x[i];
    r->reservoir[slot].target = target;
}

static bool settled(const dqw_random *r, const dqw_learner *l)
{
    float moved = fabsf(l->w_o - r->before[DQW_LEARNER_INPUTS]);
    float largest = 0.0f;
    for (int i = 0; i < l->inputs; i++) {
        moved = fmaxf(moved, fabsf(l->w_pu[i] - r->before[i]));
        largest = fmaxf(largest, fabsf(l->w_pu[i]));
    }
    return moved <= r->tolerance * largest;
}

bool dqw_random_iterate(dqw_random *r, dqw_learner *l)
{
    if (r->held == 0) return r->converged;
    if (r->at == 0) {
        for (int i = 0; i < l->inputs; i++) r->before[i] = l->w_pu[i];
        r->before[DQW_LEARNER_INPUTS] = l->w_o;
    }

    // [RAN.2] one that was not shown in this epoch: the next place of a Fisher-Yates shuffle
    const uint32_t pick = r->at + below(&r->state, r->held - r->at);
    const dqw_random_sample s = r->reservoir[pick];
    r->reservoir[pick] = r->reservoir[r->at];
    r->reservoir[r->at] = s;
    (void)dqw_learner_learn(l, s.x, s.target);

    // [RAN.3] converged where a whole epoch moved next to nothing
    r->at++;
    if (r->at >= r->draws || r->at >= r->held) {
        if (r->at >= r->draws && settled(r, l)) r->converged = true;
        r->at = 0;
        if (r->epochs < UINT32_MAX) r->epochs++;
    }
    return r->converged;
}

bool dqw_random_epoch(dqw_random *r, dqw_learner *l)
{
    if (r->held == 0) return r->converged;
    do (void)dqw_random_iterate(r, l);
    while (r->at != 0);
    return r->converged;
}
