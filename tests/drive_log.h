// Simulated drives through the estimator: each scenario's rows once, without noise, and what the estimator makes of
// them.
#ifndef DRIVE_LOG_H
#define DRIVE_LOG_H

#include "dqw_estimator.h"
#include "dqw_estimator_block.h"
#include "dqw_estimator_random.h"
#include "dqw_sim.h"
#include "dqw_test.h"

enum { DRIVE_ROWS = 40001, DRIVE_CHANNELS = 5, DRIVES_MAX = 16 };

static const char *const PARAMETER[] = {"R", "L_d", "L_q", "flux", "dead time", "flux on q", "constant"};

/// A scenario's rows, and by how much each channel varies.
typedef struct drive_log {
    dqw_sim_scenario scenario;
    uint64_t seed;
    int rows;
    double x[DRIVE_ROWS][DRIVE_CHANNELS];  ///< v_d, v_q, i_d, i_q, w_m
    double theta_rad[DRIVE_ROWS];
    double sd[DRIVE_CHANNELS];
    double truth[4];
    double w_base_rad_s;
} drive_log;

static drive_log drives[DRIVES_MAX];

/// At least a second of excitation: a shorter scenario is made longer.
static inline const drive_log *drive(const char *name, uint64_t seed)
{
    int n = 0;
    for (; n < DRIVES_MAX && drives[n].rows != 0; n++)
        if (strcmp(drives[n].scenario.name, name) == 0 && drives[n].seed == seed) return &drives[n];
    if (n == DRIVES_MAX) n--;
    drive_log *l = &drives[n];
    const dqw_sim_scenario *found = dqw_sim_scenario_find(name);
    TEST_ASSERT_NOT_NULL_MESSAGE(found, name);
    dqw_sim_scenario s = *found;
    memset(&s.noise, 0, sizeof s.noise);
    s.seed = l->seed = seed;
    s.method = DQW_SIM_RK4;
    if (s.duration_s < 1.0) s.duration_s = 1.05;
    static dqw_sim_row rows[DRIVE_ROWS];
    const size_t count = dqw_sim_rows(&s);
    TEST_ASSERT_TRUE(count > 0 && count <= DRIVE_ROWS);
    TEST_ASSERT_EQUAL_INT(DQW_SIM_OK, dqw_sim_run(&s, rows, count, NULL, NULL, NULL));
    l->scenario = s;
    l->rows = (int)count;
    double sum[DRIVE_CHANNELS] = {0};
    double square[DRIVE_CHANNELS] = {0};
    l->w_base_rad_s = 0.0;
    for (int k = 0; k < l->rows; k++) {
        const double x[DRIVE_CHANNELS] = {rows[k].v_d_V, rows[k].v_q_V, rows[k].i_d_A, rows[k].i_q_A,
                                          rows[k].w_m_rad_s};
        l->theta_rad[k] = rows[k].theta_e_rad;
        l->w_base_rad_s = fmax(l->w_base_rad_s, fabs(x[4]));
        for (int c = 0; c < DRIVE_CHANNELS; c++) {
            l->x[k][c] = x[c];
            sum[c] += x[c] / (double)count;
            square[c] += x[c] * x[c] / (double)count;
        }
    }
    for (int c = 0; c < DRIVE_CHANNELS; c++) l->sd[c] = sqrt(square[c] - sum[c] * sum[c]);
    const double truth[] = {s.machine.R_ohm, s.machine.Ld_H, s.machine.Lq_H, s.machine.psi_Wb};
    memcpy(l->truth, truth, sizeof truth);
    return l;
}

/// What the nameplate says of the drive, and its nominal values times `nominal`; 0: absent.
static inline dqw_estimator_config drive_config(const drive_log *l, double nominal)
{
    const dqw_nameplate plate = {.dt_s = (float)l->scenario.drive.dt_s,
                                 .v_V = (float)(l->scenario.drive.v_dc_V / sqrt(3)),
                                 .i_A = (float)l->scenario.drive.i_max_A,
                                 .w_m_rad_s = (float)l->w_base_rad_s,
                                 .pole_pairs = (uint16_t)l->scenario.machine.pole_pairs};
    dqw_estimator_config c = dqw_estimator_config_default(&plate);
    c.R_ohm = (float)(nominal * l->truth[0]);
    c.Ld_H = (float)(nominal * l->truth[1]);
    c.Lq_H = (float)(nominal * l->truth[2]);
    c.psi_Wb = (float)(nominal * l->truth[3]);
    return c;
}

/// White noise of `noise` times each channel's standard deviation, as sensors have it; the angle is exact.
static inline dqw_sample drive_sample(const drive_log *l, int k, double noise, test_random *r)
{
    float x[DRIVE_CHANNELS];
    for (int c = 0; c < DRIVE_CHANNELS; c++)
        x[c] = (float)(l->x[k][c] + (noise > 0 ? noise * l->sd[c] * random_normal(r) : 0.0));
    return dqw_sample_from_dq(x[0], x[1], x[2], x[3], x[4], (float)l->theta_rad[k]);
}

static inline dqw_estimator drive_begin(const dqw_estimator_config *c)
{
    dqw_estimator e;
    if (c->random != NULL) dqw_estimator_random_init(c->random);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&e, c));
    return e;
}

/// The first `rows` of a log, all of it where that is 0, through a new estimator.
static inline dqw_estimator drive_learned(const drive_log *l, const dqw_estimator_config *c, double noise,
                                          uint64_t seed, int rows)
{
    dqw_estimator e = drive_begin(c);
    test_random r = {seed};
    for (int k = 0; k < (rows > 0 && rows < l->rows ? rows : l->rows); k++) {
        const dqw_sample s = drive_sample(l, k, noise, &r);
        if (dqw_estimator_sample(&e, &s, false) & DQW_EVENT_BLOCK) (void)dqw_estimator_background(&e);
    }
    return e;
}

static inline double value_of(const dqw_estimator *e, int i)
{
    return (double)dqw_estimator_read(e, (enum dqw_parameter)i).value;
}
static inline double sd_of(const dqw_estimator *e, int i)
{
    return (double)dqw_estimator_read(e, (enum dqw_parameter)i).sd;
}
static inline bool is_known(const dqw_estimator *e, int i) { return sd_of(e, i) < (double)DQW_UNKNOWN; }

#endif
