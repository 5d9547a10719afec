// How near the learners come to the truth: the joint at 24 V, start values wrong by 30 %, one pass, sample by sample. RMS errors and
// the share of 95 % intervals that hold the truth, over many seeds and noise levels.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dqw.h"
#include "dqw_sim.h"

enum { PARAMETERS = 4, RESERVOIR = 50 };

typedef struct {
    double value[PARAMETERS], sd[PARAMETERS];
} estimate;

static const double WRONG[PARAMETERS] = {1.3, 0.7, 1.3, 0.7};

static dqw_sample sample(const dqw_sim_row *r)
{
    const dqw_sample s = {.v_d_V = (float)r->v_d_V,
                          .v_q_V = (float)r->v_q_V,
                          .i_d_A = (float)r->i_d_A,
                          .i_q_A = (float)r->i_q_A,
                          .w_m_rad_s = (float)r->w_m_rad_s,
                          .theta_e_rad = (float)r->theta_e_rad};
    return s;
}

static estimate track(const dqw_sim_scenario *s, const dqw_sim_row *rows, size_t n, float dead_time_width_A, float drift)
{
    const dqw_tracker_config c = {.dt_s = (float)s->drive.dt_s,
                                  .v_base_V = 14,
                                  .i_base_A = 6,
                                  .w_base_rad_s = 110,
                                  .R_ohm = (float)(s->machine.R_ohm * WRONG[0]),
                                  .Ld_H = (float)(s->machine.Ld_H * WRONG[1]),
                                  .Lq_H = (float)(s->machine.Lq_H * WRONG[2]),
                                  .psi_Wb = (float)(s->machine.psi_Wb * WRONG[3]),
                                  .pole_pairs = (uint16_t)s->machine.pole_pairs,
                                  .drift_per_sqrt_s = drift,
                                  .dead_time_width_A = dead_time_width_A,
                                  .angle = dead_time_width_A > 0.0f,
                                  .noise_on_inputs = getenv("NOCOMP") == NULL};
    dqw_tracker t;
    if (dqw_tracker_init(&t, &c) != DQW_OK) exit(1);
    for (size_t k = 0; k < n; k++) {
        const dqw_sample x = sample(&rows[k]);
        (void)dqw_tracker_sample(&t, &x, false);
        (void)dqw_tracker_learn(&t);
    }
    if (getenv("SHOW")) printf("V %g g %g psiq %g ", dqw_tracker_value(&t, DQW_TRACK_DEAD_TIME), t.dead_slope_inv_A, dqw_tracker_value(&t, DQW_TRACK_PSI_Q)), printf("noise id %g iq %g w %g true w std..\n", sqrt(t.noise.i_d_A2), sqrt(t.noise.i_q_A2), sqrt(t.noise.w_rad2_s2));
    estimate e;
    for (int i = 0; i < PARAMETERS; i++) {
        e.value[i] = dqw_tracker_value(&t, (enum dqw_tracker_weight)i);
        e.sd[i] = dqw_tracker_sd(&t, (enum dqw_tracker_weight)i);
    }
    return e;
}

int main(int argc, char **argv)
{
    const int seeds = argc > 1 ? atoi(argv[1]) : 20;
    const char *all[] = {"0", "0.01", "0.05", "0.2"}; const char *one[] = {"0.05","0.2"}; const char **levels = getenv("ONE") ? one : all; const size_t nl = getenv("ONE") ? 2 : 4;
    const dqw_sim_scenario *base = dqw_sim_scenario_find("joint_24v");
    const size_t n = dqw_sim_rows(base);
    dqw_sim_row *rows = malloc(n * sizeof *rows);
    for (int dead = 0; dead < 2; dead++)
        for (size_t l = 0; l < nl; l++) {
            double mean[4] = {0}, square[4] = {0}, inside[4] = {0}, z2[4] = {0}, sdm[4] = {0};
            for (int seed = 1; seed <= seeds; seed++) {
                dqw_sim_scenario s = *base;
                s.seed = (uint64_t)seed;
                if (dqw_sim_set(&s, "noise.i", levels[l]) || dqw_sim_set(&s, "noise.v", levels[l]) || dqw_sim_set(&s, "noise.w", levels[l])) return 1;
                if (dead) s.nonideal.dead_time_V.value = 0.24, s.nonideal.dead_time_width_A = 0.05;
                if (dqw_sim_run(&s, rows, n, NULL, NULL, NULL) != 0) return 1;
                const estimate e = track(&s, rows, n, dead ? 0.05f : 0.0f, getenv("DRIFT") ? (float)atof(getenv("DRIFT")) : 0.0f);
                const double truth[] = {s.machine.R_ohm, s.machine.Ld_H, s.machine.Lq_H, s.machine.psi_Wb};
                for (int i = 0; i < 4; i++) {
                    const double off = 100 * (e.value[i] / truth[i] - 1), sd = 100 * e.sd[i] / truth[i];
                    mean[i] += off / seeds, square[i] += off * off / seeds, inside[i] += (fabs(off) < 1.96 * sd) * 100.0 / seeds;
                    z2[i] += off * off / sd / sd / seeds, sdm[i] += sd / seeds;
                }
            }
            printf("dead %d noise %s:", dead, levels[l]);
            for (int i = 0; i < 4; i++) printf("  %+.3f rms %.3f sd %.3f in %.0f %% z %.2f |", mean[i], sqrt(square[i]), sdm[i], inside[i], sqrt(z2[i]));
            printf("\n");
        }
    return 0;
}
