#include "sim_stage.h"

#include <math.h>

#include "sim_circuit.h"
#include "sim_hold.h"

// Less than this part of a period is none: the integrator could not begin.
static const double shortest = 1e-9;

void dqw_sim_stage_init(dqw_sim_stage *g, const dqw_sim_scenario *s, dqw_sim_map *map, const dqw_sim_curve *curve)
{
    const bool switches = s->inverter.modulation != DQW_SIM_MODULATION_MEAN;
    g->carriers = s->inverter.carriers > 1 ? s->inverter.carriers : 1;
    g->dt_s = s->drive.dt_s;
    const dqw_sim_scale scale = {s->drive.v_dc_V, s->drive.i_max_A, fmin(s->machine.Ld_H, s->machine.Lq_H)};
    dqw_sim_legs_init(&g->legs, &s->inverter, &scale, g->dt_s / g->carriers);
    dqw_sim_plant_init(&g->plant, s, map, curve, switches ? &g->legs : NULL);
}

void dqw_sim_stage_begin(dqw_sim_stage *g, double t_s, double theta_e_rad, double theta_m_rad)
{
    dqw_sim_plant *p = &g->plant;
    p->t_s = t_s, p->theta_e_rad = theta_e_rad, p->theta_m_rad = theta_m_rad;
    p->cos_frame = cos(theta_e_rad), p->sin_frame = sin(theta_e_rad);
    dqw_sim_legs_rewind(&g->legs, g->dt_s);
    g->fresh = true;
}

int dqw_sim_stage_hold(dqw_sim_stage *g, const double held_V[2], double from_s, double to_s)
{
    dqw_sim_hold_in_frame(&g->plant, held_V, &g->plant.v_x_V, &g->plant.v_y_V);
    return to_s - from_s > shortest * g->dt_s ? dqw_sim_integrator_span(&g->integrator, from_s, to_s) : 0;
}

static bool point(dqw_sim_stage *g, double t_s, dqw_sim_point *o, double i_A[3])
{
    if (!dqw_sim_plant_point(&g->plant, t_s, dqw_sim_integrator_state(&g->integrator), o)) return false;
    dqw_sim_phases_of(o->i_alpha_A, o->i_beta_A, i_A);
    return true;
}

// What is due at t_s: edges and closing switches, and the legs that a margin has ended. fresh: an output has jumped, or
// begins or ends to float, so that the integrator begins afresh.
static bool act(dqw_sim_stage *g, double t_s, const int ended[6])
{
    dqw_sim_point o;
    double i_A[3], unused_V[3] = {0, 0, 0};
    double *y = dqw_sim_integrator_state(&g->integrator);
    double *node_V = g->plant.at_node >= 0 ? y + g->plant.at_node : unused_V;
    if (!point(g, t_s, &o, i_A)) return false;
    double before_V[3];
    enum dqw_sim_conducts before[3];
    for (int n = 0; n < 3; ++n) {
        before[n] = g->legs.leg[n].conducts;
        before_V[n] = dqw_sim_leg_V(&g->legs, n, i_A[n], o.v_link_V, node_V[n]);
    }
    for (int k = 0; k < 6; ++k)
        if (ended[k]) dqw_sim_leg_commutate(&g->legs, k / 2, k % 2, i_A[k / 2], o.v_link_V, &node_V[k / 2]);
    dqw_sim_legs_switch(&g->legs, t_s, i_A, o.v_link_V, node_V);
    for (int n = 0; n < 3; ++n) {
        const double step_V = dqw_sim_leg_V(&g->legs, n, i_A[n], o.v_link_V, node_V[n]) - before_V[n];
        const bool floats = before[n] == DQW_SIM_FLOATS || g->legs.leg[n].conducts == DQW_SIM_FLOATS;
        g->fresh = g->fresh || fabs(step_V) > 1e-9 * o.v_link_V || (floats && g->legs.leg[n].conducts != before[n]);
    }
    return true;
}

// From edge to edge. What has jumped just before the end is fresh in the next span still.
static int advance(dqw_sim_stage *g, double from_s, double to_s)
{
    int ended[6] = {0, 0, 0, 0, 0, 0};
    double t = from_s;
    if (!act(g, t, ended)) return -1;
    while (t < to_s) {
        const double next = fmin(to_s, dqw_sim_legs_next(&g->legs));
        double reached = next;
        if (next - t > shortest * g->dt_s) {
            const int flag = dqw_sim_integrator_watch(&g->integrator, g->fresh, t, next, &reached, ended);
            if (flag < 0) return flag;
            g->fresh = false;
        }
        t = reached;
        if (t < to_s && !act(g, t, ended)) return -1;
    }
    return 0;
}

int dqw_sim_stage_switch(dqw_sim_stage *g, const double duty[3], double from_s, double to_s)
{
    const double period_s = g->dt_s / g->carriers;
    g->plant.v_x_V = g->plant.v_y_V = 0;
    for (int n = 0; n < g->carriers; ++n) {
        const double begin = n * period_s, end = n + 1 < g->carriers ? begin + period_s : g->dt_s;
        if (end <= from_s || begin >= to_s) continue;
        if (begin >= from_s) dqw_sim_legs_carrier(&g->legs, begin, period_s, duty);
        const int flag = advance(g, fmax(begin, from_s), fmin(end, to_s));
        if (flag < 0) return flag;
    }
    return 0;
}
