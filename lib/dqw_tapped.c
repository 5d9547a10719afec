#include "dqw_tapped.h"

#include <stddef.h>

#include "dqw_number.h"

enum dqw_status dqw_tapped_init(dqw_tapped *t, const dqw_tapped_config *config)
{
    if (t == NULL || config == NULL) return DQW_ERR_NULL;
    if (config->taps < 2 || config->taps > DQW_TAPS) return DQW_ERR_SIZE;
    const dqw_tapped zero = {0};
    dqw_tapped n = zero;
    n.taps = (uint8_t)config->taps;
    n.step_size = config->step_size;
    n.draws = config->draws;
    for (int i = 0; i < config->taps; i++) {
        dqw_learner_config learner = {.inputs = 1,
                                      .step_size = config->step_size,
                                      .y_base = config->y_base[i],
                                      .noisy_inputs = true,
                                      .indicator = true};
        learner.x_base[0] = config->x_base[i];
        const dqw_random_config random = {.reservoir = config->reservoir[i],
                                          .capacity = config->capacity,
                                          .draws = config->draws,
                                          .seed = config->seed + (uint32_t)i,
                                          .tolerance = config->tolerance};
        enum dqw_status status = dqw_learner_init(&n.learner[i], &learner);
        if (status == DQW_OK) status = dqw_random_init(&n.random[i], &random);
        if (status != DQW_OK) return status;
    }
    *t = n;
    return DQW_OK;
}

void dqw_tapped_put(dqw_tapped *t, const float x[], const float y_A_s[])
{
    for (int i = 0; i < t->taps; i++) dqw_random_put(&t->random[i], &x[i], 1, y_A_s[i]);
}

bool dqw_tapped_iterate(dqw_tapped *t)
{
    // The first epoch forgets the start; then a step that falls as 2 / n averages the noise of all that is shown: half
    // of the norm is the constant input's, so 2 / n moves the weight by 1 / n of the error.
    const float after = t->iterations < t->draws ? 0.0f : (float)(t->iterations - t->draws);
    const float step = t->step_size / (1.0f + 0.5f * t->step_size * after);
    if (t->iterations < UINT32_MAX) t->iterations++;
    bool converged = true;
    for (int i = 0; i < t->taps; i++) {
        t->learner[i].step_size = step;
        if (!dqw_random_iterate(&t->random[i], &t->learner[i])) converged = false;
    }
    return converged;
}

float dqw_tapped_L_H(const dqw_tapped *t)
{
    return 1.0f / dqw_learner_weight(&t->learner[DQW_TAP_V], 0);
}

float dqw_tapped_pole_pairs(const dqw_tapped *t)
{
    return dqw_learner_weight(&t->learner[DQW_TAP_CROSS], 0);
}

float dqw_tapped_flux_weight(const dqw_tapped *t)
{
    return t->taps > DQW_TAP_FLUX ? dqw_learner_weight(&t->learner[DQW_TAP_FLUX], 0) : dqw_number_nan();
}
