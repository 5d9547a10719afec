// A joint whose pairs of samples hold exactly, in double: for the estimators, which are shown pairs.
#ifndef MOVING_JOINT_H
#define MOVING_JOINT_H

#include "dqw_test.h"
#include "dqw_estimator.h"

#define DT_S 5e-5

static const double TRUTH[] = {0.5, 1.0e-3, 1.4e-3, 0.020};  // of joint_24v: R, L_d, L_q, flux

// Mean voltages of a pair of samples, d and q, from both samples' currents and speeds.
static inline void pair_voltages(double R_ohm, double i[2][2], const double w[2], double v_V[2])
{
    const double wd = 4 * 0.5 * (w[0] * i[0][0] + w[1] * i[1][0]);
    const double wq = 4 * 0.5 * (w[0] * i[0][1] + w[1] * i[1][1]);
    v_V[0] = R_ohm * 0.5 * (i[0][0] + i[1][0]) + TRUTH[1] * (i[1][0] - i[0][0]) / DT_S - TRUTH[2] * wq;
    v_V[1] = R_ohm * 0.5 * (i[0][1] + i[1][1]) + TRUTH[2] * (i[1][1] - i[0][1]) / DT_S + TRUTH[1] * wd +
             4 * TRUTH[3] * 0.5 * (w[0] + w[1]);
}

// Currents and speed as sines, voltages from them.
static inline dqw_sample moving(long k, double R_ohm, double noise, test_random *r)
{
    double i[2][2];
    double w[2];
    for (int n = 0; n < 2; n++) {
        const double t = (double)(k + n) * DT_S;
        i[n][0] = 1.5 * sin(2 * PI * 37 * t) + 1.2 * sin(2 * PI * 171 * t + 1);
        i[n][1] = 2.0 * sin(2 * PI * 53 * t + 2) + 0.5 + 1.0 * sin(2 * PI * 229 * t);
        w[n] = 70 * sin(2 * PI * 3 * t);
    }
    double v_V[2];
    pair_voltages(R_ohm, i, w, v_V);
    double x[] = {v_V[0], v_V[1], i[0][0], i[0][1], w[0]};
    static const double size[] = {2, 2, 1.4, 1.7, 50};
    for (int n = 0; n < 5 && noise > 0; n++) x[n] += noise * size[n] * random_normal(r);
    const dqw_sample s = {.v_d_V = (float)x[0],
                          .v_q_V = (float)x[1],
                          .i_d_A = (float)x[2],
                          .i_q_A = (float)x[3],
                          .w_m_rad_s = (float)x[4]};
    return s;
}

#endif
