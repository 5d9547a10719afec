// Every fault of the monitor's table at three severities: told at all, how soon, and by which name. The joint is
// healthy until 2 s; the fault then grows within 0.1 s. Options: --seeds N, --noise X, --only FAULT, --quick (3 seeds),
// --events (prints every event), --q15 (in whole numbers).
#include "either_monitor.h"
#include "joint.h"

enum { SEVERITIES = 3 };

#define START_S 2.0
#define GROWS_S 0.1
#define END_S 5.0
// Friction is watched after some thirty reversals, and found slowly: longer logs, and five of them.
#define BEARING_START_S 16.0
#define BEARING_END_S 40.0
#define BEARING_SEEDS 5
#define DEAD_TIME_V 0.24
#define LIMIT_K 60.0

typedef enum { FAULT_RAMP, FAULT_DEAD_TIME, FAULT_RESISTANCE, FAULT_HEAT } fault_kind;

typedef struct {
    const char *name, *unit;
    enum dqw_fault_name expected;
    fault_kind kind;
    const char *key;  // FAULT_RAMP: the simulator's
    double severity[SEVERITIES], duration_s, load_Nm;
} fault_case;

static const fault_case CASES[] = {
    {"healthy", "", DQW_FAULT_NONE, FAULT_RAMP, NULL, {0}, END_S, 0},
    {"demagnetisation",
     "of the flux",
     DQW_FAULT_DEMAGNETISATION,
     FAULT_RAMP,
     "nonideal.demagnetisation",
     {0.03, 0.05, 0.1},
     END_S,
     0},
    {"turn_short", "of a phase", DQW_FAULT_TURN_SHORT, FAULT_RAMP, "nonideal.turn_short", {0.03, 0.05, 0.1}, END_S, 0},
    {"phase_connection",
     "ohm",
     DQW_FAULT_PHASE_CONNECTION,
     FAULT_RAMP,
     "nonideal.phase_connection_ohm",
     {0.05, 0.1, 0.25},
     END_S,
     0},
    {"current_offset",
     "A",
     DQW_FAULT_CURRENT_OFFSET,
     FAULT_RAMP,
     "nonideal.current_offset_alpha_A",
     {0.1, 0.2, 0.5},
     END_S,
     0},
    {"current_gain",
     "of a sensor",
     DQW_FAULT_CURRENT_GAIN,
     FAULT_RAMP,
     "nonideal.current_gain_a",
     {0.05, 0.1, 0.2},
     END_S,
     0},
    {"encoder_offset",
     "rad",
     DQW_FAULT_ENCODER_OFFSET,
     FAULT_RAMP,
     "nonideal.angle_offset_rad",
     {0.03, 0.05, 0.1},
     END_S,
     0},
    {"inverter_fault", "V, 0.24 before", DQW_FAULT_INVERTER_FAULT, FAULT_DEAD_TIME, NULL, {0.36, 0.48, 0.72}, END_S, 0},
    {"over_temperature", "K/s", DQW_FAULT_OVER_TEMPERATURE, FAULT_HEAT, NULL, {0.7, 1, 1.4}, END_S, 0},
    {"bearing_wear",
     "Nm",
     DQW_FAULT_BEARING_WEAR,
     FAULT_RAMP,
     "nonideal.bearing_Nm",
     {0.1, 0.2, 0.3},
     BEARING_END_S,
     0},
    {"bearing_wear, load 0.1",
     "Nm",
     DQW_FAULT_BEARING_WEAR,
     FAULT_RAMP,
     "nonideal.bearing_Nm",
     {0.1, 0.2, 0.3},
     BEARING_END_S,
     0.1},
    {"resistance_rise", "of R", DQW_FAULT_RESISTANCE_RISE, FAULT_RESISTANCE, NULL, {0.05, 0.1, 0.2}, END_S, 0},
};

// What many logs of one fault and severity gave.
typedef struct {
    int logs, told, right, early;
    int named[DQW_FAULT_NAMES],
        later[DQW_FAULT_NAMES];  // the first event after the fault; every further one by another name
    double delay_s, worst_s;
} outcome;

static void set(dqw_sim_scenario *s, const char *key, const char *part, double value)
{
    char path[100];
    char text[40];
    snprintf(path, sizeof path, "%s%s", key, part);
    snprintf(text, sizeof text, "%.9g", value);
    if (dqw_sim_set(s, path, text) != 0) exit(1);
}

// Starts a few kelvin below the limit, and heats at about `rate` all along: a copper of so little mass.
static void heat(dqw_sim_scenario *s, double rate_K_s)
{
    const double copper_W = 5.1;  // of this machine, at this load
    s->nonideal.winding_alpha_per_K.value = 0.0039;
    s->machine.winding_heat_J_K = copper_W / rate_K_s;
    s->machine.magnet_heat_J_K = 1e3;
    s->machine.temp_start_C = s->machine.temp_ref_C + LIMIT_K - 2.5 * rate_K_s;
}

static double start_of(const fault_case *c)
{
    return c->expected == DQW_FAULT_BEARING_WEAR ? BEARING_START_S : START_S;
}

static dqw_sim_scenario scenario(const fault_case *c, double severity, int seed, double noise)
{
    dqw_sim_scenario s = joint_scenario(seed, noise, c->duration_s);
    s.rtol = 1e-6;  // of currents: a thousandth of the noise
    s.nonideal.dead_time_V.value = DEAD_TIME_V;
    s.nonideal.dead_time_width_A = 0.05;
    s.machine.coulomb_Nm = 0.02;
    s.machine.coulomb_width_rad_s = 1;
    if (c->load_Nm > 0) s.profile.load_Nm.random = c->load_Nm;
    const dqw_sim_ramp ramp = {severity, start_of(c), start_of(c) + GROWS_S};
    switch (c->kind) {
    case FAULT_RAMP:
        if (c->key == NULL) break;
        set(&s, c->key, ".t_end_s", ramp.t_end_s);
        set(&s, c->key, ".t_start_s", ramp.t_start_s);
        set(&s, c->key, "", severity);
        s.nonideal.turn_short_ohm = 0.05;
        break;
    case FAULT_RESISTANCE:  // one kelvin above the reference, so that alpha is the part by which R grows
        s.machine.temp_start_C = s.machine.temp_ref_C + 1;
        s.nonideal.winding_alpha_per_K = ramp;
        break;
    case FAULT_HEAT: heat(&s, severity); break;
    case FAULT_DEAD_TIME: break;  // joined: a ramp starts at zero
    }
    return s;
}

static joint_log log_of(const fault_case *c, double severity, int seed, double noise)
{
    dqw_sim_scenario s = scenario(c, severity, seed, noise);
    if (c->kind != FAULT_DEAD_TIME) return joint_run(&s);
    s.duration_s = START_S;
    joint_log log = joint_run(&s);
    s.nonideal.dead_time_V.value = severity;
    s.duration_s = c->duration_s;
    const joint_log after = joint_run(&s);
    memcpy(after.row, log.row, log.count * sizeof *log.row);
    free(log.row);
    return after;
}

// When the fault is there: for heat, when the winding passes the limit.
static double fault_at_s(const fault_case *c, const joint_log *log)
{
    if (c->kind != FAULT_HEAT) return start_of(c);
    for (size_t k = 0; k < log->count; k++)
        if (log->row[k].temp_winding_C > 25 + LIMIT_K) return log->row[k].t_s;
    return log->row[log->count - 1].t_s;
}

static dqw_monitor_config monitor_of(const fault_case *c)
{
    const dqw_sim_scenario s = joint_scenario(1, 0, 1);
    dqw_monitor_config m = {.estimator = joint_in_service(&s.machine, 0.05), .J_kgm2 = (float)s.machine.J_kgm2};
    if (c->kind == FAULT_HEAT) {
        m.commissioned = true;
        m.band[DQW_WATCH_TEMPERATURE] = (float)LIMIT_K;
        m.estimator.R_ohm = (float)s.machine.R_ohm;
        m.estimator.Ld_H = (float)s.machine.Ld_H;
        m.estimator.Lq_H = (float)s.machine.Lq_H;
        m.estimator.psi_Wb = (float)s.machine.psi_Wb;
    }
    return m;
}

static void count(outcome *o, const fault_case *c, const dqw_monitor_change *e, double after_s, bool *told)
{
    const bool right = e->fault.name == c->expected &&
                       e->fault.phase == 0;  // every fault of one phase is one of phase a
    if (after_s < 0 || c->expected == DQW_FAULT_NONE) {
        o->early++;
    } else if (!*told) {
        *told = true;
        o->told++;
        o->right += right;
        o->named[e->fault.name]++;
        o->delay_s += after_s;
        o->worst_s = fmax(o->worst_s, after_s);
    } else if (!right) {
        o->later[e->fault.name]++;
    }
}

static void watch(outcome *o, const fault_case *c, const joint_log *log, int seed, double severity, bool events,
                  bool q15)
{
    const dqw_monitor_config config = monitor_of(c);
    const double fault_s = fault_at_s(c, log);
    bool told = false;
    static either_monitor m;
    if (either_init(&m, &config, q15) != DQW_OK) exit(1);
    for (size_t k = 0; k < log->count; k++) {
        const dqw_sample x = joint_sample(&log->row[k]);
        const double t_s = log->row[k].t_s;
        if (c->kind == FAULT_DEAD_TIME && k > 0 && t_s >= START_S && log->row[k - 1].t_s < START_S) either_jump(&m);
        dqw_monitor_change e;
        if (!either_step(&m, &config, &x, &e)) continue;
        if (events)
            printf("  %s %g seed %d: %.3f s (since %.3f; fault at %.3f) %s %g +- %.2g, %s %.2f phase %d\n", c->name,
                   severity, seed, t_s, (double)e.since * (double)config.estimator.dt_s, fault_s,
                   dqw_parameter_text(e.parameter), (double)e.value, (double)e.sd, dqw_fault_text(e.fault.name),
                   (double)e.fault.confidence, e.fault.phase);
        count(o, c, &e, t_s - fault_s, &told);
    }
    o->logs++;
    if (events && !told && c->expected != DQW_FAULT_NONE)
        printf("  %s %g seed %d: not told, stage %d\n", c->name, severity, seed, (int)either_stage(&m)->name);
}

static void print_names(const char *before, const int named[], int but)
{
    for (int i = 0; i < DQW_FAULT_NAMES; i++)
        if (named[i] > 0 && i != but) printf(" %s%s %d", before, dqw_fault_text((enum dqw_fault_name)i), named[i]);
}

static void print(const fault_case *c, double severity, const outcome *o)
{
    char size[40] = "";
    if (c->key || c->kind != FAULT_RAMP) snprintf(size, sizeof size, "%g %s", severity, c->unit);
    printf("| %-25s | %-19s | %3d of %3d | ", c->name, size, o->told, o->logs);
    if (o->told > 0)
        printf("%5.2f | %5.2f | %5.0f |", o->delay_s / o->told, o->worst_s, 100.0 * o->right / o->told);
    else
        printf("      |       |       |");
    print_names("", o->named, (int)c->expected);
    print_names("later ", o->later, -1);
    printf(" | %d |\n", o->early);
    fflush(stdout);
}

static void one_case(const fault_case *c, int seeds, double noise, bool events, bool q15)
{
    if (c->expected == DQW_FAULT_BEARING_WEAR && seeds > BEARING_SEEDS) seeds = BEARING_SEEDS;
    for (int v = 0; v < SEVERITIES; v++) {
        outcome o = {0};
        for (int seed = 1; seed <= seeds; seed++) {
            const joint_log log = log_of(c, c->severity[v], seed, noise);
            watch(&o, c, &log, seed, c->severity[v], events, q15);
            free(log.row);
        }
        print(c, c->severity[v], &o);
        if (c->expected == DQW_FAULT_NONE) return;
    }
}

int main(int argc, char **argv)
{
    const int seeds = (int)joint_number(argc, argv, "--seeds", joint_flag(argc, argv, "--quick") ? 3 : 20);
    const double noise = atof(joint_option(argc, argv, "--noise", "0.01"));
    const char *only = joint_option(argc, argv, "--only", NULL);
    printf("Faults of the joint, %g %% noise, healthy until %g s (friction: 16 s), %d seeds (friction: 5): told, how "
           "long after the fault (s), by the right "
           "name (%%),\n"
           "by which others (\"later\": by a further event), and events before the fault\n\n",
           100 * noise, START_S, seeds);
    printf(
        "| fault                     | severity            | told       | mean  | worst | right | others | before |\n");
    printf(
        "| ------------------------- | ------------------- | ---------- | ----: | ----: | ----: | ------ | -----: |\n");
    for (size_t f = 0; f < sizeof CASES / sizeof CASES[0]; f++)
        if (only == NULL || strncmp(only, CASES[f].name, strlen(only)) == 0)
            one_case(&CASES[f], seeds, noise, joint_flag(argc, argv, "--events"), joint_flag(argc, argv, "--q15"));
    return 0;
}
