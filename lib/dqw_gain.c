#include "dqw_gain.h"

#include <stddef.h>

#include "dqw_number.h"

enum dqw_status dqw_gain_init(dqw_gain *g, int inputs, float p0)
{
    if (g == NULL) return DQW_ERR_NULL;
    if (inputs < 1 || inputs > DQW_LEARNER_INPUTS) return DQW_ERR_SIZE;
    if (!dqw_is_positive(p0)) return DQW_ERR_RANGE;
    const dqw_gain zero = {0};
    *g = zero;
    g->inputs = (uint8_t)inputs;
    for (int i = 0; i < inputs; i++) g->d[i] = p0;
    return DQW_OK;
}

void dqw_gain_step(dqw_gain *g, const float x_pu[], float k_pu[])
{
    const int n = g->inputs;
    float f[DQW_LEARNER_INPUTS];
    float v[DQW_LEARNER_INPUTS];

    // [RLS.1] f = U' x, v = D f
    for (int j = 0; j < n; j++) {
        const float *u = &g->u[DQW_GAIN_U(0, j)];
        f[j] = x_pu[j];
        for (int i = 0; i < j; i++) f[j] += u[i] * x_pu[i];
        v[j] = g->d[j] * f[j];
    }

    // [RLS.2] column by column: shrink D, turn U, build the gain; alpha > 0 always, so D stays positive
    float alpha = 1.0f;
    for (int j = 0; j < n; j++) {
        const float before = alpha;
        alpha += v[j] * f[j];
        const float lambda = -f[j] / before;
        g->d[j] *= before / alpha;
        k_pu[j] = v[j];
        float *column = &g->u[DQW_GAIN_U(0, j)];
        for (int i = 0; i < j; i++) {
            const float u = column[i];
            column[i] = u + lambda * k_pu[i];
            k_pu[i] += u * v[j];
        }
    }

    // [RLS.3] divide once
    for (int j = 0; j < n; j++) k_pu[j] /= alpha;
}

void dqw_gain_forget(dqw_gain *g)
{
    for (int j = 0; j < g->inputs; j++) g->d[j] *= 4.0f;
}

float dqw_gain_covariance(const dqw_gain *g, int i, int j)
{
    float p = 0.0f;
    for (int m = i > j ? i : j; m < g->inputs; m++) {
        const float ui = m == i ? 1.0f : g->u[DQW_GAIN_U(i, m)];
        const float uj = m == j ? 1.0f : g->u[DQW_GAIN_U(j, m)];
        p += ui * g->d[m] * uj;
    }
    return p;
}

void dqw_gain_apply(const dqw_gain *g, const float z[], float out[])
{
    for (int j = 0; j < g->inputs; j++) {
        const float *u = &g->u[DQW_GAIN_U(0, j)];
        float f = z[j];
        for (int i = 0; i < j; i++) f += u[i] * z[i];
        f *= g->d[j];
        out[j] = f;
        for (int i = 0; i < j; i++) out[i] += u[i] * f;
    }
}

void dqw_gain_grow_along(dqw_gain *g, float a[], int n, float q)
{
    // U D U' + q a a': columns beyond a's last element keep.
    for (int j = n - 1; j >= 0 && q > 0.0f; j--) {
        float *u = &g->u[DQW_GAIN_U(0, j)];
        const float s = a[j];
        const float before = g->d[j];
        const float after = before + q * s * s;
        if (!(after > 0.0f)) continue;
        const float turn = q * s / after;
        g->d[j] = after;
        q *= before / after;
        for (int m = 0; m < j; m++) {
            a[m] -= s * u[m];
            u[m] += turn * a[m];
        }
    }
}

void dqw_gain_grow(dqw_gain *g, int i, float q)
{
    float a[DQW_LEARNER_INPUTS] = {0};
    a[i] = 1.0f;
    dqw_gain_grow_along(g, a, i + 1, q);
}
