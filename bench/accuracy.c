// How near the estimator comes to the truth on the joint, sample by sample in one pass, from nominal values that are 30
// % wrong; and how often its intervals hold the truth. Options: --seeds N, --coverage N (runs; 0: leave it out), --csv
// DIR (only writes logs).
#include "joint.h"
#include "sim_sensor.h"

enum { LEVELS = 4, CSV_SEEDS = 3, AXES = 2 };

#define DURATION_S 2.0
#define DEAD_TIME_V 0.24
#define DEAD_TIME_WIDTH_A 0.05
#define NORMAL_95 1.96

static const double NOISE_PERCENT[LEVELS] = {0, 1, 5, 20};
static const double TARGET[LEVELS][JOINT_PARAMETERS] = {
    {0.5, 0.5, 0.5, 0.2}, {0.5, 1, 1, 0.2}, {0.5, 1, 1, 0.3}, {0.5, 1, 1, 0.3}};
static const double DEAD_TIME_TARGET_R = 2;

typedef struct {
    double value[JOINT_PARAMETERS], sd[JOINT_PARAMETERS];
    int unusable;  // of them
} estimate;

// What is learned with R, L_d, L_q and the flux, or left out.
typedef enum { PLAIN, NOISE_LEFT_IN, WITH_DEAD_TIME, WAYS } way;

// Squared errors in percent of the truth, means over the seeds; readings that were not usable. bound: for noise as
// large as the signals.
typedef struct {
    double off[WAYS][LEVELS][JOINT_PARAMETERS], bound[JOINT_PARAMETERS];
    int unusable[WAYS][LEVELS];
} squares;

// Parts of the runs, and mean (error/sd)^2.
typedef struct {
    double inside[JOINT_PARAMETERS], square[JOINT_PARAMETERS];
} cover;

static dqw_sim_scenario clean(int seed) { return joint_scenario(seed, 0, DURATION_S); }

static dqw_sim_scenario with_dead_time(int seed)
{
    dqw_sim_scenario s = clean(seed);
    s.nonideal.dead_time_V.value = DEAD_TIME_V;
    s.nonideal.dead_time_width_A = DEAD_TIME_WIDTH_A;
    return s;
}

// The same run with noise: it is in the log alone, so that one simulation serves every level.
static void make_noisy(const dqw_sim_scenario *s, double noise, const joint_log *truth, joint_log *log)
{
    dqw_sim_scenario noisy = *s;
    noisy.noise.i = noisy.noise.v = noisy.noise.w = noise;
    memcpy(log->row, truth->row, truth->count * sizeof *truth->row);
    dqw_sim_sensor_log(&noisy, log->row, log->count);
}

static joint_log room_for(const joint_log *truth)
{
    const joint_log log = {.count = truth->count, .row = malloc(truth->count * sizeof *truth->row)};
    if (log.row == NULL) exit(1);
    return log;
}

static estimate estimate_of(const dqw_sim_machine *m, const joint_log *log, way how)
{
    dqw_estimator_config config = joint_estimator(m);
    config.noise_on_inputs = how != NOISE_LEFT_IN;
    config.dead_time_width_A = how == WITH_DEAD_TIME ? (float)DEAD_TIME_WIDTH_A : 0.0f;
    config.angle = config.encoder_offset = how == WITH_DEAD_TIME;
    dqw_estimator estimator;
    if (dqw_estimator_init(&estimator, &config) != DQW_OK) exit(1);
    for (size_t k = 0; k < log->count; k++) {
        const dqw_sample x = joint_sample(&log->row[k]);
        joint_learn(&estimator, &x);
    }
    estimate e = {.unusable = 0};
    for (int i = 0; i < JOINT_PARAMETERS; i++) {
        const dqw_reading r = dqw_estimator_read(&estimator, (enum dqw_parameter)i);
        e.value[i] = (double)r.value;
        e.sd[i] = (double)r.sd;
        e.unusable += !r.usable;
    }
    return e;
}

// Standard deviations of the signals over a log: i_d, i_q, w_m, v_d, v_q.
enum { SIGNAL_ID, SIGNAL_IQ, SIGNAL_W, SIGNAL_VD, SIGNAL_VQ, SIGNALS };

static void deviations(const joint_log *log, double sd[SIGNALS])
{
    double mean[SIGNALS] = {0};
    double square[SIGNALS] = {0};
    for (size_t k = 0; k < log->count; k++) {
        const dqw_sim_row *r = &log->row[k];
        const double x[SIGNALS] = {r->i_d_A, r->i_q_A, r->w_m_rad_s, r->v_d_V, r->v_q_V};
        for (int i = 0; i < SIGNALS; i++) {
            mean[i] += x[i] / (double)log->count;
            square[i] += x[i] * x[i] / (double)log->count;
        }
    }
    for (int i = 0; i < SIGNALS; i++) sd[i] = sqrt(square[i] - mean[i] * mean[i]);
}

// What the noise of i_d, i_q and w_m at a pair's first row and at its second one adds to the equation of one axis,
// times that noise's deviation.
typedef struct {
    double first[3], second[3];
} pair_noise;

static pair_noise noise_of(const dqw_sim_machine *m, const dqw_sim_row *a, const dqw_sim_row *b, double dt_s, int axis,
                           const double sd[SIGNALS])
{
    const double half_p = 0.5 * m->pole_pairs;
    const double sign = axis == 0 ? 1 : -1;
    const double own = axis == 0 ? m->Ld_H : m->Lq_H;
    const double cross = sign * half_p * (axis == 0 ? m->Lq_H : m->Ld_H);
    const double flux = axis == 0 ? 0 : half_p * m->psi_Wb;
    const int other = axis == 0 ? SIGNAL_IQ : SIGNAL_ID;
    pair_noise n = {{0}, {0}};
    n.first[axis] = sd[axis] * (-0.5 * m->R_ohm + own / dt_s);
    n.second[axis] = sd[axis] * (-0.5 * m->R_ohm - own / dt_s);
    n.first[other] = sd[other] * cross * a->w_m_rad_s;
    n.second[other] = sd[other] * cross * b->w_m_rad_s;
    n.first[SIGNAL_W] = sd[SIGNAL_W] * (cross * (axis == 0 ? a->i_q_A : a->i_d_A) - flux);
    n.second[SIGNAL_W] = sd[SIGNAL_W] * (cross * (axis == 0 ? b->i_q_A : b->i_d_A) - flux);
    return n;
}

// Inputs of a pair's equation on one axis, each times its parameter: the information is about relative errors.
static void relative_inputs(const dqw_sim_machine *m, const dqw_sim_row *a, const dqw_sim_row *b, double dt_s, int axis,
                            double x[JOINT_PARAMETERS])
{
    const double half_p = 0.5 * m->pole_pairs;
    const bool d = axis == 0;
    x[DQW_R] = 0.5 * m->R_ohm * (d ? a->i_d_A + b->i_d_A : a->i_q_A + b->i_q_A);
    x[DQW_LD] = m->Ld_H *
                (d ? (b->i_d_A - a->i_d_A) / dt_s : half_p * (a->w_m_rad_s * a->i_d_A + b->w_m_rad_s * b->i_d_A));
    x[DQW_LQ] = m->Lq_H *
                (d ? -half_p * (a->w_m_rad_s * a->i_q_A + b->w_m_rad_s * b->i_q_A) : (b->i_q_A - a->i_q_A) / dt_s);
    x[DQW_PSI] = d ? 0 : half_p * m->psi_Wb * (a->w_m_rad_s + b->w_m_rad_s);
}

// One axis' X' S^-1 X for noise as large as the signals. The tridiagonal S = C C' is factored, and C z = x solved, row
// by row.
static void add_information(const dqw_sim_scenario *s, const joint_log *truth, int axis,
                            double info[JOINT_PARAMETERS][JOINT_PARAMETERS])
{
    const double dt_s = s->drive.dt_s;
    double sd[SIGNALS];
    deviations(truth, sd);
    double z[JOINT_PARAMETERS] = {0};
    double diagonal = 1;
    pair_noise last = {{0}, {0}};
    for (size_t k = 0; k + 1 < truth->count; k++) {
        const dqw_sim_row *row = &truth->row[k];
        const pair_noise n = noise_of(&s->machine, &row[0], &row[1], dt_s, axis, sd);
        double variance = sd[SIGNAL_VD + axis] * sd[SIGNAL_VD + axis];
        double shared = 0;
        for (int i = 0; i < 3; i++) {
            variance += n.first[i] * n.first[i] + n.second[i] * n.second[i];
            shared += last.second[i] * n.first[i];
        }
        const double below = shared / diagonal;
        diagonal = sqrt(variance - below * below);
        double x[JOINT_PARAMETERS];
        relative_inputs(&s->machine, &row[0], &row[1], dt_s, axis, x);
        for (int i = 0; i < JOINT_PARAMETERS; i++) z[i] = (x[i] - below * z[i]) / diagonal;
        for (int i = 0; i < JOINT_PARAMETERS; i++)
            for (int j = 0; j < JOINT_PARAMETERS; j++) info[i][j] += z[i] * z[j];
        last = n;
    }
}

// Replaces a positive definite matrix by its inverse, by Gauss and Jordan in place.
static void invert(double a[JOINT_PARAMETERS][JOINT_PARAMETERS])
{
    for (int k = 0; k < JOINT_PARAMETERS; k++) {
        const double pivot = a[k][k];
        a[k][k] = 1;
        for (int j = 0; j < JOINT_PARAMETERS; j++) a[k][j] /= pivot;
        for (int i = 0; i < JOINT_PARAMETERS; i++) {
            if (i == k) continue;
            const double part = a[i][k];
            a[i][k] = 0;
            for (int j = 0; j < JOINT_PARAMETERS; j++) a[i][j] -= part * a[k][j];
        }
    }
}

// Cramér-Rao bound of the relative variances. The equations of consecutive pairs are linear in R, L_d, L_q and psi;
// their errors are
// Gaussian, and neighbours share a row's noise. It is the bound of an estimator that is told the true currents and
// speed as its regressors, while its equations' errors hold all their noise. Left out: that both axes share the noise
// of one row, which would make it a few percent lower. It grows with the square of the noise, so that one level tells
// all.
static void bound(const dqw_sim_scenario *s, const joint_log *truth, double variance[JOINT_PARAMETERS])
{
    double info[JOINT_PARAMETERS][JOINT_PARAMETERS] = {{0}};
    for (int axis = 0; axis < AXES; axis++) add_information(s, truth, axis, info);
    invert(info);
    for (int i = 0; i < JOINT_PARAMETERS; i++) variance[i] = info[i][i];
}

static void add_error(const dqw_sim_machine *m, const estimate *e, int seeds, double square[JOINT_PARAMETERS])
{
    for (int i = 0; i < JOINT_PARAMETERS; i++) {
        const double off = 100 * (e->value[i] / joint_truth(m, i) - 1);
        square[i] += off * off / seeds;
    }
}

static void one_seed(int seed, int seeds, squares *sum)
{
    const dqw_sim_scenario s = clean(seed);
    const dqw_sim_scenario dead = with_dead_time(seed);
    const joint_log truth = joint_run(&s);
    const joint_log dead_truth = joint_run(&dead);
    joint_log log = room_for(&truth);
    double variance[JOINT_PARAMETERS];
    bound(&s, &truth, variance);
    for (int i = 0; i < JOINT_PARAMETERS; i++) sum->bound[i] += 1e4 * variance[i] / seeds;
    for (int l = 0; l < LEVELS; l++)
        for (int how = 0; how < WAYS; how++) {
            const bool is_dead = how == WITH_DEAD_TIME;
            make_noisy(is_dead ? &dead : &s, NOISE_PERCENT[l] / 100, is_dead ? &dead_truth : &truth, &log);
            const estimate e = estimate_of(&s.machine, &log, (way)how);
            add_error(&s.machine, &e, seeds, sum->off[how][l]);
            sum->unusable[how][l] += e.unusable;
        }
    free(truth.row);
    free(dead_truth.row);
    free(log.row);
}

// A negative value stands for none.
static void print_row(double noise_percent, const char *name, const double value[JOINT_PARAMETERS], int unusable)
{
    printf("| %3.0f %% | %-22s |", noise_percent, name);
    for (int i = 0; i < JOINT_PARAMETERS; i++) {
        if (value[i] < 0)
            printf("       - |");
        else
            printf(" %7.4f |", value[i]);
    }
    if (unusable < 0)
        printf("          |\n");
    else
        printf(" %8d |\n", unusable);
}

static void print_errors(double noise_percent, const char *name, const double square[JOINT_PARAMETERS], int unusable)
{
    double rms[JOINT_PARAMETERS];
    for (int i = 0; i < JOINT_PARAMETERS; i++) rms[i] = sqrt(square[i]);
    print_row(noise_percent, name, rms, unusable);
}

static void print_level(const squares *sum, int l)
{
    const double noise = NOISE_PERCENT[l];
    const double dead_time_target[JOINT_PARAMETERS] = {DEAD_TIME_TARGET_R, -1, -1, -1};
    double limit[JOINT_PARAMETERS];
    double ratio[JOINT_PARAMETERS];
    for (int i = 0; i < JOINT_PARAMETERS; i++) {
        limit[i] = noise / 100 * sqrt(sum->bound[i]);
        ratio[i] = limit[i] > 0 ? sqrt(sum->off[PLAIN][l][i]) / limit[i] : -1;
    }
    print_errors(noise, "estimator", sum->off[PLAIN][l], sum->unusable[PLAIN][l]);
    print_row(noise, "target", TARGET[l], 0);
    print_row(noise, "bound", limit, -1);
    print_row(noise, "estimator over bound", ratio, -1);
    print_errors(noise, "inputs' noise left in", sum->off[NOISE_LEFT_IN][l], sum->unusable[NOISE_LEFT_IN][l]);
    print_errors(noise, "with dead time", sum->off[WITH_DEAD_TIME][l], sum->unusable[WITH_DEAD_TIME][l]);
    print_row(noise, "target with dead time", dead_time_target, -1);
}

static void accuracy(int seeds)
{
    squares sum = {.bound = {0}};
    for (int seed = 1; seed <= seeds; seed++) one_seed(seed, seeds, &sum);
    printf("Accuracy on the joint, %g s at 20 kHz, nominal values 30 %% wrong, noise on currents, voltages and speed: "
           "RMS error in %% over %d seeds;\n"
           "readings of all seeds and parameters that are not usable. Bound: Cramér-Rao. Dead time: %g V, not "
           "declared, learned with the rest\n\n",
           DURATION_S, seeds, DEAD_TIME_V);
    printf("| noise | estimator              | R       | L_d     | L_q     | flux    | unusable |\n");
    printf("| ----: | ---------------------- | ------: | ------: | ------: | ------: | -------: |\n");
    for (int l = 0; l < LEVELS; l++) print_level(&sum, l);
    fflush(stdout);
}

static void add_cover(const dqw_sim_machine *m, const estimate *e, int runs, cover *c)
{
    for (int i = 0; i < JOINT_PARAMETERS; i++) {
        const double off_sd = (e->value[i] - joint_truth(m, i)) / e->sd[i];
        c->inside[i] += fabs(off_sd) <= NORMAL_95 ? 1.0 / runs : 0;
        c->square[i] += off_sd * off_sd / runs;
    }
}

static void print_cover(double noise_percent, const cover *c)
{
    printf("| %3.0f %% |", noise_percent);
    for (int i = 0; i < JOINT_PARAMETERS; i++) printf(" %5.1f %% (%5.2f) |", 100 * c->inside[i], sqrt(c->square[i]));
    printf("\n");
}

static void coverage(int runs)
{
    cover c[LEVELS] = {{{0}, {0}}};
    for (int seed = 1; seed <= runs; seed++) {
        const dqw_sim_scenario s = clean(seed);
        const joint_log truth = joint_run(&s);
        joint_log log = room_for(&truth);
        for (int l = 1; l < LEVELS; l++) {
            make_noisy(&s, NOISE_PERCENT[l] / 100, &truth, &log);
            const estimate e = estimate_of(&s.machine, &log, PLAIN);
            add_cover(&s.machine, &e, runs, &c[l]);
        }
        free(truth.row);
        free(log.row);
    }
    printf("\nIts 95 %% intervals: share of %d runs in which they hold the truth (RMS of error over deviation). "
           "Wanted: 90 to 99 %%\n\n",
           runs);
    printf("| noise | R               | L_d             | L_q             | flux            |\n");
    printf("| ----: | --------------: | --------------: | --------------: | --------------: |\n");
    for (int l = 1; l < LEVELS; l++) print_cover(NOISE_PERCENT[l], &c[l]);
}

static void write_log(const char *folder, double noise_percent, int seed, const joint_log *log)
{
    char path[1000];
    const int length = snprintf(path, sizeof path, "%s/%g_%d.csv", folder, noise_percent, seed);
    FILE *out = length > 0 && (size_t)length < sizeof path ? fopen(path, "w") : NULL;
    if (out == NULL) {
        fprintf(stderr, "cannot write the log %s\n", path);
        exit(1);
    }
    fprintf(out, "t_s,v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s,theta_e_rad\n");
    for (size_t k = 0; k < log->count; k++) {
        const dqw_sim_row *r = &log->row[k];
        fprintf(out, "%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g\n", r->t_s, r->v_d_V, r->v_q_V, r->i_d_A, r->i_q_A,
                r->w_m_rad_s, r->theta_e_rad);
    }
    const bool failed = ferror(out) != 0;
    if (fclose(out) != 0 || failed) exit(1);
}

// FOLDER/PERCENT_SEED.csv, for peers. The folder exists.
static void write_logs(const char *folder)
{
    for (int seed = 1; seed <= CSV_SEEDS; seed++) {
        const dqw_sim_scenario s = clean(seed);
        const joint_log truth = joint_run(&s);
        joint_log log = room_for(&truth);
        for (int l = 0; l < LEVELS; l++) {
            make_noisy(&s, NOISE_PERCENT[l] / 100, &truth, &log);
            write_log(folder, NOISE_PERCENT[l], seed, &log);
        }
        free(truth.row);
        free(log.row);
    }
}

int main(int argc, char **argv)
{
    const char *folder = joint_option(argc, argv, "--csv", NULL);
    if (folder != NULL) {
        write_logs(folder);
        return 0;
    }
    const bool uncovered = strcmp(joint_option(argc, argv, "--coverage", ""), "0") == 0;
    const int seeds = (int)joint_number(argc, argv, "--seeds", 20);
    const int runs = uncovered ? 0 : (int)joint_number(argc, argv, "--coverage", 200);
    accuracy(seeds);
    if (runs > 0) coverage(runs);
    return 0;
}
