// Iron of a closed co-energy, K I sqrt(1 + x^2 + y^2), x = (i_d + M)/I, y = i_q/I, less its tangent at zero current;
// and a flux map's table of it.
#ifndef BENT_IRON_H
#define BENT_IRON_H

#include <math.h>
#include <stdint.h>

#include "dqw_effect_name.h"

#define BENT_K_WB 0.012
#define BENT_I_A 8.0
#define BENT_M_A 5.0
// Of the table: more than any current here needs.
#define BENT_CELL_D_A 1.5
#define BENT_CELL_Q_A 0.8
#define BENT_FULL_WB 0.0132
enum { BENT_BELOW = 10, BENT_NODES = 21 };

static inline double bent_coenergy(double i_d, double i_q)
{
    const double at = BENT_M_A / BENT_I_A, root = sqrt(1 + at * at);
    const double x = (i_d + BENT_M_A) / BENT_I_A, y = i_q / BENT_I_A;
    const double line = root + at / root * (x - at) + 0.5 * (x - at) * (x - at) / (root * root * root) +
                        0.5 * y * y / root;
    return BENT_K_WB * BENT_I_A * (sqrt(1 + x * x + y * y) - line);
}

static inline void bent_flux(double i_d, double i_q, double psi[2])
{
    const double at = BENT_M_A / BENT_I_A, root = sqrt(1 + at * at);
    const double x = (i_d + BENT_M_A) / BENT_I_A, y = i_q / BENT_I_A, norm = sqrt(1 + x * x + y * y);
    psi[0] = BENT_K_WB * (x / norm - at / root - (x - at) / (root * root * root));
    psi[1] = BENT_K_WB * (y / norm - y / root);
}

static inline const int16_t *bent_table(void)
{
    static int16_t map[DQW_EFFECT_MAP_HEAD + 2 * BENT_NODES * BENT_NODES];
    map[0] = map[2] = BENT_NODES;
    map[1] = BENT_BELOW;
    for (int d = 0; d < BENT_NODES; d++)
        for (int q = 0; q < BENT_NODES; q++) {
            const double i_d = (d - BENT_BELOW) * BENT_CELL_D_A, i_q = q * BENT_CELL_Q_A;
            double psi[2], side[4][2];
            bent_flux(i_d, i_q, psi);
            for (int n = 0; n < 4; n++)
                bent_flux(i_d + (n == 0) * BENT_CELL_D_A - (n == 1) * BENT_CELL_D_A,
                          i_q + (n == 2) * BENT_CELL_Q_A - (n == 3) * BENT_CELL_Q_A, side[n]);
            // So that the mean of a chord is the curve's. (E165)
            for (int a = 0; a < 2; a++) {
                const double x = psi[a] - (side[0][a] + side[1][a] + side[2][a] + side[3][a] - 4 * psi[a]) / 12;
                map[DQW_EFFECT_MAP_HEAD + 2 * (d * BENT_NODES + q) + a] = (int16_t)lrint(
                    fmax(-32768, fmin(32767, x / BENT_FULL_WB * 32768)));
            }
        }
    return map;
}

#endif
