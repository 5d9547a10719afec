// CVODE over one period after another, each a fresh start: the voltage jumps at every switching edge.
#ifndef DQW_SIM_INTEGRATOR_H
#define DQW_SIM_INTEGRATOR_H

#include <nvector/nvector_serial.h>
#include <sundials/sundials_linearsolver.h>
#include <sundials/sundials_matrix.h>
#include <sundials/sundials_nonlinearsolver.h>

#include "sim_plant.h"

typedef struct dqw_sim_integrator {
    const dqw_sim_plant *plant;
    SUNContext context;
    void *cvode;
    N_Vector y, tolerance, error;
    SUNNonlinearSolver nonlinear;
    SUNMatrix matrix;
    SUNLinearSolver linear;
    double first_step_s;  ///< what the last periods' experience allows; 0: CVODE guesses
    long steps, rhs_evaluations, error_test_failures;
} dqw_sim_integrator;

/// Creates the solver: Adams with fixed-point iteration, or BDF with Newton and a dense matrix. tolerance[states]:
/// absolute local error per step. Returns 0, DQW_SIM_ERR_MEMORY or DQW_SIM_ERR_SOLVER. Always end with
/// dqw_sim_integrator_free.
int dqw_sim_integrator_init(dqw_sim_integrator *g, const dqw_sim_plant *plant, enum dqw_sim_method method,
                            const double *tolerance);
void dqw_sim_integrator_free(dqw_sim_integrator *g);

/// The state vector; set it before a period, read it after.
double *dqw_sim_integrator_state(dqw_sim_integrator *g);

/// Integrates from one local time to another, a fresh start. Returns 0, or CVODE's negative flag.
int dqw_sim_integrator_span(dqw_sim_integrator *g, double from_s, double to_s);

#endif
