// Segments of driving as a machine's rows make them: for the tests of both dqw_segment and its twin.
#ifndef DRIVEN_SEGMENT_H
#define DRIVEN_SEGMENT_H

#include "dqw_size.h"
#include "dqw_test.h"

enum { WEIGHTS = DQW_FOLLOWED };

// A machine, how it is driven, and how far each weight scatters between segments.
typedef struct driven {
    double whole[WEIGHTS];  ///< each input at full current or speed
    double noise;           ///< of a row
    double band[WEIGHTS];
    double w, i_d, i_q;  ///< now
    double slow;         ///< part by which they move in a block
    test_random r;
} driven;

static inline driven drive_of(uint64_t seed)
{
    driven d = {.r = {seed}};
    static const double usual[WEIGHTS] = {0.1, 0.2, 0.2, 0.7, 0.033, 0.7, 0.033, 0.2, 0.2};
    for (int k = 0; k < WEIGHTS; k++) d.whole[k] = usual[k] * exp(random_uniform(&d.r, -1.2, 0.7));
    d.noise = 1.5e-4 * pow(10, random_uniform(&d.r, 0, 1.5));
    for (int k = 0; k < WEIGHTS; k++) d.band[k] = 0.002 * exp(random_uniform(&d.r, -1.5, 2.0));
    d.band[DQW_DEAD_TIME] = d.band[DQW_DEAD_CONSTANT] = 0.01;
    d.slow = exp(random_uniform(&d.r, -4, -1));
    return d;
}

static inline double other_point(driven *d, double now, double mean, double size)
{
    return now + d->slow * (mean - now) + sqrt(2 * d->slow) * size * random_normal(&d->r);
}

// Both rows of the next block.
static inline void drive(driven *d, double x[2][WEIGHTS])
{
    const double before[2] = {d->i_d, d->i_q};
    d->w = fmax(-1, fmin(1, other_point(d, d->w, 0.2, 0.25)));
    d->i_d = fmax(-1, fmin(1, other_point(d, d->i_d, -0.05, 0.08)));
    d->i_q = fmax(-1, fmin(1, other_point(d, d->i_q, 0.1, 0.15)));
    const double i[2] = {d->i_d, d->i_q};
    for (int axis = 0; axis < 2; axis++) {
        for (int k = 0; k < WEIGHTS; k++) x[axis][k] = 0;
        x[axis][DQW_R] = d->whole[DQW_R] * i[axis];
        x[axis][DQW_LD + axis] = 0.3 * d->whole[DQW_LD + axis] * (i[axis] - before[axis]);
        const int other = 1 - axis;
        x[axis][DQW_LD + other] = (axis == 1 ? 1 : -1) * d->whole[DQW_LD + other] * d->w * i[other];
        // Of a map a bend that is unlike the current.
        const double bend[2] = {4 * i[0] * i[0], 4 * i[1] * i[1]};
        x[axis][DQW_PARAMETERS + axis] = 0.3 * d->whole[DQW_PARAMETERS + axis] *
                                         (bend[axis] - 4 * before[axis] * before[axis]);
        x[axis][DQW_PARAMETERS + other] = (axis == 1 ? 1 : -1) * d->whole[DQW_PARAMETERS + other] * d->w * bend[other];
        x[axis][DQW_DEAD_TIME] = d->whole[DQW_DEAD_TIME] * (tanh(10 * i[axis]) + 0.1 * random_normal(&d->r));
        x[axis][DQW_DEAD_CONSTANT] = 0.3 * d->whole[DQW_DEAD_CONSTANT] * random_normal(&d->r);
        x[axis][axis == 1 ? DQW_PSI : DQW_PSI_Q] = d->whole[axis == 1 ? DQW_PSI : DQW_PSI_Q] * d->w;
    }
}

#endif
