// Speed of the simulator: real-time factor with the controller in the loop, at the scenario's own tolerance (error to
// 1e-6) and at one
// 200 times looser (to 1e-4). The error is the largest difference to a run at a thousandth of the tolerance, over the
// largest value of the voltage vector, the current vector and the speed. One core, best of three, processor time.
// `--factor NAME` prints one factor alone.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "dqw_sim.h"

static double now_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void run(const dqw_sim_scenario *s, dqw_sim_row *rows, size_t count, dqw_sim_report *report)
{
    const int status = dqw_sim_run(s, rows, count, report, NULL, NULL);
    if (status) {
        fprintf(stderr, "sim_speed: %s: %s\n", s->name, report->message);
        exit(1);
    }
}

static double relative_error(const dqw_sim_row *a, const dqw_sim_row *b, size_t count)
{
    double v = 0, dv = 0, i = 0, di = 0, w = 0, dw = 0;
    for (size_t k = 0; k < count; ++k) {
        v = fmax(v, hypot(b[k].v_d_V, b[k].v_q_V)),
        dv = fmax(dv, hypot(a[k].v_d_V - b[k].v_d_V, a[k].v_q_V - b[k].v_q_V));
        i = fmax(i, hypot(b[k].i_d_A, b[k].i_q_A)),
        di = fmax(di, hypot(a[k].i_d_A - b[k].i_d_A, a[k].i_q_A - b[k].i_q_A));
        w = fmax(w, fabs(b[k].w_m_rad_s)), dw = fmax(dw, fabs(a[k].w_m_rad_s - b[k].w_m_rad_s));
    }
    return fmax(dv / v, fmax(di / i, w > 0 ? dw / w : 0));
}

// Returns the real-time factor.
static double measure(const char *name, double looser, bool bdf, bool quiet)
{
    dqw_sim_scenario s = *dqw_sim_scenario_find(name);
    dqw_sim_set(&s, "noise", "0");
    s.rtol *= looser;
    if (bdf) s.method = DQW_SIM_BDF;
    const size_t count = dqw_sim_rows(&s);
    dqw_sim_row *rows = calloc(count, sizeof *rows), *tight = calloc(count, sizeof *tight);
    dqw_sim_report report, unused;
    if (!rows || !tight) exit(1);
    double best_s = INFINITY;
    for (int k = 0; k < 3; ++k) {
        const double start = now_s();
        run(&s, rows, count, &report);
        best_s = fmin(best_s, now_s() - start);
    }
    const double factor = s.duration_s / best_s, periods = (double)report.periods;
    if (!quiet) {
        s.rtol /= 1000;
        run(&s, tight, count, &unused);
        printf("%-16s %-5s %7.1e  %7.1e  %8.1f  %6.2f  %6.1f  %6.1f\n", name,
               s.method == DQW_SIM_ADAMS ? "Adams" : "BDF", s.rtol * 1000, relative_error(rows, tight, count), factor,
               1e6 * best_s / periods, (double)report.steps / periods, (double)report.rhs_evaluations / periods);
    }
    free(rows), free(tight);
    return factor;
}

// A drive as it is built, without what rounds and draws: where runs are compared, the last digit must decide nothing.
static dqw_sim_scenario built(const char *name)
{
    dqw_sim_scenario s = *dqw_sim_scenario_find(name);
    const dqw_sim_noise none = {.seed = 0};
    s.noise = none, s.sensing.noise_A = s.sensing.observer_noise_rad = 0, s.inverter.compare_counts = 0;
    s.duration_s = 0.2;
    return s;
}

// Prints a line, and lowers the slowest factors: CVODE as the scenario has it, and fixed steps.
static void measure_switched(const char *name, double *cvode, double *fixed)
{
    dqw_sim_scenario s = built(name);
    const size_t count = dqw_sim_rows(&s);
    dqw_sim_row *rows = calloc(count, sizeof *rows), *tight = calloc(count, sizeof *tight);
    dqw_sim_report report[2], unused;
    double best_s[2] = {INFINITY, INFINITY}, error[2];
    if (!rows || !tight) exit(1);
    dqw_sim_scenario exact = s;
    exact.rtol = 1e-11;
    run(&exact, tight, count, &unused);
    for (int m = 0; m < 2; ++m) {
        s.method = m ? DQW_SIM_RK4 : DQW_SIM_ADAMS;
        for (int k = 0; k < 3; ++k) {
            const double start = now_s();
            run(&s, rows, count, &report[m]);
            best_s[m] = fmin(best_s[m], now_s() - start);
        }
        error[m] = relative_error(rows, tight, count);
    }
    const double periods = (double)report[0].periods;
    printf("%-24s %7.1e  %7.1e  %6.2f  %6.1f  %6.1f    %7.1e  %6.2f  %6.1f\n", name, s.rtol, error[0],
           s.duration_s / best_s[0], 1e6 * best_s[0] / periods, (double)report[0].steps / periods, error[1],
           s.duration_s / best_s[1], 1e6 * best_s[1] / periods);
    *cvode = fmin(*cvode, s.duration_s / best_s[0]), *fixed = fmin(*fixed, s.duration_s / best_s[1]);
    free(rows), free(tight);
}

static void switched_drives(void)
{
    static const char *const at_20_kHz[] = {"drive_clamped_joint", "drive_compensated_joint", "drive_observer_joint",
                                            "drive_cheap_joint",   "drive_clamped_hub",       "drive_compensated_hub",
                                            "drive_observer_hub",  "drive_cheap_hub"};
    static const char *const others[] = {"drive_clamped", "drive_observer", "drive_clamped_fast",
                                         "drive_observer_fast"};
    double cvode = INFINITY, fixed = INFINITY, unused = INFINITY;
    puts("\nthe inverter at its switches    CVODE                                      fixed steps");
    puts("scenario                 rtol     error  x real    us   steps      error  x real    us");
    for (size_t k = 0; k < sizeof at_20_kHz / sizeof *at_20_kHz; ++k) measure_switched(at_20_kHz[k], &cvode, &fixed);
    for (size_t k = 0; k < sizeof others / sizeof *others; ++k) measure_switched(others[k], &unused, &unused);
    printf("slowest at 20 kHz: CVODE %.2f times real time (wanted: 0.5), fixed steps %.1f (wanted: 3)\n", cvode, fixed);
}

int main(int argc, char **argv)
{
    if (argc == 3 && strcmp(argv[1], "--factor") == 0) {
        if (!dqw_sim_scenario_find(argv[2])) return fprintf(stderr, "sim_speed: no scenario %s\n", argv[2]), 2;
        printf("%.2f\n", measure(argv[2], 1, false, true));
        return 0;
    }
    static const char *const names[] = {"servo_ideal",  "paper_step",       "robot_joint",
                                        "traction_ipm", "fault_turn_short", "heating"};
    puts("simulator, controller in the loop, one core      per control period:");
    puts("scenario         method  rtol     error  x real time   us    steps    rhs");
    double fine = INFINITY, coarse = INFINITY;
    for (size_t k = 0; k < sizeof names / sizeof *names; ++k) {
        fine = fmin(fine, measure(names[k], 1, false, false));
        coarse = fmin(coarse, measure(names[k], 200, false, false));
    }
    // The other method on the same work, for the choice between them.
    measure("servo_ideal", 1, true, false);
    printf("slowest: %.1f times real time at an error of 1e-6 (wanted: 5), %.1f at 1e-4 (wanted: 10)\n", fine, coarse);
    switched_drives();
    return 0;
}
