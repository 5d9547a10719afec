#include "dqw_random.h"

#include <math.h>
#include <stddef.h>

#include "dqw_number.h"

enum dqw_status dqw_random_init(dqw_random *r, const dqw_random_config *config)
{
    if (r == NULL || config == NULL || config->reservoir == NULL) return DQW_ERR_NULL;
    dqw_random n = {.reservoir = config->reservoir, .tolerance = config->tolerance};
    if (!dqw_draw_init(&n.draw, config->capacity, config->draws, config->seed)) return DQW_ERR_SIZE;
    if (!dqw_is_positive(config->tolerance)) return DQW_ERR_RANGE;
    *r = n;
    return DQW_OK;
}

void dqw_random_put(dqw_random *r, const float x[], int inputs, float target)
{
    // What cannot be learned takes no place.
    if (!dqw_is_finite(target)) return;
    for (int i = 0; i < inputs && i < DQW_LEARNER_INPUTS; i++)
        if (!dqw_is_finite(x[i])) return;
    // [RAN.1] a place in the reservoir, with odds that make it a fair sample
    const uint32_t slot = dqw_draw_place(&r->draw);
    if (slot >= r->draw.capacity) return;
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
    if (r->draw.held == 0) return r->converged;
    if (r->draw.at == 0) {
        for (int i = 0; i < l->inputs; i++) r->before[i] = l->w_pu[i];
        r->before[DQW_LEARNER_INPUTS] = l->w_o;
    }

    // [RAN.2] one that was not shown in this epoch: the next place of a Fisher-Yates shuffle
    const uint32_t pick = dqw_draw_next(&r->draw);
    const dqw_random_sample s = r->reservoir[pick];
    r->reservoir[pick] = r->reservoir[r->draw.at];
    r->reservoir[r->draw.at] = s;
    (void)dqw_learner_learn(l, s.x, s.target);

    // [RAN.3] converged where a whole epoch moved next to nothing
    if (dqw_draw_shown(&r->draw) && settled(r, l)) r->converged = true;
    return r->converged;
}

bool dqw_random_epoch(dqw_random *r, dqw_learner *l)
{
    do (void)dqw_random_iterate(r, l);
    while (r->draw.at != 0);
    return r->converged;
}
