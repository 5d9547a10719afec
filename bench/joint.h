// What the benches on the simulated joint (scenario joint_24v) share: its log, the estimator's set-up, options.
#ifndef BENCH_JOINT_H
#define BENCH_JOINT_H

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dqw.h"
#include "dqw_sim.h"

enum { JOINT_PARAMETERS = 4 };  // R, L_d, L_q, flux: the estimator's first weights

typedef struct {
    size_t count;
    dqw_sim_row *row;
} joint_log;

/// The value that follows `name` on the command line, else `otherwise`. A name that ends the line is a mistake.
static inline const char *joint_option(int argc, char **argv, const char *name, const char *otherwise)
{
    for (int i = 1; i < argc; i++)
        if (strcmp(argv[i], name) == 0) {
            if (i + 1 < argc) return argv[i + 1];
            fprintf(stderr, "%s: %s needs a value\n", argv[0], name);
            exit(2);
        }
    return otherwise;
}

static inline bool joint_flag(int argc, char **argv, const char *name)
{
    for (int i = 1; i < argc; i++)
        if (strcmp(argv[i], name) == 0) return true;
    return false;
}

/// As joint_option, a whole number > 0.
static inline long joint_number(int argc, char **argv, const char *name, long otherwise)
{
    const char *text = joint_option(argc, argv, name, NULL);
    const double number = text ? atof(text) : (double)otherwise;
    if (number >= 1 && number < 1e12) return (long)number;
    fprintf(stderr, "%s: %s wants a number of 1 or more\n", argv[0], name);
    exit(2);
}

/// The scenario, with this much noise on currents, voltages and speed; the angle has none.
static inline dqw_sim_scenario joint_scenario(int seed, double noise, double duration_s)
{
    const dqw_sim_scenario *base = dqw_sim_scenario_find("joint_24v");
    if (base == NULL) exit(1);
    dqw_sim_scenario s = *base;
    s.seed = (uint64_t)seed;
    s.noise.i = s.noise.v = s.noise.w = noise;
    s.duration_s = duration_s;
    return s;
}

/// Simulates, or ends the program with the simulator's own words.
static inline joint_log joint_run(const dqw_sim_scenario *s)
{
    joint_log log = {.count = dqw_sim_rows(s)};
    dqw_sim_report report = {.message = "out of memory"};
    log.row = malloc(log.count * sizeof *log.row);
    if (log.row == NULL || dqw_sim_run(s, log.row, log.count, &report, NULL, NULL) != 0) {
        fprintf(stderr, "%s: %s\n", s->name, report.message);
        exit(1);
    }
    return log;
}

static inline dqw_sample joint_sample(const dqw_sim_row *r)
{
    const dqw_sample s = dqw_sample_from_dq((float)r->v_d_V, (float)r->v_q_V, (float)r->i_d_A, (float)r->i_q_A,
                                            (float)r->w_m_rad_s, (float)r->theta_e_rad);
    return s;
}

/// The estimator, with nominal values that are 30 % wrong, two too high and two too low.
static inline dqw_estimator_config joint_estimator(const dqw_sim_machine *m)
{
    const dqw_estimator_config c = {.dt_s = 5e-5f,
                                    .v_base_V = 14,
                                    .i_base_A = 6,
                                    .w_base_rad_s = 110,
                                    .R_ohm = (float)(1.3 * m->R_ohm),
                                    .Ld_H = (float)(0.7 * m->Ld_H),
                                    .Lq_H = (float)(1.3 * m->Lq_H),
                                    .psi_Wb = (float)(0.7 * m->psi_Wb),
                                    .pole_pairs = (uint16_t)m->pole_pairs,
                                    .noise_on_inputs = true};
    return c;
}

/// And with what a drive adds: dead time and the encoder's offset are learned too, parameters may change.
static inline dqw_estimator_config joint_in_service(const dqw_sim_machine *m, double dead_time_width_A)
{
    dqw_estimator_config c = joint_estimator(m);
    c.dead_time_width_A = (float)dead_time_width_A;
    c.angle = c.encoder_offset = true;
    c.follow = true;
    return c;
}

/// The same of the simulated servo, whose bases are its own.
static inline dqw_estimator_config servo_in_service(const dqw_sim_scenario *s, double dead_time_width_A)
{
    dqw_estimator_config c = joint_in_service(&s->machine, dead_time_width_A);
    c.dt_s = (float)s->drive.dt_s;
    c.v_base_V = 185;
    c.i_base_A = 15;
    c.w_base_rad_s = 200;
    return c;
}

static inline void joint_learn(dqw_estimator *e, const dqw_sample *s)
{
    if (dqw_estimator_sample(e, s, false) & DQW_EVENT_BLOCK) (void)dqw_estimator_background(e);
}

/// A parameter of the simulated machine, in the estimator's order.
static inline double joint_truth(const dqw_sim_machine *m, int parameter)
{
    const double truth[JOINT_PARAMETERS] = {m->R_ohm, m->Ld_H, m->Lq_H, m->psi_Wb};
    return truth[parameter];
}

#endif
