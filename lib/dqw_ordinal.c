#include "dqw_ordinal.h"

#include <math.h>
#include <stddef.h>

#include "dqw_number.h"

#define P0 1e6f
#define POLE_MIN 0.01f
#define POLE_MAX 0.9995f
#define CONVERGED 1e-4f
// Epochs without rest after which a start is given up: from a good one it takes two to five.
#define RESTLESS_MAX 10
// Longest step of the pole in an epoch.
#define STEP_MAX 0.2f
// Step of the constant input's weight.
#define WATCH 0.05f
// A sample of more bases than this is refused.
#define WILD_PU 1e3f

static float clamp(float x, float low, float high)
{
    return x < low ? low : x > high ? high : x;
}

enum dqw_status dqw_ordinal_init(dqw_ordinal *o, const dqw_ordinal_config *config)
{
    if (o == NULL || config == NULL) return DQW_ERR_NULL;
    if (!dqw_is_positive(config->dt_s) || !dqw_is_positive(config->x_base) || !dqw_is_positive(config->y_base) ||
        !dqw_is_positive(config->R_ohm) || !dqw_is_positive(config->L_H))
        return DQW_ERR_RANGE;
    if (!dqw_is_positive(1.0f / config->x_base) || !dqw_is_positive(1.0f / config->y_base)) return DQW_ERR_RANGE;
    const dqw_ordinal zero = {0};
    *o = zero;
    o->dt_s = config->dt_s;
    o->x_scale = 1.0f / config->x_base;
    o->y_scale = 1.0f / config->y_base;
    o->form = config->form;
    o->discretisation = config->discretisation;
    o->a = clamp(expf(-config->R_ohm * config->dt_s / config->L_H), POLE_MIN, POLE_MAX);
    o->b_pu = (1.0f - o->a) / config->R_ohm * o->y_scale / o->x_scale;
    (void)dqw_gain_init(&o->gain, 2, P0);
    o->from_pairs = true;
    return DQW_OK;
}

// [OL.1] learn b and a themselves from measured pairs
static void learn_pair(dqw_ordinal *o, float x_pu, float y_pu)
{
    const float phi[2] = {x_pu, o->y_last_pu};
    float k[2];
    const float e = y_pu - (o->b_pu * phi[0] + o->a * phi[1]);
    dqw_gain_step(&o->gain, phi, k);
    o->b_pu += k[0] * e;
    o->a += k[1] * e;
    o->w_o += WATCH * (e - o->w_o);
}

// [OL.2] with b and a held for the epoch, learn their correction from the neuron's own output and its sensitivities
static void learn_output(dqw_ordinal *o, float x_pu, float y_pu)
{
    const float y_before = o->y_hat_pu;
    o->y_hat_pu = o->a * y_before + o->b_pu * x_pu;
    o->s_pu[0] = o->a * o->s_pu[0] + x_pu;
    o->s_pu[1] = o->a * o->s_pu[1] + y_before;
    float k[2];
    const float e = y_pu - o->y_hat_pu - o->delta_pu[0] * o->s_pu[0] - o->delta_pu[1] * o->s_pu[1];
    dqw_gain_step(&o->gain, o->s_pu, k);
    o->delta_pu[0] += k[0] * e;
    o->delta_pu[1] += k[1] * e;
    o->w_o += WATCH * (e - o->w_o);
}

void dqw_ordinal_step(dqw_ordinal *o, float x_V, float y_A)
{
    const float x_pu = x_V * o->x_scale;
    const float y_pu = y_A * o->y_scale;
    if (!dqw_within(x_pu, WILD_PU) || !dqw_within(y_pu, WILD_PU)) {
        if (o->skipped < UINT32_MAX) o->skipped++;
        o->started = false;
        return;
    }
    if (o->started) {
        // The first epoch learns from pairs in either form: a start for the output error that is near enough to be
        // linear.
        if (o->form == DQW_ORDINAL_PAIRS || o->from_pairs)
            learn_pair(o, o->x_last_pu, y_pu);
        else
            learn_output(o, o->x_last_pu, y_pu);
        if (o->learned < UINT32_MAX) o->learned++;
    } else {
        o->y_hat_pu = y_pu;
        o->s_pu[0] = o->s_pu[1] = 0.0f;
        o->started = true;
    }
    o->x_last_pu = x_pu;
    o->y_last_pu = y_pu;
}

bool dqw_ordinal_end_epoch(dqw_ordinal *o)
{
    if (o->epochs < UINT32_MAX) o->epochs++;
    o->started = false;
    const bool pairs = o->form == DQW_ORDINAL_PAIRS;

    // [OL.3] what the epoch says of both weights
    // A Gauss-Newton step is kept short, and the pole inside a passive circuit's range: the neuron's own output then
    // stays bounded, and far from the truth, where the linearisation overshoots, the next epoch can come back.
    const float a = clamp(o->a + clamp(o->delta_pu[1], -STEP_MAX, STEP_MAX), POLE_MIN, POLE_MAX);
    const float b = o->from_pairs ? o->b_pu : clamp(o->b_pu + o->delta_pu[0], 0.1f * o->b_pu, 10.0f * o->b_pu);
    const bool inside = b > 0.0f && a > POLE_MIN && a < POLE_MAX;
    const bool still = fabsf(a - o->a) <= CONVERGED * o->a && fabsf(b - o->b_pu) <= CONVERGED * fabsf(b);
    o->converged = pairs || (!o->from_pairs && inside && still);
    // [OL.4] from which weights, and how, the next epoch learns
    // Pairs that say what no passive circuit can are no start; nor is one from which no epoch comes to rest. Learn from
    // pairs again.
    const bool done_with_pairs = o->from_pairs && inside;
    o->restless = still || o->from_pairs ? 0 : (uint8_t)(o->restless + 1);
    if (done_with_pairs) o->from_pairs = false;
    // The next epoch counts anew.
    if (o->restless >= RESTLESS_MAX) o->from_pairs = true;
    o->a = a;
    o->b_pu = b;
    o->delta_pu[0] = o->delta_pu[1] = 0.0f;
    if (!pairs) (void)dqw_gain_init(&o->gain, 2, P0);
    return o->converged;
}

float dqw_ordinal_R_from_x(const dqw_ordinal *o, float L_H)
{
    const float a = o->a + o->delta_pu[1];
    const float b = (o->b_pu + o->delta_pu[0]) * o->x_scale / o->y_scale;
    if (!(b > 0.0f)) return dqw_number_nan();
    if (o->discretisation == DQW_ORDINAL_BACKWARD) return 1.0f / b - L_H / o->dt_s;
    return (1.0f - a) / b;
}

float dqw_ordinal_R_from_y(const dqw_ordinal *o, float L_H)
{
    const float a = o->a + o->delta_pu[1];
    if (!(a > 0.0f)) return dqw_number_nan();
    if (o->discretisation == DQW_ORDINAL_BACKWARD) return L_H / o->dt_s * (1.0f / a - 1.0f);
    return -L_H / o->dt_s * logf(a);
}
