#include "dqw_learner.h"

#include <math.h>
#include <stddef.h>

#include "dqw_number.h"

// Keeps the step finite when every input is zero: far below any per-unit signal squared that carries information.
#define NORM_FLOOR 1e-6f
// A larger error is learned as this: one wild sample then moves a weight by a bounded step, and no weight can overflow.
#define ERROR_LIMIT_PU 1e3f

static float limit(float x, float bound)
{
    return x > bound ? bound : x < -bound ? -bound : x;
}

enum dqw_status dqw_learner_init(dqw_learner *l, const dqw_learner_config *config)
{
    if (l == NULL || config == NULL) return DQW_ERR_NULL;
    if (config->inputs < 1 || config->inputs > DQW_LEARNER_INPUTS) return DQW_ERR_SIZE;
    if (!dqw_is_positive(config->step_size) || config->step_size >= 2.0f || !dqw_is_positive(config->y_base))
        return DQW_ERR_RANGE;
    for (int i = 0; i < config->inputs; i++)
        if (!dqw_is_positive(config->x_base[i]) || !dqw_is_positive(1.0f / config->x_base[i]) ||
            !dqw_is_positive(config->y_base * (1.0f / config->x_base[i])))
            return DQW_ERR_RANGE;

    const dqw_learner zero = {0};
    *l = zero;
    l->inputs = (uint8_t)config->inputs;
    l->step_size = config->step_size;
    l->y_base = config->y_base;
    l->noisy_inputs = config->noisy_inputs;
    l->indicator = config->indicator;
    for (int i = 0; i < config->inputs; i++) l->x_scale[i] = 1.0f / config->x_base[i];
    return DQW_OK;
}

float dqw_learner_forward(const dqw_learner *l, const float x[])
{
    float y_pu = 0.0f;
    for (int i = 0; i < l->inputs; i++) y_pu += l->w_pu[i] * (x[i] * l->x_scale[i]);
    return y_pu * l->y_base;
}

float dqw_learner_learn(dqw_learner *l, const float x[], float target)
{
    // [LMS.1] how large inputs and weights are
    float x_pu[DQW_LEARNER_INPUTS];
    float norm = l->indicator ? 1.0f : 0.0f;
    float w_norm = 0.0f;
    for (int i = 0; i < l->inputs; i++) {
        x_pu[i] = x[i] * l->x_scale[i];
        norm += x_pu[i] * x_pu[i];
        w_norm += l->w_pu[i] * l->w_pu[i];
    }

    // [LMS.2] error before the correction
    const float e_pu = (target - dqw_learner_forward(l, x)) / l->y_base;
    if (!dqw_is_finite(e_pu) || !dqw_is_finite(norm)) {
        if (l->skipped < UINT32_MAX) l->skipped++;
        return 0.0f;
    }

    // [LMS.3] normalised step, the constant input counted in the norm; with noisy inputs down the gradient of
    // e^2 / (1 + |w|^2), normalised by the inputs' expected power: their own would weigh the noise in, and bias. A
    // sample so large that the step would more than mirror the error is normalised by itself after all
    if (l->noisy_inputs) {
        const float expected = (float)l->inputs + (l->indicator ? 1.0f : 0.0f);
        norm = fmaxf(expected, 0.5f * l->step_size * norm);
    }
    const float g = l->step_size * limit(e_pu, ERROR_LIMIT_PU) / (norm + NORM_FLOOR);
    const float pull = l->noisy_inputs ? limit(e_pu, 1.0f) / (1.0f + w_norm) : 0.0f;
    for (int i = 0; i < l->inputs; i++) l->w_pu[i] += g * (x_pu[i] + pull * l->w_pu[i]);
    if (l->indicator) l->w_o += l->step_size * (limit(e_pu, ERROR_LIMIT_PU) - l->w_o) / (norm + NORM_FLOOR);
    if (l->learned < UINT32_MAX) l->learned++;
    return e_pu * l->y_base;
}

float dqw_learner_weight(const dqw_learner *l, int i)
{
    if (i < 0 || i >= l->inputs) return dqw_number_nan();
    return l->w_pu[i] * l->y_base * l->x_scale[i];
}

enum dqw_status dqw_learner_set_weight(dqw_learner *l, int i, float weight)
{
    if (l == NULL) return DQW_ERR_NULL;
    if (i < 0 || i >= l->inputs) return DQW_ERR_SIZE;
    const float w_pu = weight / (l->y_base * l->x_scale[i]);
    if (!dqw_is_finite(w_pu)) return DQW_ERR_RANGE;
    l->w_pu[i] = w_pu;
    return DQW_OK;
}
