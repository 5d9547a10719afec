// Every fault of the monitor's table at three severities: how soon it is told, and how often by its name.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dqw.h"
#include "dqw_sim.h"

static const char *NAMES[] = {"-", "over_temperature", "demagnetisation", "turn_short", "phase_connection", "current_offset", "current_gain", "encoder_offset", "bearing_wear", "inverter_fault", "unknown"};
static const char *CH[] = {"R","Ld","Lq","psi","dead","angle","offset","resist","react","short","friction","temp","residual"};

typedef struct { const char *name; enum dqw_fault_name fault; const char *key; double severity[3]; const char *more[3]; } fault_case;
static const fault_case CASES[] = {
    {"healthy", DQW_FAULT_NONE, NULL, {0}, {0}},
    {"demagnetisation", DQW_FAULT_DEMAGNETISATION, "nonideal.demagnetisation", {0.03, 0.05, 0.10}, {0}},
    {"turn_short", DQW_FAULT_TURN_SHORT, "nonideal.turn_short", {0.03, 0.05, 0.10}, {"nonideal.turn_short_ohm=0.05"}},
    {"phase_connection", DQW_FAULT_PHASE_CONNECTION, "nonideal.phase_connection_ohm", {0.05, 0.1, 0.25}, {0}},
    {"current_offset", DQW_FAULT_CURRENT_OFFSET, "nonideal.current_offset_alpha_A", {0.1, 0.2, 0.5}, {0}},
    {"current_gain", DQW_FAULT_CURRENT_GAIN, "nonideal.current_gain_a", {0.05, 0.1, 0.2}, {0}},
    {"encoder_offset", DQW_FAULT_ENCODER_OFFSET, "nonideal.angle_offset_rad", {0.03, 0.05, 0.1}, {0}},
    {"inverter_fault", DQW_FAULT_INVERTER_FAULT, "nonideal.dead_time_V", {0.36, 0.48, 0.72}, {0}},
    {"bearing_wear", DQW_FAULT_BEARING_WEAR, "nonideal.bearing_Nm", {0.1, 0.2, 0.3}, {0}},
    {"R +10..40 %", DQW_FAULT_UNKNOWN, "R", {0.05, 0.1, 0.2}, {0}},
};

static int set(dqw_sim_scenario *s, const char *kv)
{
    char key[100];
    strcpy(key, kv);
    char *v = strchr(key, '=');
    *v++ = 0;
    return dqw_sim_set(s, key, v);
}

int main(int argc, char **argv)
{
    const int seeds = argc > 1 ? atoi(argv[1]) : 3;
    const char *noise = argc > 2 ? argv[2] : "0.01";
    const char *only = argc > 3 ? argv[3] : NULL;
    const double start = 2.0, end = argc > 4 ? atof(argv[4]) : 4.0;
    for (size_t f = 0; f < sizeof CASES / sizeof CASES[0]; f++) {
        const fault_case *c = &CASES[f];
        if (only && strcmp(only, c->name)) continue;
        for (int v = 0; v < 3; v++) {
            int early = 0, told = 0, right = 0; double sum = 0, worst = 0;
            for (int seed = 1; seed <= seeds; seed++) {
                dqw_sim_scenario s = *dqw_sim_scenario_find("joint_24v");
                s.seed = (uint64_t)seed; s.duration_s = end;
                s.nonideal.dead_time_V.value = 0.24, s.nonideal.dead_time_width_A = 0.05;
                s.machine.coulomb_Nm = 0.02, s.machine.coulomb_width_rad_s = 1;
                dqw_sim_set(&s, "noise.i", noise), dqw_sim_set(&s, "noise.v", noise), dqw_sim_set(&s, "noise.w", noise);
                for (int i = 0; i < 3; i++) if (c->more[i]) set(&s, c->more[i]);
                dqw_sim_ramp ramp = {c->severity[v], start, start + 0.1};
                if (c->key && !strcmp(c->key, "R")) { s.nonideal.winding_alpha_per_K = ramp; s.machine.temp_start_C = 26;  s.nonideal.winding_alpha_per_K = ramp; }
                else if (c->key && !strcmp(c->key, "nonideal.dead_time_V")) { s.nonideal.dead_time_V.value = c->severity[v]; }
                else if (c->key) { char k[100]; char val[40]; snprintf(val, 40, "%g", c->severity[v]); dqw_sim_set(&s, c->key, val); snprintf(k, 100, "%s.t_start_s", c->key); snprintf(val, 40, "%g", start); dqw_sim_set(&s, k, val); snprintf(k, 100, "%s.t_end_s", c->key); snprintf(val, 40, "%g", start + 0.1); dqw_sim_set(&s, k, val); }
                const size_t n = dqw_sim_rows(&s);
                dqw_sim_row *rows = malloc(n * sizeof *rows);
                dqw_sim_report r;
                if (dqw_sim_run(&s, rows, n, &r, NULL, NULL)) { printf("%s\n", r.message); return 1; }
                if (c->key && !strcmp(c->key, "nonideal.dead_time_V")) { // joined: healthy first
                    dqw_sim_scenario h = s; h.nonideal.dead_time_V.value = 0.24; dqw_sim_row *r2 = malloc(n * sizeof *rows); dqw_sim_run(&h, r2, n, NULL, NULL, NULL);
                    memcpy(rows, r2, (size_t)(start / s.drive.dt_s) * sizeof *rows); free(r2);
                }
                static dqw_monitor_random lent;
                static dqw_monitor_config mc;
                mc = (dqw_monitor_config){.tracker = {.dt_s = 5e-5f, .v_base_V = 14, .i_base_A = 6, .w_base_rad_s = 110, .R_ohm = .65f, .Ld_H = .7e-3f, .Lq_H = 1.8e-3f, .psi_Wb = .014f, .pole_pairs = 4,
                    .dead_time_width_A = 0.05f, .angle = true, .noise_on_inputs = true, .drift_per_sqrt_s = 0.01f}, .J_kgm2 = 3e-4f};
                dqw_monitor m;
                if (dqw_monitor_init(&m, &mc, getenv("LENT") ? &lent : NULL)) return 1;
                int first = 1; double t0 = 0;
                for (size_t k = 0; k < n; k++) {
                    const dqw_sample x = {.v_d_V = (float)rows[k].v_d_V, .v_q_V = (float)rows[k].v_q_V, .i_d_A = (float)rows[k].i_d_A, .i_q_A = (float)rows[k].i_q_A, .w_m_rad_s = (float)rows[k].w_m_rad_s, .theta_e_rad = (float)rows[k].theta_e_rad};
                    dqw_monitor_sample(&m, &x, false);
                    dqw_monitor_event e;
                    if (m.tracker.pending && dqw_monitor_background(&m, &e)) {
                        const double t = rows[k].t_s;
                        if (getenv("SHOW")) printf("   %s %g seed %d: t %.3f since %.3f %s %g+-%g %s conf %.2f phase %d alarms\n", c->name, c->severity[v], seed, t, e.since * 1e-3, CH[e.parameter], e.value, e.sd, NAMES[e.fault.name], e.fault.confidence, e.fault.phase);
                        if (t < start) early++;
                        else if (first) { first = 0; told++; sum += t - start; if (t - start > worst) worst = t - start; if (e.fault.name == c->fault) right++; }
                    }
                    if (getenv("VERB") && k % 4000 == 0) { printf("t %.2f st %d:", rows[k].t_s, m.stage.name); for (int i = 0; i < 6; i++) printf(" %.4g+-%.2g", dqw_tracker_value(&m.tracker, i), dqw_tracker_sd(&m.tracker, i)); for (int i = 0; i < 4; i++) printf(" | %.2g+-%.1g", dqw_witness_size(&m.witness, i), dqw_witness_sd(&m.witness, &m.tracker, i)); printf(" F %.3f res %.4g\n", .5*(m.forward_Nm-m.backward_Nm), sqrt(m.residual_pu2)); }
                }
                if (first && getenv("SHOW")) printf("   %s %g seed %d: nothing; stage %d\n", c->name, c->severity[v], seed, m.stage.name);
                (void)t0;
                free(rows);
            }
            printf("%-18s %6g: early %d told %d/%d mean %.2f worst %.2f s right %d\n", c->name, c->severity[v], early, told, seeds, told ? sum / told : 0, worst, right);
            fflush(stdout);
            if (!c->key) break;
        }
    }
    return 0;
}
