// What a block's rows are, in double and SI, from the equations: for the rows of both arithmetics.
#ifndef BLOCK_ROWS_H
#define BLOCK_ROWS_H

#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "dqw_parameter.h"

/// Means under a triangle over 2 half pairs, of d and q; and what goes with them.
typedef struct block_si {
    double v_V[2], i_A[2], di_A_s[2], wi_A_rad_s[2], w_rad_s;
    double dead[2], constant[2];  ///< dead time's and the resting leg's input
    double v_step_V[2];           ///< voltages of the second half less those of the first, summed
    double noise_A2[2], noise_rad2_s2;
    double slope_inv_A, follow;  ///< of dead time's input; how fast that followed the currents
} block_si;

/// What the rows are made with.
typedef struct rows_with {
    double dt_s, pole_pairs;  ///< by which inputs are scaled
    int half;
    double width_A;        ///< of dead time; 0: has none
    bool psi_q, held;      ///< the other flux is learned; a voltage is held in the stationary frame
    int cross[2];          ///< weight of the other axis' flux in the rows of d and of q
    bool bent;             ///< with the end correction, by
    double R_ohm, L_H[2];  ///< this machine of
    double turns;          ///< so many pole pairs
} rows_with;

/// Inputs in volts for one SI unit of their weight, targets in volts; variances of their noise, and covariances.
typedef struct rows_si {
    double x[2][DQW_PARAMETERS], y_V[2], late_V[2];
    double var[2][DQW_PARAMETERS], speed[2], dead_in_R[2], R_in_dead[2];
} rows_si;

/// (E16): the trapezoid's means of a current that bends, less a twelfth of the jump of its slope times the period.
static inline void block_bend(block_si *b, const rows_with *w)
{
    const double T = w->dt_s;
    const double w_e = w->turns * b->w_rad_s;
    double jump[2];
    for (int a = 0; a < 2; a++) {
        const int o = 1 - a;
        const double turned = (a == 0 ? 1 : -1) * T * w_e * (b->v_V[o] + w->L_H[o] * b->di_A_s[o]);
        jump[a] = (turned - w->R_ohm * b->di_A_s[a] * T) / w->L_H[a];
    }
    for (int a = 0; a < 2; a++) {
        b->i_A[a] -= T * jump[a] / 12;
        b->wi_A_rad_s[a] -= b->w_rad_s * T * jump[a] / 12;
    }
}

static inline rows_si block_rows(block_si b, const rows_with *w)
{
    rows_si r;
    memset(&r, 0, sizeof r);
    const double T = w->dt_s;
    const double h = w->half;
    const double S = h * (h + 1);
    const double p = w->pole_pairs;
    if (w->bent) block_bend(&b, w);
    // Of a sample in the mean of the pairs' means, and of their slopes: by its weights in the pairs on both sides.
    double mean = 0;
    double slope = 0;
    for (int k = 0; k <= 2 * w->half; k++) {
        const double before = k == 0 ? 0 : fmin(k, 2 * h + 1 - k);
        const double behind = k == 2 * w->half ? 0 : fmin(k + 1, 2 * h - k);
        mean += pow((before + behind) / (2 * S), 2);
        slope += pow((before - behind) / (T * S), 2);
    }
    for (int a = 0; a < 2; a++) {
        const int o = 1 - a;
        const double sign = a == 0 ? -1 : 1;
        const int flux = a == 0 ? DQW_PSI_Q : DQW_PSI;
        const double var = b.noise_A2[a];
        r.y_V[a] = b.v_V[a];
        // (E13)
        r.x[a][DQW_R] = b.i_A[a];
        r.x[a][DQW_LD + a] = b.di_A_s[a];
        r.x[a][w->cross[a]] = sign * p * b.wi_A_rad_s[o];
        if (a == 1 || w->psi_q) r.x[a][flux] = p * b.w_rad_s;
        // (E90)
        r.late_V[a] = b.v_step_V[a] / S + (w->held ? sign * p * b.w_rad_s * T * b.v_V[o] : 0);
        // (E60)
        r.var[a][DQW_R] = mean * var;
        r.var[a][DQW_LD + a] = slope * var;
        const double both = b.w_rad_s * b.w_rad_s * b.noise_A2[o] +
                            b.noise_rad2_s2 * (b.i_A[o] * b.i_A[o] + b.noise_A2[o]);
        r.var[a][w->cross[a]] = p * p * mean * both;
        if (a == 1 || w->psi_q) {
            r.var[a][flux] = p * p * mean * b.noise_rad2_s2;
            r.speed[a] = sign * mean * p * p * b.i_A[o] * b.noise_rad2_s2;
        }
        if (w->width_A <= 0) continue;
        r.x[a][DQW_DEAD_TIME] = b.dead[a];
        r.x[a][DQW_DEAD_CONSTANT] = b.constant[a];
        // White noise behind y += f (x - y) has f / (2 - f) of its power.
        const double left = var * b.follow / (2 - b.follow);
        const double steep = fmax(b.slope_inv_A, 0.53 / (sqrt(left) + 1.2 * w->width_A));
        r.var[a][DQW_DEAD_TIME] = mean * b.slope_inv_A * steep * var;
        r.R_in_dead[a] = mean * b.slope_inv_A * var;
        r.dead_in_R[a] = mean * b.slope_inv_A * (var - 0.5 * left * sqrt(left) / (sqrt(left) + w->width_A));
    }
    return r;
}

#endif
