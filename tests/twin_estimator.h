// The float estimator and the fixed-point one with the same nominal values and bases, and the logs that both are shown.
#ifndef TWIN_ESTIMATOR_H
#define TWIN_ESTIMATOR_H

#include "dqw_sim.h"
#include "dqw_test.h"
#include "dqw_estimator.h"
#include "dqw_estimator_block.h"
#include "dqw_estimator_q15.h"
#include "dqw_estimator_block_q15.h"
#include "dqw_number.h"
#include "moving_joint.h"

#define V_FULL 32.0
#define I_FULL 16.0
#define W_FULL 250.0
enum { ROWS = 40001, CHANNELS = 5, N = DQW_PARAMETERS };

static const char *const NAME[] = {"R", "L_d", "L_q", "flux", "dead time", "flux on q", "constant"};
static const double FULL[CHANNELS] = {V_FULL, V_FULL, I_FULL, I_FULL, W_FULL};

static inline bool quick(void) { return scaled(10) == 1; }

// Both estimators, with the same nominal values and bases.
typedef struct pair {
    dqw_estimator_config fc;
    dqw_estimator_q15_config qc;
    dqw_estimator f;
    dqw_estimator_q15 q;
} pair;

static inline void configure(pair *p, double wrong, double width_A)
{
    const double nominal[] = {TRUTH[0] * (1 + wrong), TRUTH[1] * (1 - wrong), TRUTH[2] * (1 + wrong),
                              TRUTH[3] * (1 - wrong)};
    const dqw_estimator_config fc = {.dt_s = (float)DT_S,
                                     .v_base_V = (float)V_FULL,
                                     .i_base_A = (float)I_FULL,
                                     .w_base_rad_s = (float)W_FULL,
                                     .R_ohm = (float)nominal[0],
                                     .Ld_H = (float)nominal[1],
                                     .Lq_H = (float)nominal[2],
                                     .psi_Wb = (float)nominal[3],
                                     .pole_pairs = 4,
                                     .dead_time_width_A = (float)width_A,
                                     .angle = width_A > 0,
                                     .encoder_offset = width_A > 0,
                                     .noise_on_inputs = true};
    const dqw_estimator_q15_config qc = {.scale = {.v_full_mV = 1000 * (uint32_t)V_FULL,
                                                   .i_full_mA = 1000 * (uint32_t)I_FULL,
                                                   .w_full_mrad_s = 1000 * (uint32_t)W_FULL,
                                                   .dt_ns = 50000,
                                                   .pole_pairs = 4},
                                         .R_uohm = (uint32_t)lrint(1e6 * nominal[0]),
                                         .Ld_nH = (uint32_t)lrint(1e9 * nominal[1]),
                                         .Lq_nH = (uint32_t)lrint(1e9 * nominal[2]),
                                         .psi_nWb = (uint32_t)lrint(1e9 * nominal[3]),
                                         .dead_time_width_mA = (uint32_t)lrint(1000 * width_A),
                                         .angle = width_A > 0,
                                         .encoder_offset = width_A > 0,
                                         .noise_on_inputs = true};
    p->fc = fc;
    p->qc = qc;
}

static inline void begin(pair *p)
{
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&p->f, &p->fc));
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(&p->q, &p->qc));
}

static inline double f_value(const pair *p, int i)
{
    return (double)dqw_estimator_read(&p->f, (enum dqw_parameter)i).value;
}
static inline double f_sd(const pair *p, int i) { return (double)dqw_estimator_read(&p->f, (enum dqw_parameter)i).sd; }

static inline double q_unit(const pair *p, int i)
{
    static const double si[N] = {1e-6, 1e-9, 1e-9, 1e-9, 1e-6, 1e-9, 1e-6};
    return (double)dqw_estimator_unit_q15(&p->qc, (enum dqw_parameter)i) * si[i] / 1099511627776.0;
}
static inline double q_value(const pair *p, int i)
{
    return (double)dqw_estimator_read_q15(&p->q, (enum dqw_parameter)i).value_q40 * q_unit(p, i);
}
static inline double q_sd(const pair *p, int i)
{
    const int64_t sd = dqw_estimator_read_q15(&p->q, (enum dqw_parameter)i).sd_q40;
    return sd == INT64_MAX ? (double)DQW_UNKNOWN : (double)sd * q_unit(p, i);
}

static inline int16_t q15(double x, double full)
{
    return (int16_t)lrint(fmax(-32768.0, fmin(32767.0, 32768 * x / full)));
}

static inline dqw_sample_q15 rounded(const dqw_sample *s)
{
    dqw_sample_q15 r = dqw_sample_from_dq_q15(
        q15((double)s->v_d_V, V_FULL), q15((double)s->v_q_V, V_FULL), q15((double)s->i_d_A, I_FULL),
        q15((double)s->i_q_A, I_FULL), q15((double)s->w_m_rad_s, W_FULL),
        (uint16_t)(lrint(atan2((double)s->sine, (double)s->cosine) / (2 * PI) * 65536) & 65535));
    r.resting = s->resting;
    return r;
}

// One sample into both; true where the fixed-point one learned a block.
static inline bool step(pair *p, const dqw_sample *s)
{
    const dqw_sample_q15 r = rounded(s);
    if (dqw_estimator_sample(&p->f, s, false) & DQW_EVENT_BLOCK) (void)dqw_estimator_background(&p->f);
    return (dqw_estimator_sample_q15(&p->q, &r, false) & DQW_EVENT_BLOCK) != 0 && dqw_estimator_background_q15(&p->q);
}

// Rows without noise, and by how much each channel varies.
typedef struct journal {
    int rows;
    double x[ROWS][CHANNELS];  ///< v_d, v_q, i_d, i_q, w_m
    double theta_rad[ROWS];
    double sd[CHANNELS];
} journal;

static inline const journal *simulated(double dead_time_V)
{
    static journal journals[2];
    journal *l = &journals[dead_time_V > 0];
    if (l->rows != 0) return l;
    static dqw_sim_row rows[ROWS];
    dqw_sim_scenario s = *dqw_sim_scenario_find("joint_24v");
    memset(&s.noise, 0, sizeof s.noise);
    s.nonideal.dead_time_V.value = dead_time_V;
    s.nonideal.dead_time_width_A = 0.05;
    s.method = DQW_SIM_RK4;
    const size_t n = dqw_sim_rows(&s);
    TEST_ASSERT_TRUE(n > 0 && n <= ROWS);
    TEST_ASSERT_EQUAL_INT(DQW_SIM_OK, dqw_sim_run(&s, rows, n, NULL, NULL, NULL));
    double sum[CHANNELS] = {0};
    double square[CHANNELS] = {0};
    for (int k = 0; k < (int)n; k++) {
        const double x[CHANNELS] = {rows[k].v_d_V, rows[k].v_q_V, rows[k].i_d_A, rows[k].i_q_A, rows[k].w_m_rad_s};
        l->theta_rad[k] = rows[k].theta_e_rad;
        for (int c = 0; c < CHANNELS; c++) {
            l->x[k][c] = x[c];
            HOLDS(fabs(x[c]) < FULL[c]);
            sum[c] += x[c] / (double)n;
            square[c] += x[c] * x[c] / (double)n;
        }
    }
    for (int c = 0; c < CHANNELS; c++) l->sd[c] = sqrt(square[c] - sum[c] * sum[c]);
    l->rows = (int)n;
    return l;
}

// White noise of `noise` times each channel's standard deviation, as sensors have it.
static inline dqw_sample sample(const journal *l, int k, double noise, test_random *r)
{
    float x[CHANNELS];
    for (int c = 0; c < CHANNELS; c++)
        x[c] = (float)(l->x[k][c] + (noise > 0 ? noise * l->sd[c] * random_normal(r) : 0.0));
    const dqw_sample s = dqw_sample_from_dq(x[0], x[1], x[2], x[3], x[4], (float)l->theta_rad[k]);
    return s;
}

#endif
