// Which regressor form survives noise? Pairs, flat blocks and triangular blocks of consecutive pairs, all through the
// same neuron, gain and read-out, on one simulated servo log at several noise levels. Prints mean and RMS errors in %.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "dqw.h"
#include "dqw_sim.h"

enum { SEEDS = 5, RESERVOIR = 50 };

typedef struct {
    const char *name;
    int flat;  // pairs in a flat block; 0: the library's triangle
    int half;  // pairs in half a triangle
} form;

static const form FORMS[] = {{"pairs (differenced currents)", 1, 0}, {"flat block of 20", 20, 0}, {"flat block of 40", 40, 0},
                             {"flat block of 100", 100, 0},          {"triangle of 10", 0, 5},    {"triangle of 20", 0, 10},
                             {"triangle of 40 (default)", 0, 20},    {"triangle of 80", 0, 40}};

static dqw_sample sample(const dqw_sim_row *r)
{
    const dqw_sample s = {
        .v_d_V = (float)r->v_d_V, .v_q_V = (float)r->v_q_V, .i_d_A = (float)r->i_d_A, .i_q_A = (float)r->i_q_A, .w_m_rad_s = (float)r->w_m_rad_s};
    return s;
}

static dqw_estimator_config bases(const dqw_sim_scenario *s, const dqw_sim_row *rows, size_t n, dqw_random_sample *d, dqw_random_sample *q)
{
    dqw_estimator_config c = {
        .dt_s = (float)s->drive.dt_s, .pole_pairs = (uint16_t)s->machine.pole_pairs, .reservoir_d = d, .reservoir_q = q, .reservoir = RESERVOIR};
    for (size_t k = 0; k < n; k++) {
        c.v_base_V = fmaxf(c.v_base_V, fmaxf(fabsf((float)rows[k].v_d_V), fabsf((float)rows[k].v_q_V)));
        c.i_base_A = fmaxf(c.i_base_A, fmaxf(fabsf((float)rows[k].i_d_A), fabsf((float)rows[k].i_q_A)));
        c.w_base_rad_s = fmaxf(c.w_base_rad_s, fabsf((float)rows[k].w_m_rad_s));
    }
    return c;
}

static dqw_parameters flat_blocks(dqw_estimator *e, const dqw_sim_row *rows, size_t n, int pairs)
{
    float sum[DQW_BLOCK_SIGNALS] = {0};
    int held = 0;
    for (size_t k = 1; k < n; k++) {
        const dqw_sample a = sample(&rows[k - 1]);
        const dqw_sample b = sample(&rows[k]);
        const dqw_block p = dqw_model_pair(&a, &b, e->dt_s);
        const float x[] = {p.v_d_V, p.v_q_V, p.i_d_A, p.i_q_A, p.di_d_A_s, p.di_q_A_s, p.wi_d_A_rad_s, p.wi_q_A_rad_s, p.w_m_rad_s};
        for (int i = 0; i < DQW_BLOCK_SIGNALS; i++) sum[i] += x[i] / (float)pairs;
        if (++held < pairs) continue;
        dqw_block m = {sum[0], sum[1], sum[2], sum[3], sum[4], sum[5], sum[6], sum[7], sum[8]};
        float x_d[DQW_D_INPUTS];
        float x_q[DQW_Q_INPUTS];
        dqw_model_correct(&m, &e->parameters, e->dt_s);
        dqw_model_inputs(&m, x_d, x_q);
        (void)dqw_axis_learn(&e->d, x_d, m.v_d_V, 7);
        (void)dqw_axis_learn(&e->q, x_q, m.v_q_V, 15);
        e->parameters = dqw_model_read(&e->d, &e->q, e->pole_pairs, DQW_WEIGHT_EACH);
        for (int i = 0; i < DQW_BLOCK_SIGNALS; i++) sum[i] = 0.0f;
        held = 0;
    }
    return e->parameters;
}

static int run(const form *f, const dqw_sim_scenario *s, const dqw_sim_row *rows, size_t n, double error[4])
{
    static dqw_random_sample d[RESERVOIR];
    static dqw_random_sample q[RESERVOIR];
    dqw_estimator e;
    dqw_estimator_config c = bases(s, rows, n, d, q);
    c.half_window = (uint16_t)f->half;
    if (dqw_estimator_init(&e, &c) != DQW_OK) return 1;
    dqw_parameters p;
    if (f->flat > 0) {
        p = flat_blocks(&e, rows, n, f->flat);
    } else {
        for (size_t k = 0; k < n; k++) {
            const dqw_sample x = sample(&rows[k]);
            (void)dqw_estimator_step(&e, &x, false);
        }
        p = e.parameters;
    }
    const dqw_sim_machine *m = &s->machine;
    error[0] = 100 * (p.R_ohm / m->R_ohm - 1);
    error[1] = 100 * (p.Ld_H / m->Ld_H - 1);
    error[2] = 100 * (p.Lq_H / m->Lq_H - 1);
    error[3] = 100 * (p.psi_Wb / m->psi_Wb - 1);
    return 0;
}

int main(void)
{
    const char *levels[] = {"0", "0.01", "0.05", "0.2"};
    const dqw_sim_scenario *base = dqw_sim_scenario_find("servo_ideal");
    if (base == NULL) return 1;
    const size_t n = dqw_sim_rows(base);
    dqw_sim_row *rows = malloc(n * sizeof *rows);
    if (rows == NULL) return 1;
    printf("Regressor forms on the scenario servo_ideal, white noise on every channel, %d seeds: mean error %% (RMS)\n", SEEDS);
    printf("%7s  %-29s %17s %17s %17s %17s\n", "noise", "form", "R", "L_d", "L_q", "flux");
    for (size_t l = 0; l < sizeof levels / sizeof levels[0]; l++) {
        double mean[sizeof FORMS / sizeof FORMS[0]][4] = {{0}};
        double square[sizeof FORMS / sizeof FORMS[0]][4] = {{0}};
        for (int seed = 1; seed <= SEEDS; seed++) {
            dqw_sim_scenario s = *base;
            s.noise.seed = (uint64_t)seed;
            if (dqw_sim_set(&s, "noise", levels[l]) != 0 || dqw_sim_run(&s, rows, n, NULL, NULL, NULL) != 0) return 1;
            for (size_t f = 0; f < sizeof FORMS / sizeof FORMS[0]; f++) {
                double error[4];
                if (run(&FORMS[f], &s, rows, n, error)) return 1;
                for (int i = 0; i < 4; i++) {
                    mean[f][i] += error[i] / SEEDS;
                    square[f][i] += error[i] * error[i] / SEEDS;
                }
            }
        }
        for (size_t f = 0; f < sizeof FORMS / sizeof FORMS[0]; f++) {
            printf("%5.0f %%  %-29s", 100 * atof(levels[l]), FORMS[f].name);
            for (int i = 0; i < 4; i++) printf(" %+8.3f (%6.3f)", mean[f][i], sqrt(square[f][i]));
            printf("\n");
        }
    }
    free(rows);
    return 0;
}
