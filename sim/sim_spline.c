#include "sim_spline.h"

#include <math.h>

int dqw_sim_spline(const dqw_sim_map_axis *axis, double x_A, double b[3][5])
{
    // Rows: the five functions; columns: powers of u in [0, 1], the place in the cell; times 24.
    static const double poly[5][5] = {
        {1, -4, 6, -4, 1}, {11, -12, -6, 12, -4}, {11, 12, -6, -12, 6}, {1, 4, 6, 4, -4}, {0, 0, 0, 0, 1}};
    const double inside = (x_A - axis->low_A) / axis->step_A;
    double place = inside;
    if (place < 0) place = 0;
    if (place > axis->cells) place = axis->cells;
    int cell = (int)place;
    if (cell > axis->cells - 1) cell = axis->cells - 1;
    const double u = place - cell, beyond = inside - place, h = 1 / axis->step_A;
    for (int k = 0; k < 5; ++k) {
        const double *c = poly[k];
        const double v = (c[0] + u * (c[1] + u * (c[2] + u * (c[3] + u * c[4])))) / 24;
        const double s = (c[1] + u * (2 * c[2] + u * (3 * c[3] + u * 4 * c[4]))) / 24;
        const double a = (2 * c[2] + u * (6 * c[3] + u * 12 * c[4])) / 24;
        b[0][k] = v + beyond * (s + 0.5 * beyond * a);
        b[1][k] = (s + beyond * a) * h;
        b[2][k] = a * h * h;
    }
    return cell;
}
