// Pole pairs from the motion: while they are not known, the flux of the other axis' current has a weight of its own, p
// times its inductance.
#include <math.h>

#include "dqw_estimator_block.h"
#include "dqw_number.h"

// Blocks, and deviations to every other integer, that an integer needs; and how near it must be.
#define LEAST_BLOCKS 100
#define EVIDENCE_SD 6.0f
#define EVIDENCE_DISTANCE 0.25f
#define POLE_PAIRS_MAX 100.0f
// Both axes' ratios may be so many deviations apart.
#define AGREEMENT_SD 3.0f
// What makes a constraint of a row: its variance over that of what it says.
#define CONSTRAINT 1e6f

static bool ratio_of(const dqw_estimator *e, int top, int bottom, float *ratio, float *variance)
{
    const float t = dqw_estimator_noise_sd(e, top);
    const float b = dqw_estimator_noise_sd(e, bottom);
    if (!(t < DQW_UNKNOWN) || !(b < DQW_UNKNOWN) || e->w_pu[bottom] == 0.0f) return false;
    const float r = e->w_pu[top] / e->w_pu[bottom];
    const float pp = dqw_gain_covariance(&e->gain, top, top);
    const float pb = dqw_gain_covariance(&e->gain, top, bottom);
    const float bb = dqw_gain_covariance(&e->gain, bottom, bottom);
    // Deviations over the covariance's own: the residual's variance, widened by autocorrelation.
    const float unit = dqw_estimator_unit(e, bottom);
    const float wide = b * b / (bb * unit * unit);
    *ratio = r;
    *variance = (pp - 2.0f * r * pb + r * r * bb) * wide / (e->w_pu[bottom] * e->w_pu[bottom]);
    return r > 0.0f && *variance > 0.0f && dqw_is_finite(*variance);
}

void dqw_poles_evidence(const dqw_estimator *e, float *p, float *sd)
{
    static const int top[2] = {DQW_POLES_LQ, DQW_POLES_LD};
    static const int bottom[2] = {DQW_LQ, DQW_LD};
    float ratio[2] = {0.0f, 0.0f};
    float information[2] = {0.0f, 0.0f};
    for (int axis = 0; axis < 2; axis++) {
        float variance;
        // An encoder that is off shows flux on d, which has no weight there yet: L_q's cross weight would take it up.
        if (axis == 0 && e->config->encoder_offset) continue;
        if (ratio_of(e, top[axis], bottom[axis], &ratio[axis], &variance)) information[axis] = 1.0f / variance;
    }
    const float both = information[0] + information[1];
    bool known = both > 0.0f && dqw_is_finite(both);
    if (information[0] > 0.0f && information[1] > 0.0f) {
        // Rows that do not hold what the model lacks tell the same on both axes.
        const float apart = ratio[0] - ratio[1];
        const float sure = 1.0f / information[0] + 1.0f / information[1];
        known = known &&
                (fabsf(apart) < 2.0f * EVIDENCE_DISTANCE || apart * apart < AGREEMENT_SD * AGREEMENT_SD * sure);
    }
    *p = known ? (ratio[0] * information[0] + ratio[1] * information[1]) / both : 0.0f;
    *sd = known ? sqrtf(1.0f / both) : DQW_UNKNOWN;
}

// top - p bottom = 0, as a row that leaves no doubt.
static void constrain(dqw_estimator *e, int top, int bottom, float p)
{
    float x[DQW_ESTIMATOR_INPUTS] = {0};
    float k[DQW_ESTIMATOR_INPUTS];
    const float own = dqw_gain_covariance(&e->gain, top, top) + p * p * dqw_gain_covariance(&e->gain, bottom, bottom);
    const float size = sqrtf(CONSTRAINT / own);
    x[top] = size;
    x[bottom] = -size * p;
    const float error = -(x[top] * e->w_pu[top] + x[bottom] * e->w_pu[bottom]);
    dqw_gain_step(&e->gain, x, k);
    for (int i = 0; i < e->inputs; i++) e->w_pu[i] += k[i] * error;
}

static void rescale(dqw_gain *g, int i, float p)
{
    for (int m = 0; m < i; m++) g->u[DQW_GAIN_U(m, i)] /= p;
    for (int j = i + 1; j < g->inputs; j++) g->u[DQW_GAIN_U(i, j)] *= p;
    g->d[i] *= p * p;
}

// A weight leaves, another takes its place: what was known of the others keeps. Only for the last, or where those
// behind it are new.
static void replace(dqw_estimator *e, int i)
{
    dqw_gain *g = &e->gain;
    float a[DQW_ESTIMATOR_INPUTS];
    for (int m = 0; m < i; m++) {
        a[m] = g->u[DQW_GAIN_U(m, i)];
        g->u[DQW_GAIN_U(m, i)] = 0.0f;
    }
    dqw_gain_grow_along(g, a, i, g->d[i]);
    const float sd = dqw_estimator_start_sd_pu(e, i) * (1.0f / DQW_ESTIMATOR_START_RESIDUAL_PU);
    g->d[i] = sd * sd;
    e->w_pu[i] = 0.0f;
    e->excess_q10[i] = 0;
    e->learned &= ~(1u << i);
}

void dqw_poles_find(dqw_estimator *e)
{
    float p;
    float sd;
    dqw_poles_evidence(e, &p, &sd);
    if (e->blocks < LEAST_BLOCKS || !(p < POLE_PAIRS_MAX)) return;
    const float nearest = floorf(p + 0.5f);
    const float off = fabsf(p - nearest);
    if (nearest < 1.0f || !(off < EVIDENCE_DISTANCE) || !(EVIDENCE_SD * sd < 1.0f - off)) return;

    // [POL.1] both cross weights are p inductances
    constrain(e, DQW_POLES_LD, DQW_LD, nearest);
    constrain(e, DQW_POLES_LQ, DQW_LQ, nearest);

    // [POL.2] units of the joint neuron; dead time and the other flux in the place of the cross weights
    rescale(&e->gain, DQW_LD, nearest);
    rescale(&e->gain, DQW_LQ, nearest);
    e->w_pu[DQW_LD] *= nearest;
    e->w_pu[DQW_LQ] *= nearest;
    e->pole_pairs = (uint16_t)nearest;
    replace(e, DQW_PSI_Q);
    replace(e, DQW_DEAD_TIME);

    // [POL.3] what had no weight until now is in all that was learned: a start, and no more
    if (!(e->dead_time_width_A > 0.0f) && !e->config->encoder_offset) return;
    float start[DQW_ESTIMATOR_INPUTS];
    for (int i = 0; i < e->inputs; i++) start[i] = e->w_pu[i];
    dqw_estimator_start(e, start);
}
