// The RC filter before the current sensors. Nothing hangs on it, and it is faster than the plant: not a state of the
// integrator, but carried along from step to step.
#ifndef DQW_SIM_FILTER_H
#define DQW_SIM_FILTER_H

#include "sim_plant.h"

typedef struct dqw_sim_filter {
    double tau_s;        ///< 0: none
    double i_A[2];       ///< stationary, behind the filter
    double before_A[2];  ///< before it, where the last step ended
} dqw_sim_filter;

/// Takes the currents before the filter at local time t_s: where a held voltage jumps, those of branches without a
/// state do. Returns false where the plant cannot be evaluated.
bool dqw_sim_filter_begin(dqw_sim_filter *f, const dqw_sim_plant *p, double t_s, const double *y);

/// Moves over a step of h_s that begins at local time t_s: exact for the parabola through the currents at its
/// beginning, middle and end, the first of which is the last step's end. Returns false where the plant cannot be
/// evaluated at the state in the middle.
bool dqw_sim_filter_step(dqw_sim_filter *f, const dqw_sim_plant *p, double t_s, double h_s, const double *middle,
                         const dqw_sim_point *end);

#endif
