#include "dqw_axis.h"

#include <math.h>
#include <stddef.h>

// A weight whose variance fell by less than this was not learned: what it holds is its start value.
#define LEARNED_RATIO 0.01f
// Single precision cannot tell a smaller residual from rounding.
#define VARIANCE_FLOOR_PU2 1e-13f
#define RECENT 50.0f
// Beyond this, likeness of neighbours says that the model is wrong, not that the data are few.
#define LAG_MAX 0.98f
// A block beyond this many bases is refused: least squares would weigh it as this squared others, and never forget it.
#define BLOCK_MAX_PU 1e5f

enum dqw_status dqw_axis_init(dqw_axis *a, const dqw_learner_config *config)
{
    if (a == NULL) return DQW_ERR_NULL;
    dqw_learner neuron;
    const enum dqw_status status = dqw_learner_init(&neuron, config);
    if (status != DQW_OK) return status;
    const dqw_axis zero = {0};
    *a = zero;
    a->neuron = neuron;
    return dqw_gain_init(&a->gain, config->inputs, DQW_AXIS_P0);
}

float dqw_axis_learn(dqw_axis *a, const float x[], float target, uint32_t excited)
{
    dqw_learner *l = &a->neuron;
    float x_pu[DQW_LEARNER_INPUTS] = {0};
    float k_pu[DQW_LEARNER_INPUTS] = {0};
    float size = 0.0f;
    for (int i = 0; i < l->inputs; i++) {
        x_pu[i] = (excited >> i & 1u) ? x[i] * l->x_scale[i] : 0.0f;
        size += fabsf(x[i] * l->x_scale[i]);
    }
    // [AXIS.1] the shared error
    const float e_pu = (target - dqw_learner_forward(l, x)) / l->y_base;
    if (!(size < BLOCK_MAX_PU) || !(fabsf(e_pu) < BLOCK_MAX_PU)) {
        if (l->skipped < UINT32_MAX) l->skipped++;
        return 0.0f;
    }

    // [AXIS.2] correct the weights by all that was learned
    dqw_gain_step(&a->gain, x_pu, k_pu);
    float seen = 0.0f;
    for (int i = 0; i < l->inputs; i++) {
        l->w_pu[i] += k_pu[i] * e_pu;
        seen += k_pu[i] * x_pu[i];
    }
    if (l->learned < UINT32_MAX) l->learned++;

    // [AXIS.3] residual statistics
    // the sum of e^2 (1 - k x) is that of the final weights' residuals
    const float after = e_pu * (1.0f - seen);
    const float t_pu = target / l->y_base;
    if (a->blocks < UINT32_MAX) a->blocks++;
    const float n = (float)(a->blocks < DQW_AXIS_MEMORY ? a->blocks : DQW_AXIS_MEMORY);
    const float recent = n < RECENT ? n : RECENT;
    a->error_pu2 += (e_pu * after - a->error_pu2) / n;
    a->lag_pu2 += (after * a->error_last_pu - a->lag_pu2) / n;
    a->target_pu2 += (t_pu * t_pu - a->target_pu2) / n;
    a->recent_pu2 += (after * after - a->recent_pu2) / recent;
    a->error_last_pu = after;
    return e_pu * l->y_base;
}

float dqw_axis_variance_pu2(const dqw_axis *a)
{
    const float n = (float)a->blocks;
    const float freedom = n - (float)a->neuron.inputs;
    if (freedom < 1.0f) return 1.0f;
    const float v = a->error_pu2 * (n / freedom);
    return v > VARIANCE_FLOOR_PU2 ? v : VARIANCE_FLOOR_PU2;
}

float dqw_axis_inflation(const dqw_axis *a)
{
    if (!(a->error_pu2 > VARIANCE_FLOOR_PU2)) return 1.0f;
    float r = a->lag_pu2 / a->error_pu2;
    r = r < 0.0f ? 0.0f : r > LAG_MAX ? LAG_MAX : r;
    return (1.0f + r) / (1.0f - r);
}

float dqw_axis_weight_sd(const dqw_axis *a, int i)
{
    if (i < 0 || i >= a->neuron.inputs) return NAN;
    const float p = dqw_gain_covariance(&a->gain, i, i);
    if (!(p < LEARNED_RATIO * DQW_AXIS_P0)) return INFINITY;
    const float sd_pu = sqrtf(p * dqw_axis_variance_pu2(a) * dqw_axis_inflation(a));
    return sd_pu * a->neuron.y_base * a->neuron.x_scale[i];
}

static float relative(float error_pu2, float target_pu2)
{
    return target_pu2 > 0.0f ? sqrtf(error_pu2 / target_pu2) : 0.0f;
}

float dqw_axis_relative_residual(const dqw_axis *a)
{
    return relative(a->error_pu2, a->target_pu2);
}

float dqw_axis_relative_residual_recent(const dqw_axis *a)
{
    return relative(a->recent_pu2, a->target_pu2);
}
