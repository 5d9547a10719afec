#include "sim_filter.h"

#include <math.h>

static void stationary(const dqw_sim_plant *p, const dqw_sim_point *o, double i_A[2])
{
    i_A[0] = p->cos_frame * o->i_x_A - p->sin_frame * o->i_y_A;
    i_A[1] = p->sin_frame * o->i_x_A + p->cos_frame * o->i_y_A;
}

// What u^n / n!, u from 0 to 1 over the step, leaves behind the filter: the sum over k of -(-x)^k / (n + k)!, and above
// half a time constant g_n = 1/n! - g_(n-1) / x, which cancels below.
static double lag(double x, int n)
{
    if (x > 0.5) {
        const double g1 = 1 + expm1(-x) / x;
        return n == 1 ? g1 : 0.5 - g1 / x;
    }
    double term = n == 1 ? 0.5 * x : x / 6, sum = 0;
    for (int k = 2; k < 14; ++k) sum += term, term *= -x / (n + k);
    return sum;
}

bool dqw_sim_filter_begin(dqw_sim_filter *f, const dqw_sim_plant *p, double t_s, const double *y)
{
    dqw_sim_point o;
    if (!dqw_sim_plant_point(p, t_s, y, &o)) return false;
    stationary(p, &o, f->before_A);
    return true;
}

bool dqw_sim_filter_step(dqw_sim_filter *f, const dqw_sim_plant *p, double t_s, double h_s, const double *middle,
                         const dqw_sim_point *end)
{
    const double *b = f->before_A;
    double m[2], e[2];
    dqw_sim_point o;
    if (!dqw_sim_plant_point(p, t_s + 0.5 * h_s, middle, &o)) return false;
    stationary(p, &o, m), stationary(p, end, e);
    const double x = h_s / f->tau_s, left = exp(-x), by_slope = lag(x, 1), by_curve = lag(x, 2);
    for (int n = 0; n < 2; ++n) {
        // Slope at the beginning and curvature, in units of the step.
        const double slope = 4 * m[n] - 3 * b[n] - e[n], curve = 4 * (b[n] - 2 * m[n] + e[n]);
        f->i_A[n] = f->i_A[n] * left - b[n] * expm1(-x) + slope * by_slope + curve * by_curve;
    }
    f->before_A[0] = e[0], f->before_A[1] = e[1];
    return true;
}
