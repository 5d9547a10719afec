// On every simulated drive that moves: what nominal values that are absent or wrong change of the result after a
// second, and how sure the estimator is of when a voltage acts. What stands on the nameplate is given, and noise of 1,
// 5 and 20 %. Options: --seeds N (5).
#include "dqw_number.h"
#include "joint.h"
#include "sim_sensor.h"

enum { SCENARIOS = 8, LEVELS = 3, FACTORS = 3, WAYS = 8 };

#define DURATION_S 1.0

static const char *const NAMES[SCENARIOS] = {"paper_step",       "servo_ideal",        "robot_joint",
                                             "joint_24v",        "traction_ipm",       "traction_ipm_linear",
                                             "effect_dead_time", "effect_angle_offset"};
static const double NOISE[LEVELS] = {0.01, 0.05, 0.2};
static const double FACTOR[FACTORS] = {0, 10, 0.1};

// Which voltage comes with a sample: its own period's or the next one's, as a mean in the rotating frame, or held in
// the stationary one and given in the sample's.
typedef struct {
    bool said_next, is_next, held;
} acting;

// Runs, and what was said of when the voltage acts: at their ends, and wrongly at any time.
typedef struct {
    int runs, right, unknown, wrong, ever_wrong;
    double known_s, latest_s;
} answers;

// Distance to the result with right nominal values, in its deviations; runs in which something that should be known is
// not.
typedef struct {
    double worst[FACTORS], square;
    int count, lost;
} distances;

typedef struct {
    dqw_sim_scenario s;
    joint_log truth, noisy;
    double w_base_rad_s;
} drive;

static dqw_sim_scenario scenario_of(const char *name, int seed)
{
    const dqw_sim_scenario *found = dqw_sim_scenario_find(name);
    if (found == NULL) exit(1);
    dqw_sim_scenario s = *found;
    const dqw_sim_noise none = {.seed = 0};
    s.seed = (uint64_t)seed;
    s.noise = none;
    s.rtol = fmax(s.rtol, 1e-7);
    s.duration_s = DURATION_S + 10 * s.drive.dt_s;
    return s;
}

static drive drive_of(const char *name, int seed)
{
    drive d = {.s = scenario_of(name, seed)};
    d.truth = joint_run(&d.s);
    d.noisy = d.truth;
    d.noisy.row = malloc(d.truth.count * sizeof *d.truth.row);
    if (d.noisy.row == NULL) exit(1);
    for (size_t k = 0; k < d.truth.count; k++) d.w_base_rad_s = fmax(d.w_base_rad_s, fabs(d.truth.row[k].w_m_rad_s));
    return d;
}

static void free_drive(const drive *d)
{
    free(d->truth.row);
    free(d->noisy.row);
}

static void make_noisy(drive *d, double noise, int seed)
{
    dqw_sim_scenario s = d->s;
    s.noise.i = s.noise.v = s.noise.w = noise;
    s.noise.seed = (uint64_t)(1000 + seed);
    memcpy(d->noisy.row, d->truth.row, d->truth.count * sizeof *d->truth.row);
    dqw_sim_sensor_log(&s, d->noisy.row, d->noisy.count);
}

// What the nameplate says, and the nominal values times `factor`; 0: absent.
static dqw_estimator_config config_of(const drive *d, double factor)
{
    const dqw_sim_machine *m = &d->s.machine;
    const dqw_nameplate plate = {.dt_s = (float)d->s.drive.dt_s,
                                 .v_V = (float)(d->s.drive.v_dc_V / sqrt(3)),
                                 .i_A = (float)d->s.drive.i_max_A,
                                 .w_m_rad_s = (float)d->w_base_rad_s,
                                 .pole_pairs = (uint16_t)m->pole_pairs};
    dqw_estimator_config c = dqw_estimator_config_default(&plate);
    c.R_ohm = (float)(factor * m->R_ohm);
    c.Ld_H = (float)(factor * m->Ld_H);
    c.Lq_H = (float)(factor * m->Lq_H);
    c.psi_Wb = (float)(factor * m->psi_Wb);
    return c;
}

static dqw_estimator learned(const drive *d, double factor)
{
    static dqw_estimator_config c;
    c = config_of(d, factor);
    dqw_estimator e;
    if (dqw_estimator_init(&e, &c) != DQW_OK) exit(1);
    for (size_t k = 0; k < d->noisy.count; k++) {
        const dqw_sample x = joint_sample(&d->noisy.row[k]);
        joint_learn(&e, &x);
    }
    return e;
}

static void add_distances(const drive *d, distances *sum)
{
    dqw_reading right[DQW_PARAMETERS];
    const dqw_estimator a = learned(d, 1);
    for (int i = 0; i < DQW_PARAMETERS; i++) right[i] = dqw_estimator_read(&a, (enum dqw_parameter)i);
    for (int f = 0; f < FACTORS; f++) {
        const dqw_estimator b = learned(d, FACTOR[f]);
        for (int i = 0; i < DQW_PARAMETERS; i++) {
            const dqw_reading r = dqw_estimator_read(&b, (enum dqw_parameter)i);
            const bool known = right[i].sd < DQW_UNKNOWN;
            sum->lost += known != (r.sd < DQW_UNKNOWN);
            if (!known) continue;
            const double apart = fabs((double)(r.value - right[i].value)) / (double)right[i].sd;
            sum->worst[f] = fmax(sum->worst[f], apart);
            sum->square += apart * apart;
            sum->count++;
        }
    }
}

static dqw_sample sample_of(const drive *d, size_t k, const acting *a)
{
    const dqw_sim_row *now = &d->noisy.row[k];
    const dqw_sim_row *acts = &d->noisy.row[k + a->is_next];
    const double middle_rad = acts->theta_e_rad + 0.5 * d->s.machine.pole_pairs * acts->w_m_rad_s * d->s.drive.dt_s;
    const double turn = a->held ? middle_rad - now->theta_e_rad : 0;
    dqw_sample x = joint_sample(now);
    x.v_d_V = (float)(cos(turn) * acts->v_d_V - sin(turn) * acts->v_q_V);
    x.v_q_V = (float)(sin(turn) * acts->v_d_V + cos(turn) * acts->v_q_V);
    return x;
}

static void add_answer(const drive *d, const acting *a, answers *sum)
{
    dqw_estimator_config c = config_of(d, 1);
    c.voltage_next = a->said_next;
    c.voltage_held = a->held;
    const enum dqw_voltage_acts truth = a->is_next ? DQW_VOLTAGE_NEXT : DQW_VOLTAGE_NOW;
    enum dqw_voltage_acts acts = DQW_VOLTAGE_NOT_KNOWN;
    bool ever_wrong = false;
    double known_s = -1;
    dqw_estimator e;
    if (dqw_estimator_init(&e, &c) != DQW_OK) exit(1);
    for (size_t k = 0; k + 1 < d->noisy.count; k++) {
        const dqw_sample x = sample_of(d, k, a);
        if (!(dqw_estimator_sample(&e, &x, false) & DQW_EVENT_BLOCK)) continue;
        (void)dqw_estimator_background(&e);
        acts = dqw_estimator_voltage_acts(&e);
        if (acts == truth && known_s < 0) known_s = d->noisy.row[k].t_s;
        ever_wrong = ever_wrong || (acts != truth && acts != DQW_VOLTAGE_NOT_KNOWN);
    }
    sum->runs++;
    sum->ever_wrong += ever_wrong;
    sum->right += acts == truth;
    sum->unknown += acts == DQW_VOLTAGE_NOT_KNOWN;
    sum->wrong += acts != truth && acts != DQW_VOLTAGE_NOT_KNOWN;
    if (acts != truth) return;
    sum->known_s += known_s;
    sum->latest_s = fmax(sum->latest_s, known_s);
}

static void print_distances(const char *name, double noise, const distances *d)
{
    printf("| %-19s | %3.0f %% |", name, 100 * noise);
    for (int f = 0; f < FACTORS; f++) printf(" %6.3f |", d->worst[f]);
    printf(" %6.3f | %4d |\n", d->count > 0 ? sqrt(d->square / d->count) : 0, d->lost);
}

static void print_answers(const char *name, double noise, const answers *a)
{
    printf("| %-19s | %3.0f %% | %4d | %5d | %7d | %5d | %10d |", name, 100 * noise, a->runs, a->right, a->unknown,
           a->wrong, a->ever_wrong);
    if (a->right > 0)
        printf(" %5.2f | %5.2f |\n", a->known_s / a->right, a->latest_s);
    else
        printf("       |       |\n");
}

static void one_scenario(int n, int seeds, distances apart[LEVELS], answers said[LEVELS])
{
    for (int seed = 1; seed <= seeds; seed++) {
        drive d = drive_of(NAMES[n], seed);
        for (int l = 0; l < LEVELS; l++) {
            make_noisy(&d, NOISE[l], seed);
            add_distances(&d, &apart[l]);
            for (unsigned way = 0; way < WAYS; way++) {
                const acting a = {(way & 1u) != 0, (way & 2u) != 0, (way & 4u) != 0};
                add_answer(&d, &a, &said[l]);
            }
        }
        free_drive(&d);
    }
}

int main(int argc, char **argv)
{
    const int seeds = (int)joint_number(argc, argv, "--seeds", 5);
    distances apart[SCENARIOS][LEVELS] = {{{{0}, 0, 0, 0}}};
    answers said[SCENARIOS][LEVELS] = {{{0, 0, 0, 0, 0, 0, 0}}};
    for (int n = 0; n < SCENARIOS; n++) one_scenario(n, seeds, apart[n], said[n]);

    printf("Nominal values absent, ten times too large, ten times too small: distance to the result with right ones "
           "after %g s, in its deviations, the\n"
           "worst of six parameters and %d seeds; RMS of all; parameters known to one alone\n\n",
           DURATION_S, seeds);
    printf("| scenario            | noise | absent | x 10   | x 0.1  | RMS    | lost |\n");
    printf("| ------------------- | ----: | -----: | -----: | -----: | -----: | ---: |\n");
    for (int n = 0; n < SCENARIOS; n++)
        for (int l = 0; l < LEVELS; l++) print_distances(NAMES[n], NOISE[l], &apart[n][l]);

    printf("\nWhen a voltage acts, at once or one period later, whatever the configuration says, held in the "
           "stationary frame or turned: what the\n"
           "estimator says after %g s; runs with a wrong answer at any time; when the right one was there, mean and "
           "latest, s\n\n",
           DURATION_S);
    printf("| scenario            | noise | runs | right | unknown | wrong | ever wrong | mean  | worst |\n");
    printf("| ------------------- | ----: | ---: | ----: | ------: | ----: | ---------: | ----: | ----: |\n");
    answers all[LEVELS] = {{0, 0, 0, 0, 0, 0, 0}};
    for (int n = 0; n < SCENARIOS; n++)
        for (int l = 0; l < LEVELS; l++) {
            const answers *a = &said[n][l];
            print_answers(NAMES[n], NOISE[l], a);
            all[l].runs += a->runs;
            all[l].right += a->right;
            all[l].unknown += a->unknown;
            all[l].wrong += a->wrong;
            all[l].ever_wrong += a->ever_wrong;
            all[l].known_s += a->known_s;
            all[l].latest_s = fmax(all[l].latest_s, a->latest_s);
        }
    for (int l = 0; l < LEVELS; l++) print_answers("all", NOISE[l], &all[l]);
    return 0;
}
