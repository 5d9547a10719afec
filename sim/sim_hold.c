#include "sim_hold.h"

#include <math.h>

void dqw_sim_hold_in_frame(const dqw_sim_plant *p, const double held[2], double *v_x_V, double *v_y_V)
{
    const double c = p->turning_frame ? 1 : cos(p->theta_e_rad), s = p->turning_frame ? 0 : sin(p->theta_e_rad);
    *v_x_V = c * held[0] + s * held[1], *v_y_V = c * held[1] - s * held[0];
}

// 4-point Gauss over the cubic Hermite interpolant of the angle. Below 1 rad of turn its error is under 1e-9 of the
// voltage.
void dqw_sim_hold_mean(const dqw_sim_plant *p, const double held[2], double dt_s, double turn_rad, double w0, double w1,
                       double *v_d_V, double *v_q_V)
{
    static const double node[4] = {0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970263};
    static const double weight[4] = {0.17392742256872692, 0.32607257743127307, 0.32607257743127307,
                                     0.17392742256872692};
    double v_x, v_y, c = 0, s = 0;
    dqw_sim_hold_in_frame(p, held, &v_x, &v_y);
    *v_d_V = v_x, *v_q_V = v_y;
    if (p->turning_frame) return;
    for (int k = 0; k < 4; ++k) {
        const double u = node[k], u2 = u * u, u3 = u2 * u;
        const double turn = turn_rad * (3 * u2 - 2 * u3) + dt_s * p->p * (w0 * (u3 - 2 * u2 + u) + w1 * (u3 - u2));
        c += weight[k] * cos(turn), s += weight[k] * sin(turn);
    }
    *v_d_V = c * v_x + s * v_y;
    *v_q_V = c * v_y - s * v_x;
}
