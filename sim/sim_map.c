#include "sim_map.h"

#include <math.h>

#include "sim_spline.h"

// out: co-energy, psi_d, psi_q, L_dd, L_dq, L_qq.
static void evaluate(const dqw_sim_map *map, double i_d_A, double i_q_A, double out[6])
{
    double bd[3][5], bq[3][5];
    const int jd = dqw_sim_spline(&map->d, i_d_A, bd), jq = dqw_sim_spline(&map->q, i_q_A, bq);
    for (int k = 0; k < 6; ++k) out[k] = 0;
    for (int j = 0; j < 5; ++j) {
        const double *c = &map->coef[jd + j][jq];
        double r0 = 0, r1 = 0, r2 = 0;
        for (int k = 0; k < 5; ++k) r0 += c[k] * bq[0][k], r1 += c[k] * bq[1][k], r2 += c[k] * bq[2][k];
        out[0] += bd[0][j] * r0, out[1] += bd[1][j] * r0, out[2] += bd[0][j] * r1;
        out[3] += bd[2][j] * r0, out[4] += bd[1][j] * r1, out[5] += bd[0][j] * r2;
    }
}

void dqw_sim_map_flux(const dqw_sim_map *map, double i_d_A, double i_q_A, double *psi_d_Wb, double *psi_q_Wb,
                      double L[3])
{
    double v[6];
    evaluate(map, i_d_A, i_q_A, v);
    *psi_d_Wb = v[1], *psi_q_Wb = v[2];
    L[0] = v[3], L[1] = v[4], L[2] = v[5];
}

double dqw_sim_map_coenergy(const dqw_sim_map *map, double i_d_A, double i_q_A)
{
    double at[6], origin[6];
    evaluate(map, i_d_A, i_q_A, at);
    evaluate(map, 0, 0, origin);
    return at[0] - origin[0];
}

static double within(double x, const dqw_sim_map_axis *axis)
{
    return fmin(fmax(x, axis->reach_low_A), axis->reach_high_A);
}

bool dqw_sim_map_invert(dqw_sim_map *map, double psi_d_Wb, double psi_q_Wb, double *i_d_A, double *i_q_A)
{
    double i_d = map->last_d_A, i_q = map->last_q_A;
    const double small = 1e-8 * (map->d.step_A * map->d.cells + map->q.step_A * map->q.cells);
    for (int turn = 0; turn < 40; ++turn) {
        double v[6];
        evaluate(map, i_d, i_q, v);
        const double fd = psi_d_Wb - v[1], fq = psi_q_Wb - v[2], det = v[3] * v[5] - v[4] * v[4];
        if (!(det > 0)) return false;
        const double step_d = (v[5] * fd - v[4] * fq) / det, step_q = (v[3] * fq - v[4] * fd) / det;
        const double next_d = within(i_d + step_d, &map->d), next_q = within(i_q + step_q, &map->q);
        // Newton squares the error: a step of 1e-8 of the range leaves 1e-16. Outside the reach it never gets this
        // small.
        if (fabs(step_d) < small && fabs(step_q) < small) {
            *i_d_A = map->last_d_A = next_d, *i_q_A = map->last_q_A = next_q;
            return true;
        }
        i_d = next_d, i_q = next_q;
    }
    return false;
}
