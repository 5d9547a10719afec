// Does the monitor stay quiet on healthy drives? Joint and servo motor, in pieces of 5 s: load, speed and excitation
// drawn anew for each, copper and magnet warming and cooling, steady sensor noise of 1 to 5 %. Every event is a false
// alarm, and is printed. Then an estimator that hears noise alone. Options: --samples N (1e7), --idle N (1e8), --first
// DRIVE (begins there), --lively (no piece is steady or at rest), --quick (1e6 each), --q15 (the monitor in whole
// numbers; the estimator at rest stays in float).
#include <time.h>

#include "either_monitor.h"
#include "dqw_number.h"
#include "joint.h"

enum { PIECES = 25, MACHINES = 2 };

#define PIECE_S 5.0
#define MAGNET_S 90.0  // time in which the magnet follows the winding
#define ALPHA 0.0039
#define BETA 0.001

typedef struct {
    const char *name;
    float v_base_V, i_base_A, w_base_rad_s;
    double load_Nm, speed_rad_s, current_A, binary_V, dead_V, dead_width_A, coulomb_Nm;
} machine_kind;

static const machine_kind MACHINE[MACHINES] = {
    {"joint_24v", 14, 6, 110, 0.35, 100, 3, 0.8, 0.24, 0.05, 0.02},
    {"servo_ideal", 185, 15, 200, 2, 180, 4, 10, 4, 0.15, 0.1},
};

// How a drive's copper goes, and what its sensors add.
typedef struct {
    int number;
    const machine_kind *machine;
    double noise, heating_K_s, hottest_K, cools_at_s, start_K;
    double sd[5];  // of the noise on v_d, v_q, i_d, i_q, w_m
    double copper_K, magnet_K;
    const char *asked, *before;  // what this piece and the last one asks
    bool lively;                 // never steady
    uint64_t random;
} drive;

static double now_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

// splitmix64: uniform in 0 .. 1.
static double uniform(uint64_t *state)
{
    uint64_t z = *state += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return (double)((z ^ z >> 31) >> 11) * 0x1p-53;
}

static double between(uint64_t *state, double low, double high) { return low + (high - low) * uniform(state); }

// Two normal numbers a draw: Marsaglia's polar method.
static void normal(uint64_t *state, double out[2])
{
    double x;
    double y;
    double s;
    do {
        x = between(state, -1, 1);
        y = between(state, -1, 1);
        s = x * x + y * y;
    } while (s >= 1 || s == 0);
    const double scale = sqrt(-2 * log(s) / s);
    out[0] = x * scale;
    out[1] = y * scale;
}

// One sensor noise a drive: `noise` times what the signals of its machine's own scenario vary by.
static void measure_noise(drive *d)
{
    dqw_sim_scenario s = *dqw_sim_scenario_find(d->machine->name);
    s.noise = (dqw_sim_noise){.seed = 0};
    s.duration_s = 1;
    s.rtol = 1e-6;
    const joint_log log = joint_run(&s);
    double sum[5] = {0};
    double square[5] = {0};
    for (size_t k = 0; k < log.count; k++) {
        const double x[5] = {log.row[k].v_d_V, log.row[k].v_q_V, log.row[k].i_d_A, log.row[k].i_q_A,
                             log.row[k].w_m_rad_s};
        for (int i = 0; i < 5; i++) {
            sum[i] += x[i];
            square[i] += x[i] * x[i];
        }
    }
    const double n = (double)log.count;
    for (int i = 0; i < 5; i++) d->sd[i] = d->noise * sqrt(square[i] / n - sum[i] / n * sum[i] / n);
    free(log.row);
}

static drive drive_of(int number)
{
    drive d = {.number = number,
               .machine = &MACHINE[number % MACHINES],
               .asked = "start",
               .random = 1000003u * (uint64_t)number + 7u};
    d.noise = between(&d.random, 0.01, 0.05);
    d.heating_K_s = between(&d.random, 0.3, 1);
    d.hottest_K = between(&d.random, 40, 100);
    // Every third cools again; every fifth begins hot.
    d.cools_at_s = number % 3 == 2 ? 80 : 1e9;
    d.copper_K = d.magnet_K = number % 5 == 4 ? 60 : 0;
    if (number % 5 == 4) d.cools_at_s = 10;
    measure_noise(&d);
    return d;
}

static void warm(drive *d, double t_s)
{
    const double step = d->heating_K_s * PIECE_S;
    d->copper_K = t_s < 5                ? d->copper_K
                  : t_s >= d->cools_at_s ? fmax(d->copper_K - step, 0)
                                         : fmin(d->copper_K + step, d->hottest_K);
    d->magnet_K += (d->copper_K - d->magnet_K) * (1 - exp(-PIECE_S / MAGNET_S));
}

// What is asked of the drive in this piece: mostly to and fro; now and then steady or at rest, with little injected.
static void ask(drive *d, dqw_sim_profile *p)
{
    const machine_kind *m = d->machine;
    const double kind = d->lively ? 0 : uniform(&d->random);
    d->before = d->asked;
    d->asked = kind > 0.95 ? "at rest" : kind > 0.9 ? "held" : kind > 0.7 ? "steady" : "to and fro";
    p->load_Nm = (dqw_sim_signal){.value = between(&d->random, -0.4, 0.4) * m->load_Nm,
                                  .random = between(&d->random, 0.1, 1) * m->load_Nm,
                                  .random_hold_s = between(&d->random, 0.02, 0.5)};
    p->speed_rad_s = (dqw_sim_signal){.wave = between(&d->random, 0.2, 1) * m->speed_rad_s,
                                      .wave_period_s = between(&d->random, 0.4, 2)};
    p->i_d_A.random = between(&d->random, 0.3, 1) * m->current_A;
    p->v_d_V.binary = p->v_q_V.binary = between(&d->random, 0.5, 1) * m->binary_V;
    if (kind > 0.7) {
        p->i_d_A.random = 0;
        p->v_d_V.binary = p->v_q_V.binary = 0.2 * m->binary_V;
        p->speed_rad_s.wave = 0;
        p->speed_rad_s.value = kind > 0.9 ? 0 : between(&d->random, -0.9, 0.9) * m->speed_rad_s;
    }
    if (kind > 0.95) p->load_Nm.value = p->load_Nm.random = 0;
}

// One piece, its temperatures moving on in straight lines: machine one kelvin above its reference, whose coefficients
// are ramps.
static joint_log piece(drive *d, int index)
{
    dqw_sim_scenario s = *dqw_sim_scenario_find(d->machine->name);
    const machine_kind *m = d->machine;
    const double R = 1 + ALPHA * d->copper_K;
    const double psi = 1 - BETA * d->magnet_K;
    warm(d, index * PIECE_S);
    s.duration_s = PIECE_S;
    s.seed = d->random;
    s.rtol = 1e-6;  // of currents: a thousandth of the noise
    s.noise = (dqw_sim_noise){.seed = 0};
    s.nonideal.dead_time_V.value = m->dead_V;
    s.nonideal.dead_time_width_A = m->dead_width_A;
    s.machine.coulomb_Nm = m->coulomb_Nm;
    s.machine.coulomb_width_rad_s = 1;
    s.machine.R_ohm *= R;
    s.machine.psi_Wb *= psi;
    s.machine.temp_start_C = s.machine.temp_ref_C + 1;
    s.nonideal.winding_alpha_per_K = (dqw_sim_ramp){(1 + ALPHA * d->copper_K) / R - 1, 0, PIECE_S};
    s.nonideal.magnet_beta_per_K = (dqw_sim_ramp){(1 - BETA * d->magnet_K) / psi - 1, 0, PIECE_S};
    ask(d, &s.profile);
    const joint_log log = joint_run(&s);
    for (size_t k = 0; k < log.count; k++) {
        double *const x[6] = {&log.row[k].v_d_V, &log.row[k].v_q_V,     &log.row[k].i_d_A,
                              &log.row[k].i_q_A, &log.row[k].w_m_rad_s, NULL};
        for (int i = 0; i < 6; i += 2) {
            double n[2];
            normal(&d->random, n);
            *x[i] += n[0] * d->sd[i];
            if (x[i + 1]) *x[i + 1] += n[1] * d->sd[i + 1];
        }
    }
    return log;
}

static dqw_monitor_config monitor_of(const machine_kind *kind)
{
    const dqw_sim_scenario *s = dqw_sim_scenario_find(kind->name);
    dqw_monitor_config m = {.estimator = joint_in_service(&s->machine, kind->dead_width_A),
                            .J_kgm2 = (float)s->machine.J_kgm2};
    m.estimator.dt_s = (float)s->drive.dt_s;
    m.estimator.v_base_V = kind->v_base_V;
    m.estimator.i_base_A = kind->i_base_A;
    m.estimator.w_base_rad_s = kind->w_base_rad_s;
    return m;
}

static void print_event(const drive *d, const dqw_monitor_change *e, double t_s)
{
    printf("| %5d | %-11s | %5.1f %% | %7.2f | %-11s | %10.4g +- %7.2g | %5d | %4.0f | %4.0f | %s, then %s |\n",
           d->number + 1, d->machine->name, 100 * d->noise, t_s, dqw_parameter_text(e->parameter), (double)e->value,
           (double)e->sd, (int)e->fault.name, d->copper_K, d->magnet_K, d->before, d->asked);
    fflush(stdout);
}

// Returns the events of one drive, `*left` samples at most.
static int one_drive(int number, bool lively, bool q15, double *left, double *spent_s)
{
    drive d = drive_of(number);
    d.lively = lively;
    const dqw_monitor_config config = monitor_of(d.machine);
    static either_monitor m;
    int events = 0;
    size_t before = 0;
    if (either_init(&m, &config, q15) != DQW_OK) exit(1);
    for (int i = 0; i<PIECES && * left> 0; i++) {
        const joint_log log = piece(&d, i);
        const double start_s = now_s();
        either_jump(&m);
        for (size_t k = 0; k < log.count; k++) {
            const dqw_sample x = joint_sample(&log.row[k]);
            dqw_monitor_change e;
            if (!either_step(&m, &config, &x, &e)) continue;
            events++;
            print_event(&d, &e, (double)(before + k) * (double)config.estimator.dt_s);
        }
        *spent_s += now_s() - start_s;
        before += log.count;
        *left -= (double)log.count;
        free(log.row);
    }
    const dqw_stage *stage = either_stage(&m);
    if (stage->name != DQW_STAGE_IN_SERVICE || stage->times_back > 0)
        printf("| %5d | %-11s | stage %d at the end, %u ways back\n", number + 1, d.machine->name, (int)stage->name,
               (unsigned)stage->times_back);
    return events;
}

// Noise alone: no current, no speed.
static void idle(double samples, bool taught)
{
    const dqw_sim_scenario s = joint_scenario(1, 0.01, 2);
    drive d = {.machine = &MACHINE[0], .noise = 0.01, .random = 3};
    const dqw_estimator_config config = joint_in_service(&s.machine, 0.05);
    dqw_estimator e;
    if (dqw_estimator_init(&e, &config) != DQW_OK) exit(1);
    if (taught) {
        const joint_log log = joint_run(&s);
        for (size_t k = 0; k < log.count; k++) {
            const dqw_sample x = joint_sample(&log.row[k]);
            joint_learn(&e, &x);
        }
        free(log.row);
    }
    dqw_estimator_missing(&e, 0);
    measure_noise(&d);
    double start[DQW_PARAMETERS];
    double most[DQW_PARAMETERS] = {0};
    for (int i = 0; i < DQW_PARAMETERS; i++) start[i] = (double)dqw_estimator_read(&e, (enum dqw_parameter)i).value;
    const double from_s = now_s();
    for (double k = 0; k < samples; k++) {
        double n[6];
        for (int i = 0; i < 6; i += 2) normal(&d.random, n + i);
        const dqw_sample x = dqw_sample_from_dq((float)(n[0] * d.sd[0]), (float)(n[1] * d.sd[1]),
                                                (float)(n[2] * d.sd[2]), (float)(n[3] * d.sd[3]),
                                                (float)(n[4] * d.sd[4]), 0.3f);
        if (!(dqw_estimator_sample(&e, &x, false) & DQW_EVENT_BLOCK)) continue;
        (void)dqw_estimator_background(&e);
        for (int i = 0; i < DQW_PARAMETERS; i++)
            most[i] = fmax(most[i], fabs((double)dqw_estimator_read(&e, (enum dqw_parameter)i).value - start[i]));
    }
    const double unit[DQW_PARAMETERS] = {
        s.machine.R_ohm, s.machine.Ld_H, s.machine.Lq_H, s.machine.psi_Wb, 0.24, s.machine.psi_Wb, 0.24};
    printf("%s, %g samples of noise at rest (%.0f s): largest change, and deviation at the end, %% of the truth (dead "
           "time: 0.24 V)\n",
           taught ? "After 2 s of learning" : "Never taught", samples, now_s() - from_s);
    for (int i = 0; i < DQW_PARAMETERS; i++) {
        const dqw_reading r = dqw_estimator_read(&e, (enum dqw_parameter)i);
        printf("  %-9s %9.4f   ", (const char *[]){"R", "L_d", "L_q", "flux", "dead time", "flux on q", "constant"}[i],
               100 * most[i] / unit[i]);
        if (r.sd < DQW_UNKNOWN)
            printf("%9.4g\n", 100 * (double)r.sd / unit[i]);
        else
            printf("not known\n");
    }
    fflush(stdout);
}

int main(int argc, char **argv)
{
    const long usual = joint_flag(argc, argv, "--quick") ? 1000000 : 10000000;
    double left = (double)joint_number(argc, argv, "--samples", usual);
    const double idle_samples = (double)joint_number(argc, argv, "--idle",
                                                     joint_flag(argc, argv, "--quick") ? 1000000 : 100000000);
    const double all = left;
    const bool q15 = joint_flag(argc, argv, "--q15");
    double spent_s = 0;
    int events = 0;
    const double start_s = now_s();
    printf("Healthy drives, %g samples%s: events, every one a false alarm\n\n", all, q15 ? ", in whole numbers" : "");
    printf("| drive | machine     | noise   | t (s)   | channel     | value                 | fault | copper, magnet "
           "(K) | pieces |\n");
    for (int number = (int)joint_number(argc, argv, "--first", 1) - 1; left > 0; number++)
        events += one_drive(number, joint_flag(argc, argv, "--lively"), q15, &left, &spent_s);
    const double took_s = now_s() - start_s;
    printf("\n%d events in %g samples. A simulated 1e7 samples take %.0f s, of these the monitor %.1f s.\n\n", events,
           all - left, took_s * 1e7 / (all - left), spent_s * 1e7 / (all - left));
    if (q15) return 0;
    idle(idle_samples / 10, false);
    idle(idle_samples, true);
    return 0;
}
