// The plant of the public firmware rombrew/phobia (its bench/blm.c, fetched by ./run, which says what the table is)
// against the simulator's.
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <blm.h>

#include "bench/strangers/ours.h"
#include "sim_modulation.h"

enum { PERIODS = 1430 };  // two turns of the current's vector

typedef struct motor {
    const char *name;
    double R_ohm, Ld_H, Lq_H, psi_Wb, J_kgm2, B_Nms_rad, v_dc_V, source_ohm;
    int pole_pairs;
    double current_A, w_e_rad_s;  // of the cases
} motor;

// The magnet's flux from turns a minute and volt, as blm_Kv_lambda.
#define FLUX(kv, pairs) (60 / (2 * 3.14159265358979323846 * 1.7320508075688772) / ((kv) * (pairs)))

static const motor rotomax = {"rotomax", 14.2e-3, 10e-6, 15e-6, FLUX(270, 14), 4e-4, 1e-4, 22, 0.1, 14, 40, 2500};
static const motor hub = {"hub", 0.24, 520e-6, 650e-6, FLUX(15, 15), 6e-3, 5e-4, 48, 0.5, 15, 10, 500};

enum shaft { LOCKED, HELD, FREE };

typedef struct setting {
    const motor *motor;
    enum shaft shaft;
    enum dqw_sim_modulation modulation;
    double dead_ns;
} setting;

typedef struct course {
    instant at[2 * PERIODS];  // middle and end of each period
} course;

typedef int duties[PERIODS][3];

static const double theta_start_rad = 0.3, unmoved_kgm2 = 1e9, turns_Hz = 40;
static const double two_pi = 6.283185307179586;

static double inertia(const setting *s) { return s->shaft == FREE ? s->motor->J_kgm2 : unmoved_kgm2; }
static double speed(const setting *s) { return s->shaft == LOCKED ? 0 : s->motor->w_e_rad_s; }

static blm_t theirs;
static double since_s;
static instant *theirs_middle;
static bool diodes;  // its own do not let go where the current crosses zero within the dead time

static instant theirs_now(void)
{
    return (instant){theirs.state[0], theirs.state[1], theirs.state[6], theirs.state[3] + two_pi * theirs.revol,
                     theirs.state[2]};
}

// Within its dead time a leg goes with the current's sign: about zero it alternates, and holds the current there.
static void commutate(void)
{
    double i_A[3];
    blm_DQ_ABC(theirs.state[3], theirs.state[0], theirs.state[1], &i_A[0], &i_A[1], &i_A[2]);
    for (int n = 0; n < 3; ++n)
        if (theirs.xdtu[n]) theirs.xfet[n] = i_A[n] < 0;
}

static void after_step(double dt_s)
{
    if (diodes) commutate();
    since_s += dt_s;
    if (fabs(since_s - 0.5 * theirs.pwm_dT) < 1e-12) *theirs_middle = theirs_now();
}

static void theirs_begin(const setting *s, double threshold_A, double step_s)
{
    const motor *x = s->motor;
    blm_enable(&theirs);
    theirs.Rs = x->R_ohm, theirs.Ld = x->Ld_H, theirs.Lq = x->Lq_H, theirs.lambda = x->psi_Wb;
    theirs.Zp = x->pole_pairs, theirs.Udc = x->v_dc_V, theirs.Rdc = x->source_ohm, theirs.Jm = inertia(s);
    theirs.Mq[0] = theirs.Mq[2] = theirs.Mq[3] = 0, theirs.Mq[1] = x->B_Nms_rad;
    theirs.Ct = 1e12;                           // no thermal drift
    theirs.adc_Toffset = theirs.adc_Tconv = 0;  // what it samples is not read
    theirs.pwm_deadtime = s->dead_ns * 1e-9;
    theirs.Dtol = threshold_A, theirs.sol_dT = step_s;
    blm_restart(&theirs);
    theirs.state[2] = speed(s), theirs.state[3] = theta_start_rad;
    theirs.proc_step = after_step;
}

// Length of a count of its timer, which counts to pwm_resolution and back.
static double count_s(void) { return theirs.pwm_dT / (2 * theirs.pwm_resolution); }

// The voltage that an ideal inverter would need for a current of constant size that turns through all angles.
static void decide(const setting *s, double t_s, const instant *now, int count[3])
{
    const motor *x = s->motor;
    const double turn = two_pi * turns_Hz, phase = turn * (t_s + 0.5 * theirs.pwm_dT), I = x->current_A,
                 i_d = I * cos(phase), i_q = I * sin(phase), w = now->w_e_rad_s;
    const double v_d = x->R_ohm * i_d - turn * x->Ld_H * i_q - w * x->Lq_H * i_q,
                 v_q = x->R_ohm * i_q + turn * x->Lq_H * i_d + w * (x->Ld_H * i_d + x->psi_Wb),
                 angle = now->theta_e_rad + 0.5 * theirs.pwm_dT * w;
    double duty[3];
    dqw_sim_modulate(s->modulation, cos(angle) * v_d - sin(angle) * v_q, sin(angle) * v_d + cos(angle) * v_q, x->v_dc_V,
                     duty);
    // Its timer takes less than pwm_minimal as no pulse.
    const int least = (int)(theirs.pwm_minimal * theirs.pwm_resolution / theirs.pwm_dT);
    for (int n = 0; n < 3; ++n) {
        count[n] = (int)floor(duty[n] * theirs.pwm_resolution + 0.5);
        if (count[n] < least) count[n] = 0;
    }
}

// `decides`: it sets the duties by its own angle as it goes, else it takes those given.
static void run_theirs(const setting *s, double threshold_A, double step_s, bool decides, duties count, course *out)
{
    theirs_begin(s, threshold_A, step_s);
    for (int k = 0; k < PERIODS; ++k) {
        const instant now = theirs_now();
        if (decides) decide(s, k * theirs.pwm_dT, &now, count[k]);
        theirs.pwm_A = count[k][0], theirs.pwm_B = count[k][1], theirs.pwm_C = count[k][2];
        since_s = 0, theirs_middle = &out->at[2 * k];
        blm_update(&theirs);
        out->at[2 * k + 1] = theirs_now();
    }
}

static dqw_sim_scenario scenario(const setting *s, enum dqw_sim_dead_side side, enum dqw_sim_method method)
{
    const motor *x = s->motor;
    dqw_sim_scenario o;
    memset(&o, 0, sizeof o);
    o.machine.pole_pairs = x->pole_pairs, o.machine.R_ohm = x->R_ohm, o.machine.Ld_H = x->Ld_H;
    o.machine.Lq_H = x->Lq_H, o.machine.psi_Wb = x->psi_Wb, o.machine.J_kgm2 = inertia(s);
    o.machine.B_Nms_rad = x->B_Nms_rad;
    o.inverter.modulation = s->modulation, o.inverter.source_ohm = x->source_ohm, o.inverter.link_F = theirs.Cdc;
    o.inverter.dead_side = side, o.inverter.dead_time_s = floor(s->dead_ns * 1e-9 / count_s()) * count_s();
    o.drive.dt_s = theirs.pwm_dT, o.drive.v_dc_V = x->v_dc_V, o.drive.i_max_A = x->current_A;
    o.profile.speed_start_rad_s = speed(s) / x->pole_pairs;
    o.rtol = 1e-8, o.method = method;
    return o;
}

static void run_ours(const setting *s, enum dqw_sim_dead_side side, enum dqw_sim_method method, duties count,
                     course *out)
{
    const dqw_sim_scenario x = scenario(s, side, method);
    ours o;
    int status = ours_init(&o, &x, theta_start_rad);
    for (int k = 0; k < PERIODS && status == 0; ++k) {
        double duty[3];
        for (int n = 0; n < 3; ++n) duty[n] = (double)count[k][n] / theirs.pwm_resolution;
        status = ours_period(&o, duty, &out->at[2 * k], &out->at[2 * k + 1]);
    }
    ours_free(&o);
    if (status) fprintf(stderr, "phobia: our plant ended with %d\n", status), exit(1);
}

typedef struct difference {
    double max, rms, link;  // max, rms: over the largest current; link: over the source
} difference;

static difference compare(const setting *s, const course *a, const course *b)
{
    difference o = {0, 0, 0};
    double largest = 0;
    for (int k = 0; k < 2 * PERIODS; ++k) {
        const instant *x = &a->at[k], *y = &b->at[k];
        const double d = hypot(x->i_d_A - y->i_d_A, x->i_q_A - y->i_q_A);
        largest = fmax(largest, hypot(x->i_d_A, x->i_q_A));
        o.max = fmax(o.max, d), o.rms += d * d;
        o.link = fmax(o.link, fabs(x->v_link_V - y->v_link_V) / s->motor->v_dc_V);
    }
    o.max /= largest, o.rms = sqrt(o.rms / (2 * PERIODS)) / largest;
    return o;
}

static duties counts;
static course reference, mine, other;
static const double its_threshold_A = 0.1, its_step_s = 5e-6, fine_s = 50e-9, finer_s = 10e-9;
static const double wanted = 0.01, its_dead_ns = 90;

// Theirs with diodes that let go.
static void run_resolved(const setting *s, course *out)
{
    diodes = true;
    run_theirs(s, 0, finer_s, false, counts, out);
    diodes = false;
}

static const char *name_of(enum dqw_sim_modulation kind)
{
    return kind == DQW_SIM_MODULATION_CENTRED ? "centred" : "clamped";
}

// One line of the table. Returns whether what must agree does.
static bool line(const setting *s)
{
    static const char *const shafts[] = {"locked", "held", "free"};
    run_theirs(s, its_threshold_A, fine_s, true, counts, &reference);
    run_ours(s, DQW_SIM_DEAD_LOWER, DQW_SIM_ADAMS, counts, &mine);
    const difference all = compare(s, &reference, &mine);
    run_ours(s, DQW_SIM_DEAD_LOWER, DQW_SIM_RK4, counts, &other);
    const difference rk4 = compare(s, &reference, &other);
    run_theirs(s, its_threshold_A, its_step_s, false, counts, &other);
    const difference step = compare(s, &reference, &other);
    run_theirs(s, 0, fine_s, false, counts, &other);
    const difference threshold = compare(s, &other, &mine);
    run_resolved(s, &other);
    const difference resolved = compare(s, &other, &mine);
    printf("| %-7s | %-6s | %-7s | %4.0f | %7.4f | %7.4f | %7.4f | %7.4f | %7.4f | %7.4f | %7.4f |\n", s->motor->name,
           shafts[s->shaft], name_of(s->modulation), s->dead_ns, 100 * all.max, 100 * all.rms, 100 * rk4.max,
           100 * all.link, 100 * threshold.max, 100 * resolved.max, 100 * step.max);
    fflush(stdout);
    return resolved.max <= wanted && (s->dead_ns > its_dead_ns || fmax(all.max, rk4.max) <= wanted);
}

// Clamped legs tell the sides apart: where all three switch, they differ by what the legs have in common.
static void sides(const setting *s)
{
    static const char *const names[] = {"both", "upper", "lower"};
    run_theirs(s, its_threshold_A, fine_s, true, counts, &reference);
    run_resolved(s, &other);
    for (int side = DQW_SIM_DEAD_BOTH; side <= DQW_SIM_DEAD_LOWER; ++side) {
        run_ours(s, (enum dqw_sim_dead_side)side, DQW_SIM_RK4, counts, &mine);
        const difference d = compare(s, &other, &mine);
        printf("| %-7s | %-7s | %-5s | %7.4f | %7.4f |\n", s->motor->name, name_of(s->modulation), names[side],
               100 * d.max, 100 * d.rms);
    }
}

int main(void)
{
    static const motor *const motors[] = {&rotomax, &hub};
    static const double dead_ns[] = {0, 90, 500};
    bool agree = true;
    puts("| motor   | shaft  | zero    | dead |   max   |   RMS   | by RK4  |  link   | no Dtol | diodes  |  step   |\n"
         "| ------- | ------ | ------- | ---: | ------: | ------: | ------: | ------: | ------: | ------: | ------: |");
    for (int n = 0; n < 2; ++n)
        for (int shaft = LOCKED; shaft <= FREE; ++shaft)
            for (int kind = DQW_SIM_MODULATION_CENTRED; kind <= DQW_SIM_MODULATION_CLAMPED_LOW; ++kind)
                for (int d = 0; d < 3; ++d) {
                    const setting s = {motors[n], (enum shaft)shaft, (enum dqw_sim_modulation)kind, dead_ns[d]};
                    agree = line(&s) && agree;
                }
    puts("\n| motor   | zero    | side  |   max   |   RMS   |\n| ------- | ------- | ----- | ------: | ------: |");
    for (int n = 0; n < 2; ++n) {
        const setting s = {motors[n], HELD, DQW_SIM_MODULATION_CLAMPED_LOW, 500};
        sides(&s);
    }
    printf("\n%s: within %.0f %%, up to its own dead time as it is, beyond that with diodes\n",
           agree ? "agree" : "DIFFER", 100 * wanted);
    return agree ? 0 : 1;
}
