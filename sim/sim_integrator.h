// The plant over one span after another, each a fresh start, for the voltage jumps at every switching edge: by CVODE,
// or by fixed steps.
#ifndef DQW_SIM_INTEGRATOR_H
#define DQW_SIM_INTEGRATOR_H

#include <nvector/nvector_serial.h>
#include <sundials/sundials_linearsolver.h>
#include <sundials/sundials_matrix.h>
#include <sundials/sundials_nonlinearsolver.h>

#include "sim_filter.h"
#include "sim_plant.h"

typedef struct dqw_sim_integrator {
    const dqw_sim_plant *plant;
    SUNContext context;
    void *cvode;
    N_Vector y, tolerance, error, middle;
    SUNNonlinearSolver nonlinear;
    SUNMatrix matrix;
    SUNLinearSolver linear;
    double first_step_s;  ///< what the last periods' experience allows; 0: CVODE guesses
    dqw_sim_filter filter;
    double L_H;  ///< the machine's smallest inductance, for fixed steps
    long steps, rhs_evaluations, error_test_failures;
    long counted[3];  ///< of these, since the last fresh start
} dqw_sim_integrator;

/// Creates the solver: Adams with fixed-point iteration, or BDF with Newton and a dense matrix, or none for fixed
/// steps. tolerance[states]: absolute local error per step. L_H: the machine's smallest inductance. filter_s: of the
/// current sensors. Returns 0, DQW_SIM_ERR_MEMORY or DQW_SIM_ERR_SOLVER. Always end with dqw_sim_integrator_free.
int dqw_sim_integrator_init(dqw_sim_integrator *g, const dqw_sim_plant *plant, enum dqw_sim_method method,
                            const double *tolerance, double L_H, double filter_s);
void dqw_sim_integrator_free(dqw_sim_integrator *g);

/// The state vector; set it before a period, read it after.
double *dqw_sim_integrator_state(dqw_sim_integrator *g);

/// Integrates from one local time to another, a fresh start. Returns 0, or CVODE's negative flag.
int dqw_sim_integrator_span(dqw_sim_integrator *g, double from_s, double to_s);

/// The same, fresh or, where neither states nor slopes have jumped, going on; and where a leg's margin (sim_inverter.h)
/// reaches 0 on the way it ends there. ended[6]: which ones, by 2 leg + rail. *reached_s: where it ended.
int dqw_sim_integrator_watch(dqw_sim_integrator *g, bool fresh, double from_s, double to_s, double *reached_s,
                             int ended[6]);

#endif
