// Which regressor form survives noise? Pairs, flat blocks and triangular blocks of consecutive pairs, all through the
// same neuron and gain, on one simulated servo log at several noise levels; then the estimator, which takes the noise
// of its inputs out. Prints mean and RMS errors in %.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "dqw.h"
#include "dqw_gain.h"
#include "dqw_model.h"
#include "dqw_sim.h"

enum { SEEDS = 20, PARAMETERS = 4, LEAST = 20 };  // blocks until each axis has its weight

typedef enum { FLAT, TRIANGLE, ESTIMATOR } shape;

typedef struct {
    const char *name;
    shape shape;
    int pairs;  // in a block
} form;

static const form FORMS[] = {{"pairs (differenced currents)", FLAT, 1},
                             {"flat block of 20", FLAT, 20},
                             {"flat block of 40", FLAT, 40},
                             {"flat block of 100", FLAT, 100},
                             {"triangle of 10", TRIANGLE, 10},
                             {"triangle of 20", TRIANGLE, 20},
                             {"triangle of 40", TRIANGLE, 40},
                             {"triangle of 80", TRIANGLE, 80},
                             {"triangle of 20, noise out", ESTIMATOR, 20},
                             {"triangle of 40, noise out", ESTIMATOR, 40},
                             {"triangle of 80, noise out", ESTIMATOR, 80}};

static dqw_sample sample(const dqw_sim_row *r)
{
    return dqw_sample_from_dq((float)r->v_d_V, (float)r->v_q_V, (float)r->i_d_A, (float)r->i_q_A, (float)r->w_m_rad_s,
                              (float)r->theta_e_rad);
}

static void largest(float *base, double a, double b) { *base = fmaxf(*base, fmaxf(fabsf((float)a), fabsf((float)b))); }

static dqw_estimator_config bases(const dqw_sim_scenario *s, const dqw_sim_row *rows, size_t n, int pairs)
{
    dqw_estimator_config c = {.dt_s = (float)s->drive.dt_s,
                              .pole_pairs = (uint16_t)s->machine.pole_pairs,
                              .half_window = (uint16_t)((pairs + 1) / 2),
                              .noise_on_inputs = true};
    for (size_t k = 0; k < n; k++) {
        largest(&c.v_base_V, rows[k].v_d_V, rows[k].v_q_V);
        largest(&c.i_base_A, rows[k].i_d_A, rows[k].i_q_A);
        largest(&c.w_base_rad_s, rows[k].w_m_rad_s, 0);
    }
    return c;
}

static void with_estimator(const dqw_estimator_config *c, const dqw_sim_row *rows, size_t n, double found[PARAMETERS])
{
    dqw_estimator e;
    if (dqw_estimator_init(&e, c) != DQW_OK) exit(1);
    for (size_t k = 0; k < n; k++) {
        const dqw_sample x = sample(&rows[k]);
        if (dqw_estimator_sample(&e, &x, false) & DQW_EVENT_BLOCK) (void)dqw_estimator_background(&e);
    }
    for (int i = 0; i < PARAMETERS; i++) found[i] = (double)dqw_estimator_read(&e, (enum dqw_parameter)i).value;
}

// Mean of consecutive pairs, the first of them between rows[0] and rows[1]: all alike, or rising and falling.
static dqw_block block_of(const form *f, const dqw_sim_row *rows, float dt_s)
{
    float sum[DQW_BLOCK_SIGNALS] = {0};
    float all = 0;
    for (int j = 0; j < f->pairs; j++) {
        const dqw_sample a = sample(&rows[j]);
        const dqw_sample b = sample(&rows[j + 1]);
        const dqw_block p = dqw_model_pair(&a, &b, dt_s);
        const float x[] = {p.v_d_V,    p.v_q_V,        p.i_d_A,        p.i_q_A,    p.di_d_A_s,
                           p.di_q_A_s, p.wi_d_A_rad_s, p.wi_q_A_rad_s, p.w_m_rad_s};
        const float weight = f->shape == FLAT ? 1.0f : fminf((float)(j + 1), (float)(f->pairs - j));
        for (int i = 0; i < DQW_BLOCK_SIGNALS; i++) sum[i] += weight * x[i];
        all += weight;
    }
    for (int i = 0; i < DQW_BLOCK_SIGNALS; i++) sum[i] /= all;
    const dqw_block m = {sum[0], sum[1], sum[2], sum[3], sum[4], sum[5], sum[6], sum[7], sum[8]};
    return m;
}

// Least squares of both axes' rows, weighed by how little of each axis is noise: R, L_d, L_q, flux, in units that make
// every input about 1.
static void with_gain(const form *f, const dqw_estimator_config *c, const dqw_sim_row *rows, size_t n,
                      double found[PARAMETERS])
{
    const float p = (float)c->pole_pairs;
    const float w_e = p * c->w_base_rad_s;
    const float unit[PARAMETERS] = {c->v_base_V / c->i_base_A, c->v_base_V / (c->i_base_A * w_e),
                                    c->v_base_V / (c->i_base_A * w_e), c->v_base_V / w_e};
    float w[PARAMETERS] = {0};
    float error2[2] = {0};
    float blocks = 0;
    dqw_gain gain;
    if (dqw_gain_init(&gain, PARAMETERS, 1e6f) != DQW_OK) exit(1);
    const int step = f->shape == FLAT ? f->pairs : f->pairs / 2;
    for (size_t k = 0; k + (size_t)f->pairs < n; k += (size_t)step) {
        dqw_block b = block_of(f, rows + k, c->dt_s);
        const dqw_machine known = {w[DQW_R] * unit[DQW_R], w[DQW_LD] * unit[DQW_LD], w[DQW_LQ] * unit[DQW_LQ], p};
        if (known.R_ohm > 0) dqw_model_bow(&b, &known, c->dt_s);
        const float x[2][PARAMETERS] = {{b.i_d_A, b.di_d_A_s, -p * b.wi_q_A_rad_s, 0},
                                        {b.i_q_A, p * b.wi_d_A_rad_s, b.di_q_A_s, p * b.w_m_rad_s}};
        const float v_V[2] = {b.v_d_V, b.v_q_V};
        blocks++;
        for (int axis = 0; axis < 2; axis++) {
            const float weight = blocks > LEAST ? 1.0f / sqrtf(error2[axis] + 1e-8f) : 1.0f;
            float x_pu[PARAMETERS];
            float k_pu[PARAMETERS];
            float e_pu = v_V[axis] / c->v_base_V;
            for (int i = 0; i < PARAMETERS; i++) {
                x_pu[i] = x[axis][i] * unit[i] / c->v_base_V;
                e_pu -= w[i] * x_pu[i];
                x_pu[i] *= weight;
            }
            dqw_gain_step(&gain, x_pu, k_pu);
            for (int i = 0; i < PARAMETERS; i++) w[i] += k_pu[i] * (e_pu * weight);
            if (blocks > LEAST / 2) error2[axis] += (e_pu * e_pu - error2[axis]) / (blocks - LEAST / 2);
        }
    }
    for (int i = 0; i < PARAMETERS; i++) found[i] = (double)(w[i] * unit[i]);
}

static void run(const form *f, const dqw_sim_scenario *s, const dqw_sim_row *rows, size_t n, double error[PARAMETERS])
{
    const dqw_estimator_config c = bases(s, rows, n, f->pairs);
    const double truth[PARAMETERS] = {s->machine.R_ohm, s->machine.Ld_H, s->machine.Lq_H, s->machine.psi_Wb};
    double found[PARAMETERS];
    if (f->shape == ESTIMATOR)
        with_estimator(&c, rows, n, found);
    else
        with_gain(f, &c, rows, n, found);
    for (int i = 0; i < PARAMETERS; i++) error[i] = 100 * (found[i] / truth[i] - 1);
}

int main(void)
{
    const char *levels[] = {"0", "0.01", "0.05", "0.2"};
    const dqw_sim_scenario *base = dqw_sim_scenario_find("servo_ideal");
    if (base == NULL) return 1;
    const size_t n = dqw_sim_rows(base);
    dqw_sim_row *rows = malloc(n * sizeof *rows);
    if (rows == NULL) return 1;
    printf("Regressor forms on the scenario servo_ideal, white noise on every channel, %d seeds: mean error %% (RMS)\n",
           SEEDS);
    printf("%7s  %-29s %17s %17s %17s %17s\n", "noise", "form", "R", "L_d", "L_q", "flux");
    for (size_t l = 0; l < sizeof levels / sizeof levels[0]; l++) {
        double mean[sizeof FORMS / sizeof FORMS[0]][PARAMETERS] = {{0}};
        double square[sizeof FORMS / sizeof FORMS[0]][PARAMETERS] = {{0}};
        for (int seed = 1; seed <= SEEDS; seed++) {
            dqw_sim_scenario s = *base;
            s.noise.seed = (uint64_t)seed;
            if (dqw_sim_set(&s, "noise", levels[l]) != 0 || dqw_sim_run(&s, rows, n, NULL, NULL, NULL) != 0) return 1;
            for (size_t f = 0; f < sizeof FORMS / sizeof FORMS[0]; f++) {
                double error[PARAMETERS];
                run(&FORMS[f], &s, rows, n, error);
                for (int i = 0; i < PARAMETERS; i++) {
                    mean[f][i] += error[i] / SEEDS;
                    square[f][i] += error[i] * error[i] / SEEDS;
                }
            }
        }
        for (size_t f = 0; f < sizeof FORMS / sizeof FORMS[0]; f++) {
            printf("%5.0f %%  %-29s", 100 * atof(levels[l]), FORMS[f].name);
            for (int i = 0; i < PARAMETERS; i++) printf(" %+8.3f (%6.3f)", mean[f][i], sqrt(square[f][i]));
            printf("\n");
        }
    }
    free(rows);
    return 0;
}
