#include "bench/strangers/ours.h"

#include <math.h>
#include <string.h>

// Tolerances are those of a run of the simulator.
static int integrator(ours *o, const dqw_sim_scenario *s)
{
    const dqw_sim_plant *p = &o->stage.plant;
    const double L_H = fmin(s->machine.Ld_H, s->machine.Lq_H), flux = L_H * s->drive.i_max_A,
                 speed = s->drive.v_dc_V / sqrt(3) / (p->p * (s->machine.psi_Wb + flux));
    double tolerance[DQW_SIM_STATES_MAX];
    tolerance[0] = tolerance[1] = s->rtol * flux;
    tolerance[p->at_w] = s->rtol * speed, tolerance[p->at_w + 1] = s->rtol;
    tolerance[p->at_link] = s->rtol * s->drive.v_dc_V;
    for (int n = 0; p->at_node >= 0 && n < 3; ++n) tolerance[p->at_node + n] = s->rtol * flux / s->inverter.dead_time_s;
    return dqw_sim_integrator_init(&o->stage.integrator, p, s->method, tolerance, L_H, 0);
}

int ours_init(ours *o, const dqw_sim_scenario *s, double theta_e_rad)
{
    dqw_sim_plant *p = &o->stage.plant;
    memset(o, 0, sizeof *o);
    dqw_sim_stage_init(&o->stage, s, NULL, NULL);
    if (!dqw_sim_plant_ramp(p, s, 0)) return DQW_SIM_ERR_SCENARIO;
    dqw_sim_flux_at_rest(&p->flux, s->machine.psi_Wb, &o->psi_d_Wb, &o->psi_q_Wb);
    o->theta_e_rad = theta_e_rad, o->w_m_rad_s = s->profile.speed_start_rad_s;
    const int status = integrator(o, s);
    if (status == 0) dqw_sim_integrator_state(&o->stage.integrator)[p->at_link] = s->drive.v_dc_V;
    return status;
}

void ours_free(ours *o) { dqw_sim_integrator_free(&o->stage.integrator); }

static int span(ours *o, const double duty[3], double from_s, double to_s, dqw_sim_point *at, instant *out)
{
    const dqw_sim_plant *p = &o->stage.plant;
    const int flag = dqw_sim_stage_switch(&o->stage, duty, from_s, to_s);
    if (flag < 0) return flag;
    if (!dqw_sim_plant_point(p, to_s, dqw_sim_integrator_state(&o->stage.integrator), at)) return -1;
    *out = (instant){at->i_d_A, at->i_q_A, at->v_link_V, o->theta_e_rad + at->turn_rad, p->p * at->w_m_rad_s};
    return 0;
}

int ours_period(ours *o, const double duty[3], instant *middle, instant *end)
{
    const dqw_sim_plant *p = &o->stage.plant;
    const double dt_s = o->stage.dt_s;
    double *y = dqw_sim_integrator_state(&o->stage.integrator);
    dqw_sim_point at;
    dqw_sim_stage_begin(&o->stage, o->t_s, o->theta_e_rad, o->theta_e_rad / p->p);
    y[0] = o->psi_d_Wb, y[1] = o->psi_q_Wb, y[p->at_w] = o->w_m_rad_s, y[p->at_w + 1] = 0;
    int flag = span(o, duty, 0, 0.5 * dt_s, &at, middle);
    if (flag == 0) flag = span(o, duty, 0.5 * dt_s, dt_s, &at, end);
    o->t_s += dt_s, o->theta_e_rad = end->theta_e_rad, o->w_m_rad_s = at.w_m_rad_s;
    o->psi_d_Wb = at.psi_d_Wb, o->psi_q_Wb = at.psi_q_Wb;
    return flag;
}
