#include "sim_integrator.h"

#include <cvode/cvode.h>
#include <math.h>
#include <string.h>
#include <sundials/sundials_version.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include "sim_rk4.h"

// A failed evaluation (a flux map cannot be inverted there) asks CVODE for a smaller step.
static int rhs(sunrealtype tau_s, N_Vector y, N_Vector dy, void *plant)
{
    dqw_sim_point o;
    return dqw_sim_plant_point(plant, tau_s, NV_DATA_S(y), &o) &&
                   dqw_sim_plant_slopes(plant, tau_s, NV_DATA_S(y), &o, NV_DATA_S(dy))
               ? 0
               : 1;
}

static int margins(sunrealtype tau_s, N_Vector y, sunrealtype *margin, void *plant)
{
    dqw_sim_point o;
    if (!dqw_sim_plant_point(plant, tau_s, NV_DATA_S(y), &o)) return 1;
    dqw_sim_plant_margins(plant, NV_DATA_S(y), &o, margin);
    return 0;
}

static int create_context(SUNContext *context)
{
#if SUNDIALS_VERSION_MAJOR >= 7
    if (SUNContext_Create(SUN_COMM_NULL, context)) return DQW_SIM_ERR_MEMORY;
    SUNContext_ClearErrHandlers(*context);
    return 0;
#else
    return SUNContext_Create(NULL, context) ? DQW_SIM_ERR_MEMORY : 0;
#endif
}

static int attach_solver(dqw_sim_integrator *g, enum dqw_sim_method method)
{
    if (method == DQW_SIM_ADAMS) {
        g->nonlinear = SUNNonlinSol_FixedPoint(g->y, 0, g->context);
        return g->nonlinear && CVodeSetNonlinearSolver(g->cvode, g->nonlinear) == 0 ? 0 : DQW_SIM_ERR_MEMORY;
    }
    const sunindextype n = g->plant->states;
    g->matrix = SUNDenseMatrix(n, n, g->context);
    if (!g->matrix) return DQW_SIM_ERR_MEMORY;
    g->linear = SUNLinSol_Dense(g->y, g->matrix, g->context);
    return g->linear && CVodeSetLinearSolver(g->cvode, g->linear, g->matrix) == 0 ? 0 : DQW_SIM_ERR_MEMORY;
}

int dqw_sim_integrator_init(dqw_sim_integrator *g, const dqw_sim_plant *plant, enum dqw_sim_method method,
                            const double *tolerance, double L_H, double filter_s)
{
    memset(g, 0, sizeof *g);
    g->plant = plant, g->L_H = L_H, g->filter.tau_s = filter_s;
    const int status = create_context(&g->context);
    if (status) return status;
    g->y = N_VNew_Serial(plant->states, g->context);
    g->tolerance = N_VNew_Serial(plant->states, g->context);
    g->error = N_VNew_Serial(plant->states, g->context);
    g->middle = N_VNew_Serial(plant->states, g->context);
    if (!g->y || !g->tolerance || !g->error || !g->middle) return DQW_SIM_ERR_MEMORY;
    N_VConst(0, g->y);
    if (method == DQW_SIM_RK4) return 0;
    g->cvode = CVodeCreate(method == DQW_SIM_ADAMS ? CV_ADAMS : CV_BDF, g->context);
    if (!g->cvode) return DQW_SIM_ERR_MEMORY;
    memcpy(NV_DATA_S(g->tolerance), tolerance, (size_t)plant->states * sizeof *tolerance);
#if SUNDIALS_VERSION_MAJOR < 7
    CVodeSetErrFile(g->cvode, NULL);
#endif
    if (CVodeInit(g->cvode, rhs, 0, g->y) || CVodeSVtolerances(g->cvode, 0, g->tolerance) ||
        CVodeSetUserData(g->cvode, (void *)plant) || CVodeSetMaxNumSteps(g->cvode, 100000))
        return DQW_SIM_ERR_SOLVER;
    // CVODE would try ten times the step after each early one, and fail every other time: 2 saves a quarter of the
    // evaluations.
    if (CVodeSetEtaMaxEarlyStep(g->cvode, 2)) return DQW_SIM_ERR_SOLVER;
    // A floating output begins on a rail, its margin 0.
    static const int falling[6] = {-1, -1, -1, -1, -1, -1};
    if (plant->at_node >= 0 &&
        (CVodeRootInit(g->cvode, 6, margins) || CVodeSetRootDirection(g->cvode, (int *)falling) ||
         CVodeSetNoInactiveRootWarn(g->cvode)))
        return DQW_SIM_ERR_SOLVER;
    return attach_solver(g, method);
}

void dqw_sim_integrator_free(dqw_sim_integrator *g)
{
    if (g->cvode) CVodeFree(&g->cvode);
    if (g->nonlinear) SUNNonlinSolFree(g->nonlinear);
    if (g->linear) SUNLinSolFree(g->linear);
    if (g->matrix) SUNMatDestroy(g->matrix);
    if (g->y) N_VDestroy(g->y);
    if (g->error) N_VDestroy(g->error);
    if (g->middle) N_VDestroy(g->middle);
    if (g->tolerance) N_VDestroy(g->tolerance);
    if (g->context) SUNContext_Free(&g->context);
}

double *dqw_sim_integrator_state(dqw_sim_integrator *g) { return NV_DATA_S(g->y); }

// Error of the first step as a fraction of the tolerance, as CVODE measures it.
static double first_error(dqw_sim_integrator *g)
{
    if (CVodeGetEstLocalErrors(g->cvode, g->error)) return 1;
    double square = 0;
    for (int k = 0; k < g->plant->states; ++k) {
        const double e = NV_DATA_S(g->error)[k] / NV_DATA_S(g->tolerance)[k];
        square += e * e;
    }
    return sqrt(square / g->plant->states);
}

// Every period starts anew at order 1, whose error goes with the square of the step: aim at a third of the tolerance,
// so that the next edge's larger jump does not cost a failure.
static void learn_first_step(dqw_sim_integrator *g, double dt_s)
{
    sunrealtype taken = 0;
    CVodeGetLastStep(g->cvode, &taken);
    const double scale = sqrt(0.3 / (first_error(g) + 0.01));
    g->first_step_s = fmin(taken * fmax(0.2, fmin(2, scale)), dt_s);
}

// One step of CVODE's own, and the filter's over it.
static int step(dqw_sim_integrator *g, double to_s, double *at_s)
{
    const double from_s = *at_s;
    const int flag = CVode(g->cvode, to_s, g->y, at_s, CV_ONE_STEP);
    if (flag < 0 || !(g->filter.tau_s > 0)) return flag;
    dqw_sim_point end;
    if (CVodeGetDky(g->cvode, 0.5 * (from_s + *at_s), 0, g->middle) ||
        !dqw_sim_plant_point(g->plant, *at_s, NV_DATA_S(g->y), &end) ||
        !dqw_sim_filter_step(&g->filter, g->plant, from_s, *at_s - from_s, NV_DATA_S(g->middle), &end))
        return -1;
    return flag;
}

static int begin(dqw_sim_integrator *g, double from_s, double to_s)
{
    const int flag = CVodeReInit(g->cvode, from_s, g->y);
    return flag ? flag : CVodeSetInitStep(g->cvode, fmin(g->first_step_s, to_s - from_s));
}

// CVODE counts from its last fresh start.
static void count(dqw_sim_integrator *g)
{
    long steps = 0, evaluations = 0, failures = 0;
    CVodeGetNumSteps(g->cvode, &steps);
    CVodeGetNumRhsEvals(g->cvode, &evaluations);
    CVodeGetNumErrTestFails(g->cvode, &failures);
    g->steps += steps - g->counted[0], g->rhs_evaluations += evaluations - g->counted[1];
    g->error_test_failures += failures - g->counted[2];
    g->counted[0] = steps, g->counted[1] = evaluations, g->counted[2] = failures;
}

int dqw_sim_integrator_watch(dqw_sim_integrator *g, bool fresh, double from_s, double to_s, double *reached_s,
                             int ended[6])
{
    memset(ended, 0, 6 * sizeof *ended);
    if (!g->cvode) return dqw_sim_rk4(g, from_s, to_s, reached_s, ended);
    *reached_s = from_s;
    int flag = fresh ? begin(g, from_s, to_s) : 0;
    if (fresh) memset(g->counted, 0, sizeof g->counted);
    if (flag == 0) flag = CVodeSetStopTime(g->cvode, to_s);
    if (flag == 0) flag = step(g, to_s, reached_s);
    if (flag < 0) return flag;
    if (fresh) learn_first_step(g, to_s - from_s);
    while (flag >= 0 && flag != CV_ROOT_RETURN && *reached_s < to_s)
        flag = g->filter.tau_s > 0 ? step(g, to_s, reached_s) : CVode(g->cvode, to_s, g->y, reached_s, CV_NORMAL);
    if (flag < 0) return flag;
    count(g);
    return flag == CV_ROOT_RETURN ? CVodeGetRootInfo(g->cvode, ended) : 0;
}

int dqw_sim_integrator_span(dqw_sim_integrator *g, double from_s, double to_s)
{
    double reached_s;
    int ended[6];
    if (g->filter.tau_s > 0 && !dqw_sim_filter_begin(&g->filter, g->plant, from_s, dqw_sim_integrator_state(g)))
        return -1;
    return dqw_sim_integrator_watch(g, true, from_s, to_s, &reached_s, ended);
}
