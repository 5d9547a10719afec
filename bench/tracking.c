// How the estimator follows a joint whose parameters change: steps of R, flux and L_q, and a slow rise of R. Options:
// --seeds N,
// --quick (2 seeds, the slow rise within 10 s).
#include "joint.h"

#define CHANGE_S 2.0
#define END_S 8.0
#define WITHIN_PERCENT 2.0

typedef enum { STEP_R, STEP_FLUX, STEP_LQ, RAMP_R, CHANGES } change_kind;

typedef struct {
    const char *name;
    change_kind kind;
    int parameter;
    double part;  // of the healthy value
} change_case;

static const change_case CASES[] = {
    {"R +20 %, step", STEP_R, DQW_R, 0.2},
    {"flux -5 %, step", STEP_FLUX, DQW_PSI, -0.05},
    {"L_q -15 %, step (joined logs)", STEP_LQ, DQW_LQ, -0.15},
    {"R +20 %, slowly", RAMP_R, DQW_R, 0.2},
};

// A run of the estimator: one parameter against the truth, row by row.
typedef struct {
    size_t count, change_at;
    double dt_s;
    float *value, *sd, *truth;
} course;

// All in percent of the new value, times from the change on.
typedef struct {
    double settled_s, overshoot, rms, bias, others, sd;
} figures;

static dqw_sim_scenario scenario(const change_case *c, int seed, double noise, double rise_s)
{
    dqw_sim_scenario s = joint_scenario(seed, noise, c->kind == RAMP_R ? CHANGE_S + rise_s : END_S);
    const dqw_sim_ramp at_once = {c->part, CHANGE_S, CHANGE_S + 1e-3};
    const dqw_sim_ramp lost = {-c->part, CHANGE_S, CHANGE_S + 1e-3};
    const dqw_sim_ramp slowly = {c->part, CHANGE_S, CHANGE_S + rise_s};
    s.rtol = 1e-6;  // of currents: a thousandth of the noise
    s.nonideal.dead_time_V.value = 0.24;
    s.nonideal.dead_time_width_A = 0.05;
    // One kelvin above the reference, so that alpha is the part by which R grows.
    s.machine.temp_start_C = s.machine.temp_ref_C + 1;
    if (c->kind == STEP_R) s.nonideal.winding_alpha_per_K = at_once;
    if (c->kind == RAMP_R) s.nonideal.winding_alpha_per_K = slowly;
    if (c->kind == STEP_FLUX) s.nonideal.demagnetisation = lost;
    return s;
}

// The simulator cannot change an inductance at constant current: two logs of the same references, one of each machine,
// are joined.
static joint_log log_of(const change_case *c, const dqw_sim_scenario *whole)
{
    if (c->kind != STEP_LQ) return joint_run(whole);
    dqw_sim_scenario s = *whole;
    s.duration_s = CHANGE_S;
    const joint_log before = joint_run(&s);
    s.duration_s = whole->duration_s;
    s.machine.Lq_H *= 1 + c->part;
    const joint_log log = joint_run(&s);
    memcpy(log.row, before.row, before.count * sizeof *log.row);
    free(before.row);
    return log;
}

static double truth_at(const change_case *c, const dqw_sim_scenario *s, double t_s)
{
    const double rise_s = c->kind == RAMP_R ? s->duration_s - CHANGE_S : 1e-3;
    const double grown = t_s < CHANGE_S ? 0 : fmin((t_s - CHANGE_S) / rise_s, 1);
    return joint_truth(&s->machine, c->parameter) * (1 + grown * c->part);
}

static course follow(const change_case *c, const dqw_sim_scenario *s, const joint_log *log, double *others_percent)
{
    const dqw_estimator_config config = joint_in_service(&s->machine, 0.05);
    dqw_estimator e;
    course o = {.count = log->count,
                .change_at = (size_t)(CHANGE_S / s->drive.dt_s + 0.5),
                .dt_s = s->drive.dt_s,
                .value = malloc(3 * log->count * sizeof(float))};
    if (o.value == NULL || dqw_estimator_init(&e, &config) != DQW_OK) exit(1);
    o.sd = o.value + log->count;
    o.truth = o.sd + log->count;
    for (size_t k = 0; k < log->count; k++) {
        const dqw_sample x = joint_sample(&log->row[k]);
        if (c->kind == STEP_LQ && k == o.change_at) dqw_estimator_missing(&e, 0);
        joint_learn(&e, &x);
        const dqw_reading r = dqw_estimator_read(&e, (enum dqw_parameter)c->parameter);
        o.value[k] = r.value;
        o.sd[k] = r.sd;
        o.truth[k] = (float)truth_at(c, s, log->row[k].t_s);
        for (int i = 0; i < JOINT_PARAMETERS && k > o.change_at; i++) {
            const double off = 100 * fabs((double)dqw_estimator_read(&e, (enum dqw_parameter)i).value /
                                              joint_truth(&s->machine, i) -
                                          1);
            if (i != c->parameter) *others_percent = fmax(*others_percent, off);
        }
    }
    return o;
}

static figures measure(const change_case *c, const course *o)
{
    figures f = {.settled_s = 0};
    const double final = o->truth[o->count - 1];
    const double sign = c->part > 0 ? 1 : -1;
    // A slow rise is judged all along, a step from when it is followed on.
    size_t from = o->change_at;
    for (size_t k = o->change_at; k < o->count; k++) {
        const double off = 100 * (o->value[k] - o->truth[k]) / final;
        if (fabs(off) > WITHIN_PERCENT) from = k + 1;
        f.overshoot = fmax(f.overshoot, sign * off);
    }
    f.settled_s = (double)(from - o->change_at) * o->dt_s;
    if (c->kind == RAMP_R) from = o->change_at + (size_t)(1 / o->dt_s);
    for (size_t k = from; k < o->count; k++) {
        const double off = 100 * (o->value[k] - o->truth[k]) / final;
        f.rms += off * off / (double)(o->count - from);
        f.bias += off / (double)(o->count - from);
        f.sd += 100 * o->sd[k] / final / (double)(o->count - from);
    }
    f.rms = sqrt(f.rms);
    return f;
}

static void one_case(const change_case *c, int seeds, double noise, double rise_s)
{
    figures sum = {0};
    double slowest_s = 0;
    const int logs = c->kind == RAMP_R ? 1 : seeds;
    for (int seed = 1; seed <= logs; seed++) {
        const dqw_sim_scenario s = scenario(c, seed, noise, rise_s);
        const joint_log log = log_of(c, &s);
        double others = 0;
        const course o = follow(c, &s, &log, &others);
        const figures f = measure(c, &o);
        slowest_s = fmax(slowest_s, f.settled_s);
        sum.settled_s += f.settled_s / logs;
        sum.overshoot = fmax(sum.overshoot, f.overshoot);
        sum.rms += f.rms * f.rms / logs;
        sum.bias += f.bias / logs;
        sum.sd += f.sd / logs;
        sum.others = fmax(sum.others, others);
        free(o.value);
        free(log.row);
    }
    printf("| %3.0f %% | %-30s | %5d | %6.3f | %6.3f | %6.2f | %+6.2f | %6.2f | %6.2f | %6.2f |\n", 100 * noise,
           c->name, logs, sum.settled_s, slowest_s, sum.overshoot, sum.bias, sqrt(sum.rms), sum.sd, sum.others);
    fflush(stdout);
}

int main(int argc, char **argv)
{
    const bool quick = joint_flag(argc, argv, "--quick");
    const int seeds = (int)joint_number(argc, argv, "--seeds", quick ? 2 : 10);
    const double rise_s = quick ? 10 : 60;
    const double noise[] = {0.01, 0.05};
    printf("Long memory, dead time learned: parameter changes at %g s (the slow one within %g s). Until "
           "within\n"
           "%g %% of the new value for good, mean and slowest log, s; then in %% of it: overshoot (worst log), mean "
           "error and RMS error after\n"
           "that (slow: from 1 s on), the estimator's own deviation, and the largest error of any other parameter\n\n",
           CHANGE_S, rise_s, WITHIN_PERCENT);
    printf("| noise | change                         |  logs | within | worst  | over   | mean   | RMS    | sd     | "
           "others |\n");
    printf("| ----: | ------------------------------ | ----: | -----: | -----: | -----: | -----: | -----: | -----: | "
           "-----: |\n");
    for (size_t l = 0; l < sizeof noise / sizeof noise[0]; l++)
        for (size_t c = 0; c < sizeof CASES / sizeof CASES[0]; c++) one_case(&CASES[c], seeds, noise[l], rise_s);
    return 0;
}
