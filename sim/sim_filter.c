#include "sim_filter.h"

#include <math.h>

static bool currents(const dqw_sim_plant *p, double t_s, const double *y, double i_A[2])
{
    dqw_sim_point o;
    if (!dqw_sim_plant_point(p, t_s, y, &o)) return false;
    i_A[0] = p->cos_frame * o.i_x_A - p->sin_frame * o.i_y_A, i_A[1] = p->sin_frame * o.i_x_A + p->cos_frame * o.i_y_A;
    return true;
}

bool dqw_sim_filter_step(dqw_sim_filter *f, const dqw_sim_plant *p, double t_s, double h_s, const double *middle,
                         const double *end)
{
    const double *b = f->before_A;
    double m[2], e[2];
    if (!currents(p, t_s + 0.5 * h_s, middle, m) || !currents(p, t_s + h_s, end, e)) return false;
    const double x = h_s / f->tau_s, left = exp(-x);
    for (int n = 0; n < 2; ++n) {
        // Slope at the beginning and curvature, in units of the step; the filter lags behind by 1/x of it.
        const double slope = 4 * m[n] - 3 * b[n] - e[n], curve = 4 * (b[n] - 2 * m[n] + e[n]);
        const double from = b[n] - slope / x + curve / (x * x), to = e[n] - (slope + curve) / x + curve / (x * x);
        f->i_A[n] = to + (f->i_A[n] - from) * left;
    }
    f->before_A[0] = e[0], f->before_A[1] = e[1];
    return true;
}
