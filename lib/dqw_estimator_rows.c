// What a block says: the joint neuron's rows, and the noise on their inputs.
#include <math.h>

#include "dqw_estimator_block.h"

enum { D = DQW_AXIS_D, Q = DQW_AXIS_Q };

dqw_block dqw_estimator_means(const dqw_estimator *e, const dqw_estimator_block *b)
{
    const float *m = b->sum;
    const float rate = 1.0f / e->config->dt_s;
    const dqw_block means = {m[0],        m[1],        0.5f * m[2], 0.5f * m[3], rate * m[4],
                             rate * m[5], 0.5f * m[6], 0.5f * m[7], 0.5f * m[8]};
    return means;
}

// The correction goes with one over L_d, and L_d with the correction: one that is not learned yet must not run away
// with it. No machine's L_d is beyond these parts of its L_q.
static float salient(float L_d_H, float L_q_H)
{
    const float least = 0.25f * L_q_H;
    const float most = 2.0f * L_q_H;
    return L_d_H < least ? least : L_d_H > most ? most : L_d_H;
}

static dqw_block exact(const dqw_estimator *e, const dqw_estimator_block *b)
{
    dqw_block means = dqw_estimator_means(e, b);
    if (e->blocks <= 10 || e->config->settled) return means;
    // While the pole pairs are not known, as their weight has them.
    const float p = e->pole_pairs != 0 ? (float)e->pole_pairs : e->w_pu[DQW_POLES_LQ] / e->w_pu[DQW_LQ];
    const float L_q_H = dqw_estimator_value(e, DQW_LQ);
    const dqw_machine known = {dqw_estimator_value(e, DQW_R), salient(dqw_estimator_value(e, DQW_LD), L_q_H), L_q_H, p};
    if (known.R_ohm > 0.0f && p > 0.0f) dqw_model_bow(&means, &known, e->config->dt_s);
    return means;
}

static float turns_of(const dqw_estimator *e)
{
    return e->pole_pairs != 0 ? (float)e->pole_pairs : 1.0f;
}

static void inputs(const dqw_estimator *e, const dqw_estimator_block *b, const dqw_block *m, float x_d[], float x_q[])
{
    const float p = turns_of(e);
    for (int i = 0; i < DQW_PARAMETERS; i++) x_d[i] = x_q[i] = 0.0f;
    x_d[DQW_R] = m->i_d_A;
    x_q[DQW_R] = m->i_q_A;
    x_d[DQW_LD] = m->di_d_A_s;
    x_q[DQW_LQ] = m->di_q_A_s;
    x_d[dqw_estimator_cross(e, D)] += -p * m->wi_q_A_rad_s;
    x_q[dqw_estimator_cross(e, Q)] += p * m->wi_d_A_rad_s;
    x_q[DQW_PSI] = p * m->w_m_rad_s;
    if (dqw_estimator_has_dead_time(e)) {
        x_d[DQW_DEAD_TIME] = 0.5f * b->sum[DQW_BLOCK_SIGNALS];
        x_q[DQW_DEAD_TIME] = 0.5f * b->sum[DQW_BLOCK_SIGNALS + 1];
        x_d[DQW_DEAD_CONSTANT] = 0.5f * b->sum[DQW_BLOCK_SIGNALS + 2];
        x_q[DQW_DEAD_CONSTANT] = 0.5f * b->sum[DQW_BLOCK_SIGNALS + 3];
    }
    if (dqw_estimator_has_flux_q(e)) x_d[DQW_PSI_Q] = p * m->w_m_rad_s;
#if DQW_EFFECT_WEIGHTS > 0
    for (int i = 0; i < e->effect.weights; i++) {
        x_d[DQW_PARAMETERS + i] = b->sum[DQW_PLAIN_SIGNALS + 2 * i];
        x_q[DQW_PARAMETERS + i] = b->sum[DQW_PLAIN_SIGNALS + 2 * i + 1];
    }
    if (!e->config->settled) dqw_effect_inputs(&e->effect, m, x_d + DQW_PARAMETERS, x_q + DQW_PARAMETERS);
#endif
    const float to_pu = 1.0f / e->config->v_base_V;
    for (int i = 0; i < e->inputs; i++) {
        const float unit = dqw_estimator_unit(e, i) * to_pu;
        x_d[i] *= unit;
        x_q[i] *= unit;
    }
}

static void noise_of_dead_time(const dqw_estimator *e, const dqw_estimator_block *b, int axis, float var_i, float mean,
                               const float s[], dqw_estimator_rows *n)
{
    const float width = e->dead_time_width_A;
    const float g = mean * b->dead_slope_inv_A * s[DQW_DEAD_TIME];
    const float left = var_i / (1.0f + e->given.lead);
    const float sd = sqrtf(left);
    // Where what is left of the current's noise is wide, that of a step; where narrow, tanh's own; and all of it where
    // the currents stay within the width. In the resistance's equation a wide noise also smooths the step, which takes
    // half.
    // 0.53 = 2/3 sqrt(2/pi), and 1.2 widths make tanh of the step, within 3 % from a noise of five widths on. (E60)
    const float wide = 0.53f / (sd + 1.2f * width);
    n->var[axis][DQW_DEAD_TIME] = g * var_i * (b->dead_slope_inv_A > wide ? b->dead_slope_inv_A : wide) *
                                  s[DQW_DEAD_TIME];
    n->R_in_dead[axis] = g * s[DQW_R] * var_i;
    n->dead_in_R[axis] = g * s[DQW_R] * (var_i - 0.5f * left * sd / (sd + width));
}

static void noise_of(const dqw_estimator *e, const dqw_estimator_block *b, const dqw_block *m, dqw_estimator_rows *n)
{
    const dqw_estimator_config *c = e->config;
    const float h = (float)e->window.half;
    const float p = turns_of(e);
    const float sum = h * (h + 1.0f);
    const float mean = (h * (4.0f * h * h - 1.0f) / 6.0f + h * h) / (sum * sum);
    const float slope = 2.0f * h / (c->dt_s * c->dt_s * sum * sum);
    const float var_i[2] = {dqw_noise_variance(b->noise.i_d_A2), dqw_noise_variance(b->noise.i_q_A2)};
    const float i[2] = {m->i_d_A, m->i_q_A};
    const float turn = mean * p * p;
    const float flux = turn * dqw_noise_variance(b->noise.w_rad2_s2);
    float s[DQW_PARAMETERS];
    for (int k = 0; k < DQW_PARAMETERS; k++) s[k] = dqw_estimator_unit(e, k) / c->v_base_V;
    for (int axis = 0; axis < 2; axis++) {
        // cppcheck-suppress uninitvar; every element is set below
        float *var = n->var[axis];
        const int other = 1 - axis;
        const int cross = dqw_estimator_cross(e, axis);
        const bool has_flux = axis == Q || dqw_estimator_has_flux_q(e);
        for (int k = 0; k < DQW_PARAMETERS; k++) var[k] = 0.0f;
        var[DQW_R] = mean * var_i[axis];
        var[DQW_LD + axis] = slope * var_i[axis];
        var[cross] = turn * m->w_m_rad_s * m->w_m_rad_s * var_i[other] + flux * (i[other] * i[other] + var_i[other]);
        if (has_flux) var[dqw_estimator_flux(axis)] = flux;
        for (int k = 0; k < DQW_PARAMETERS; k++) var[k] *= s[k] * s[k];
        n->speed[axis] = has_flux
                             ? (axis == Q ? flux * m->i_d_A : -flux * m->i_q_A) * s[cross] * s[dqw_estimator_flux(axis)]
                             : 0.0f;
        n->dead_in_R[axis] = n->R_in_dead[axis] = 0.0f;
        if (dqw_estimator_has_dead_time(e)) noise_of_dead_time(e, b, axis, var_i[axis], mean, s, n);
    }
}

// A voltage one period late differs from that in time by this much, per unit: the triangle's weight steps by one a
// pair. One that is held in the stationary frame is turned besides; one that is given in the frame of its own period is
// not. (E90)
static void late_of(const dqw_estimator *e, const dqw_estimator_block *b, const dqw_block *m, float late_pu[2])
{
    const float h = (float)e->window.half;
    const float scale = 1.0f / (h * (h + 1.0f));
    const float turn = e->config->voltage_held ? (float)e->pole_pairs * m->w_m_rad_s * e->config->dt_s : 0.0f;
    late_pu[D] = (b->v_step_V[D] * scale - turn * m->v_q_V) / e->config->v_base_V;
    late_pu[Q] = (b->v_step_V[Q] * scale + turn * m->v_d_V) / e->config->v_base_V;
}

void dqw_estimator_rows_of(const dqw_estimator *e, const dqw_estimator_block *b, dqw_estimator_rows *r)
{
    // [ROW.1] means, without what the trapezoid has too much
    const dqw_block m = exact(e, b);

    // [ROW.2] inputs and targets of both axes
    inputs(e, b, &m, r->x[D], r->x[Q]);
    r->y[D] = m.v_d_V / e->config->v_base_V;
    r->y[Q] = m.v_q_V / e->config->v_base_V;
    if (e->config->settled) return;

    // [ROW.3] the noise of the inputs
    noise_of(e, b, &m, r);

    // [ROW.4] by how much a voltage one period late would differ
    late_of(e, b, &m, r->late);
}
