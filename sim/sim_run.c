// One run: sample, control, switch, integrate, log.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dqw_sim.h"
#include "sim_check.h"
#include "sim_circuit.h"
#include "sim_control.h"
#include "sim_encoder.h"
#include "sim_hold.h"
#include "sim_modulation.h"
#include "sim_polled.h"
#include "sim_sensor.h"
#include "sim_signal.h"
#include "sim_stage.h"

static const double two_pi = 6.283185307179586;

typedef struct run {
    const dqw_sim_scenario *s;
    dqw_sim_stage stage;
    dqw_sim_controller controller;
    dqw_sim_encoder encoder;
    dqw_sim_row sample;                   // what is true at t_k
    dqw_sim_row seen;                     // what the drive's sensors make of it
    double psi_d_Wb, psi_q_Wb, psi_m_Wb;  // there too
    double
        v_V[4]
           [2];  // stationary (hold = dq: rotor's): decided for the coming period, meant for this one and those before
    double duty[4][3];             // the same, where the inverter switches
    double decided_V[2];           // the newest, in the drive's frame
    dqw_sim_row *own, *own_loops;  // a caller decides, by what is put here
    double more_load_Nm, more_speed_rad_s;
    double seen_turn_rad;  // by which the seen angle is ahead of the true one
    double energy_J[DQW_SIM_ENERGIES], edges_J;
    dqw_sim_report *report;
} run;

static double wrapped(double angle)
{
    const double turned = angle - two_pi * floor(angle / two_pi);
    return turned < two_pi ? turned : 0;
}

static int refuse(dqw_sim_report *report, int status, const char *why, double t_s)
{
    if (t_s >= 0)
        snprintf(report->message, sizeof report->message, "%s at t = %.6g s", why, t_s);
    else
        snprintf(report->message, sizeof report->message, "%s", why);
    return status;
}

static double speed_reference(const dqw_sim_scenario *s, double t_s)
{
    return dqw_sim_signal_at(&s->profile.speed_rad_s, t_s, s->seed, DQW_SIM_STREAM_SPEED);
}

// Gives back what dead time takes from each leg that switches, as far as the controller knows it.
static void compensate(const dqw_sim_scenario *s, double i_alpha_A, double i_beta_A, double duty[3])
{
    const dqw_sim_inverter *x = &s->inverter;
    const double carriers = x->carriers > 1 ? x->carriers : 1,
                 lost = s->drive.compensation * x->dead_time_s * carriers / s->drive.dt_s;
    double i_A[3];
    dqw_sim_phases_of(i_alpha_A, i_beta_A, i_A);
    for (int n = 0; n < 3 && lost > 0; ++n) {
        if (duty[n] <= 0 || duty[n] >= 1) continue;
        const double sign = s->drive.compensation_width_A > 0
                                ? fmax(-1, fmin(1, i_A[n] / s->drive.compensation_width_A))
                                : (i_A[n] > 0) - (i_A[n] < 0);
        const double share = x->dead_side == DQW_SIM_DEAD_UPPER   ? 2 * fmax(sign, 0)
                             : x->dead_side == DQW_SIM_DEAD_LOWER ? 2 * fmin(sign, 0)
                                                                  : sign;
        duty[n] = fmax(0, fmin(1, duty[n] + lost * share));
    }
}

// What the drive's sensors make of the sample at t_k, its currents in the frame of the angle that it sees.
static void see(run *r, long k, double i_alpha_A, double i_beta_A)
{
    const dqw_sim_sensing *x = &r->s->sensing;
    const double i_d_A = r->sample.i_d_A, i_q_A = r->sample.i_q_A;
    r->seen = r->sample;
    dqw_sim_encoder_see(&r->encoder, r->s, k, &r->seen);
    if (r->s->drive.link == DQW_SIM_LINK_NOMINAL) r->seen.v_dc_V = r->s->drive.v_dc_V;
    if (x->noise_A > 0) dqw_sim_sensor_white(r->s, k, &i_alpha_A, &i_beta_A);
    if (r->seen.theta_e_rad != r->sample.theta_e_rad || x->late_periods > 0 || x->filter_s > 0 || x->noise_A > 0) {
        const double c = cos(r->seen.theta_e_rad), s = sin(r->seen.theta_e_rad);
        r->seen.i_d_A = c * i_alpha_A + s * i_beta_A, r->seen.i_q_A = c * i_beta_A - s * i_alpha_A;
    } else {
        r->seen.i_d_A = i_d_A, r->seen.i_q_A = i_q_A;
    }
    r->seen_turn_rad = r->seen.theta_e_rad - r->sample.theta_e_rad;
}

// What the loops take of it.
static dqw_sim_row seen_by_loops(const run *r)
{
    dqw_sim_row seen = r->seen;
    dqw_sim_sensor_mistake(r->s, &seen);
    dqw_sim_sensor_quantise(r->s, &seen);
    return seen;
}

static dqw_sim_measured measured(const dqw_sim_row *seen)
{
    const dqw_sim_measured m = {seen->t_s, seen->i_d_A, seen->i_q_A, seen->w_m_rad_s, seen->theta_e_rad, seen->v_dc_V};
    return m;
}

// A voltage that was decided from what was seen at t_k is applied `ahead` periods later. The angle is carried on to the
// middle of that period.
static void decide(run *r, const dqw_sim_measured m, int ahead, double v_d, double v_q)
{
    const dqw_sim_scenario *s = r->s;
    // hold = dq: the drive's frame as far as it is not the rotor's.
    double angle = r->seen_turn_rad + dqw_sim_ramp_at(&s->nonideal.angle_offset_rad, m.t_s);
    if (s->drive.hold == DQW_SIM_HOLD_ABC)
        angle = m.theta_e_rad +
                (s->drive.unturned ? 0 : (ahead + 0.5) * s->drive.dt_s * s->machine.pole_pairs * m.w_m_rad_s);
    r->decided_V[0] = v_d, r->decided_V[1] = v_q;
    r->v_V[0][0] = cos(angle) * v_d - sin(angle) * v_q;
    r->v_V[0][1] = sin(angle) * v_d + cos(angle) * v_q;
    if (s->inverter.modulation == DQW_SIM_MODULATION_MEAN) return;
    dqw_sim_modulate(s->inverter.modulation, r->v_V[0][0], r->v_V[0][1], m.v_dc_V, r->duty[0]);
    const double c = cos(m.theta_e_rad), si = sin(m.theta_e_rad);
    compensate(s, c * m.i_d_A - si * m.i_q_A, si * m.i_d_A + c * m.i_q_A, r->duty[0]);
}

static void control(run *r, int ahead)
{
    const dqw_sim_row seen = seen_by_loops(r);
    const dqw_sim_measured m = measured(&seen);
    double v_d, v_q;
    dqw_sim_controller_step(&r->controller, r->s, &m, seen.t_s + ahead * r->s->drive.dt_s, &v_d, &v_q);
    decide(r, m, ahead, v_d, v_q);
}

static void take_sample(run *r, double t_s, const dqw_sim_point *o, double turn_rad)
{
    dqw_sim_row *m = &r->sample;
    m->t_s = t_s;
    m->i_d_A = o->i_d_A, m->i_q_A = o->i_q_A, m->w_m_rad_s = o->w_m_rad_s;
    m->theta_m_rad = wrapped(m->theta_m_rad + turn_rad / r->stage.plant.p);
    m->theta_e_rad = wrapped(m->theta_m_rad * r->stage.plant.p);
    m->v_dc_V = o->v_link_V;
    m->temp_winding_C = o->temp_winding_C, m->temp_magnet_C = o->temp_magnet_C, m->torque_Nm = o->torque_Nm;
    r->psi_d_Wb = o->psi_d_Wb, r->psi_q_Wb = o->psi_q_Wb, r->psi_m_Wb = o->psi_m_Wb;
}

// What a ramp does to the stored energy at constant flux is work on the magnet or the iron.
static bool ramp(run *r, double t_s)
{
    double before = 0, after = 0;
    const double psi_m = r->psi_m_Wb;
    if (r->s->balance &&
        !dqw_sim_plant_energy(&r->stage.plant, r->sample.theta_e_rad, psi_m, r->psi_d_Wb, r->psi_q_Wb, &before))
        return false;
    if (!dqw_sim_plant_ramp(&r->stage.plant, r->s, t_s)) return false;
    r->psi_m_Wb = dqw_sim_plant_magnet(&r->stage.plant, r->sample.temp_magnet_C);
    if (r->s->balance &&
        !dqw_sim_plant_energy(&r->stage.plant, r->sample.theta_e_rad, r->psi_m_Wb, r->psi_d_Wb, r->psi_q_Wb, &after))
        return false;
    r->edges_J -= after - before;
    return true;
}

static void fill_state(const run *r, double *y)
{
    const dqw_sim_plant *p = &r->stage.plant;
    y[0] = r->psi_d_Wb, y[1] = r->psi_q_Wb;
    if (p->at_w >= 0) y[p->at_w] = r->sample.w_m_rad_s, y[p->at_w + 1] = 0;
    if (p->at_temp >= 0) y[p->at_temp] = r->sample.temp_winding_C, y[p->at_temp + 1] = r->sample.temp_magnet_C;
    if (p->at_housing >= 0 && p->t_s <= 0) y[p->at_housing] = r->s->machine.temp_start_C;
    for (int k = 0; p->at_energy >= 0 && k < DQW_SIM_ENERGIES; ++k) y[p->at_energy + k] = 0;
}

// (E37). A part of a period too short for the integrator to begin is none.
static int hold_late(run *r, double late_periods, double from_s, double to_s)
{
    const double shortest = 1e-6, dt_s = r->s->drive.dt_s;
    int whole = (int)(late_periods + shortest);
    const double part = late_periods - whole, change_s = part > shortest ? part * dt_s : 0;
    int flag = 0;
    if (from_s < change_s) flag = dqw_sim_stage_hold(&r->stage, r->v_V[whole + 2], from_s, fmin(change_s, to_s));
    return flag < 0 || to_s <= change_s
               ? flag
               : dqw_sim_stage_hold(&r->stage, r->v_V[whole + 1], fmax(from_s, change_s), to_s);
}

static int apply(run *r, double late_periods, double from_s, double to_s)
{
    if (!r->stage.plant.legs) return hold_late(r, late_periods, from_s, to_s);
    return dqw_sim_stage_switch(&r->stage, r->duty[(int)(late_periods + 0.5) + 1], from_s, to_s);
}

// The plant from t_k to t_{k+1}, and on the way what the current sensors hold.
static int advance(run *r, double late_periods, double *i_alpha_A, double *i_beta_A)
{
    const dqw_sim_plant *p = &r->stage.plant;
    const double dt = r->s->drive.dt_s, sample_s = r->s->sensing.late_periods * dt;
    const double *y = dqw_sim_integrator_state(&r->stage.integrator);
    const int flag = sample_s > 0 ? apply(r, late_periods, 0, sample_s) : 0;
    dqw_sim_point o;
    if (flag < 0) return flag;
    if (!dqw_sim_plant_point(p, sample_s, y, &o)) return -1;
    *i_alpha_A = p->cos_frame * o.i_x_A - p->sin_frame * o.i_y_A;
    *i_beta_A = p->sin_frame * o.i_x_A + p->cos_frame * o.i_y_A;
    const dqw_sim_filter *f = &r->stage.integrator.filter;
    if (f->tau_s > 0) *i_alpha_A = f->i_A[0], *i_beta_A = f->i_A[1];
    return apply(r, late_periods, sample_s, dt);
}

// The log's voltage in the frame of the angle that the drive sees.
static void see_voltage(const run *r, double *v_d_V, double *v_q_V)
{
    const double turn = r->seen_turn_rad;
    if (r->s->drive.logged == DQW_SIM_LOGGED_DECIDED) {
        *v_d_V = r->decided_V[0], *v_q_V = r->decided_V[1];
    } else if (turn != 0) {
        const double c = cos(turn), s = sin(turn), v_d = *v_d_V;
        *v_d_V = c * v_d + s * *v_q_V, *v_q_V = c * *v_q_V - s * v_d;
    }
}

// From t_k to t_{k+1}. Returns what the log calls v_d, v_q.
static int period(run *r, long k, double *v_d_V, double *v_q_V)
{
    const dqw_sim_scenario *s = r->s;
    dqw_sim_plant *p = &r->stage.plant;
    const double dt = s->drive.dt_s, t = (double)k * dt;
    dqw_sim_stage_begin(&r->stage, t, r->sample.theta_e_rad, r->sample.theta_m_rad);
    if (!ramp(r, t + 0.5 * dt))
        return refuse(r->report, DQW_SIM_ERR_SCENARIO, "the ramped machine is not invertible", t);
    memmove(r->v_V[1], r->v_V[0], 3 * sizeof r->v_V[0]);
    memmove(r->duty[1], r->duty[0], 3 * sizeof r->duty[0]);
    p->load_Nm = dqw_sim_signal_at(&s->profile.load_Nm, t, s->seed, DQW_SIM_STREAM_LOAD) + r->more_load_Nm;
    if (p->at_w < 0) {
        p->w_m_rad_s = r->sample.w_m_rad_s;
        p->accel_rad_s2 = (speed_reference(s, t + dt) + r->more_speed_rad_s - p->w_m_rad_s) / dt;
    }
    double *y = dqw_sim_integrator_state(&r->stage.integrator), i_alpha_A, i_beta_A;
    fill_state(r, y);
    const int flag = advance(r, dqw_sim_ramp_at(&s->nonideal.delay_periods, t + 0.5 * dt), &i_alpha_A, &i_beta_A);
    dqw_sim_point end;
    if (flag < 0 || !dqw_sim_plant_point(p, dt, y, &end)) {
        char why[120];
        snprintf(why, sizeof why,
                 p->flux.map ? "integration failed (CVODE %d; has the current left the flux map?)"
                             : "integration failed (CVODE %d)",
                 flag);
        return refuse(r->report, DQW_SIM_ERR_SOLVER, why, t);
    }
    if (!(end.v_link_V > 0))
        return refuse(r->report, DQW_SIM_ERR_SCENARIO,
                      "the link has fallen to 0, beyond which its diodes would short it: inverter.source_ohm, link_F",
                      t + dt);
    // The next voltage is computed while this one is applied.
    see(r, k, i_alpha_A, i_beta_A);
    if (r->own) *r->own = r->seen, *r->own_loops = seen_by_loops(r);
    if (!r->own) control(r, 1);
    dqw_sim_hold_mean(p, r->v_V[1], dt, end.turn_rad, r->sample.w_m_rad_s, end.w_m_rad_s, v_d_V, v_q_V);
    see_voltage(r, v_d_V, v_q_V);
    for (int e = 0; p->at_energy >= 0 && e < DQW_SIM_ENERGIES; ++e) r->energy_J[e] += y[p->at_energy + e];
    take_sample(r, (double)(k + 1) * dt, &end, end.turn_rad);
    return 0;
}

static int begin(run *r)
{
    const dqw_sim_scenario *s = r->s;
    dqw_sim_plant *p = &r->stage.plant;
    p->cos_frame = 1;
    if (!dqw_sim_plant_ramp(p, s, 0))
        return refuse(r->report, DQW_SIM_ERR_SCENARIO, "nonideal.saturation_* make the energy non-convex", -1);
    p->w_m_rad_s = p->at_w >= 0 ? s->profile.speed_start_rad_s : speed_reference(s, 0);
    r->psi_m_Wb = dqw_sim_plant_magnet(p, s->machine.temp_start_C);
    dqw_sim_flux_at_rest(&p->flux, r->psi_m_Wb, &r->psi_d_Wb, &r->psi_q_Wb);
    const dqw_sim_harmonic h = dqw_sim_plant_harmonic(p, 0);
    r->psi_d_Wb += h.d_Wb, r->psi_q_Wb += h.q_Wb;
    r->controller.Ld_H = s->machine.Ld_H, r->controller.Lq_H = s->machine.Lq_H,
    r->controller.psi_Wb = s->machine.psi_Wb;
    if (p->flux.map) {
        double L[3], psi_q;
        dqw_sim_map_flux(p->flux.map, 0, 0, &r->controller.psi_Wb, &psi_q, L);
        r->controller.Ld_H = L[0], r->controller.Lq_H = L[2];
    }
    r->report->Ld_H = r->controller.Ld_H, r->report->Lq_H = r->controller.Lq_H, r->report->psi_Wb = r->psi_m_Wb;
    r->sample.w_m_rad_s = p->w_m_rad_s;
    r->sample.temp_winding_C = r->sample.temp_magnet_C = s->machine.temp_start_C;
    r->sample.v_dc_V = s->drive.v_dc_V;
    if (s->balance && !dqw_sim_plant_energy(p, 0, r->psi_m_Wb, r->psi_d_Wb, r->psi_q_Wb, &r->report->stored_start_J))
        return DQW_SIM_ERR_MAP;

    const double L = fmin(r->controller.Ld_H, r->controller.Lq_H), v = s->drive.v_dc_V / sqrt(3),
                 current = s->drive.i_max_A;
    const double flux = L * current, speed = v / (p->p * (r->controller.psi_Wb + flux));
    double tolerance[DQW_SIM_STATES_MAX];
    tolerance[0] = tolerance[1] = s->rtol * flux;
    if (p->at_w >= 0) tolerance[p->at_w] = s->rtol * speed, tolerance[p->at_w + 1] = s->rtol;
    if (p->at_temp >= 0) tolerance[p->at_temp] = tolerance[p->at_temp + 1] = s->rtol * 100;
    if (p->at_housing >= 0) tolerance[p->at_housing] = s->rtol * 100;
    if (p->at_link >= 0) tolerance[p->at_link] = s->rtol * s->drive.v_dc_V;
    // An output floats for a dead time at most: what it errs by then moves the flux by its own tolerance.
    for (int n = 0; p->at_node >= 0 && n < 3; ++n) tolerance[p->at_node + n] = s->rtol * flux / s->inverter.dead_time_s;
    for (int n = 0; p->at_iron >= 0 && n < 2; ++n) tolerance[p->at_iron + n] = s->rtol * current;
    if (p->at_short >= 0) tolerance[p->at_short] = s->rtol * current;
    for (int e = 0; p->at_energy >= 0 && e < DQW_SIM_ENERGIES; ++e)
        tolerance[p->at_energy + e] = s->rtol * v * current * s->drive.dt_s;
    const int status = dqw_sim_integrator_init(&r->stage.integrator, p, s->method, tolerance, L, s->sensing.filter_s);
    if (status == 0 && p->at_link >= 0) dqw_sim_integrator_state(&r->stage.integrator)[p->at_link] = s->drive.v_dc_V;
    return status;
}

static void finish(run *r)
{
    const dqw_sim_machine *m = &r->s->machine;
    dqw_sim_report *o = r->report;
    const double *e = r->energy_J, w0 = r->s->profile.speed_start_rad_s, w1 = r->sample.w_m_rad_s;
    o->steps = r->stage.integrator.steps, o->rhs_evaluations = r->stage.integrator.rhs_evaluations;
    o->error_test_failures = r->stage.integrator.error_test_failures;
    if (!r->s->balance) return;
    o->electrical_J = e[DQW_SIM_E_ELECTRICAL], o->copper_J = e[DQW_SIM_E_COPPER], o->iron_J = e[DQW_SIM_E_IRON];
    o->mechanical_J = e[DQW_SIM_E_MECHANICAL], o->magnet_J = e[DQW_SIM_E_MAGNET] + r->edges_J;
    o->friction_J = e[DQW_SIM_E_FRICTION], o->load_J = e[DQW_SIM_E_LOAD], o->heat_ambient_J = e[DQW_SIM_E_AMBIENT];
    o->kinetic_J = r->stage.plant.at_w >= 0 ? 0.5 * m->J_kgm2 * (w1 * w1 - w0 * w0) : 0;
    o->heat_stored_J = m->winding_heat_J_K * (r->sample.temp_winding_C - m->temp_start_C) +
                       m->magnet_heat_J_K * (r->sample.temp_magnet_C - m->temp_start_C);
    if (!r->stage.integrator.y) return;
    const double *y = dqw_sim_integrator_state(&r->stage.integrator);
    if (r->stage.plant.at_housing >= 0)
        o->heat_stored_J += m->housing_heat_J_K * (y[r->stage.plant.at_housing] - m->temp_start_C);
    dqw_sim_stage_begin(&r->stage, r->sample.t_s, r->sample.theta_e_rad, r->sample.theta_m_rad);
    dqw_sim_plant_energy(&r->stage.plant, r->sample.theta_e_rad, r->psi_m_Wb, r->psi_d_Wb, r->psi_q_Wb,
                         &o->stored_end_J);
    o->stored_end_J += dqw_sim_circuit_energy(&r->stage.plant, y);
}

static int all_periods(run *r, dqw_sim_row *rows, int (*progress)(void *, double), void *ctx)
{
    const dqw_sim_scenario *s = r->s;
    const long periods = dqw_sim_periods(s), every = s->drive.log_every > 1 ? s->drive.log_every : 1;
    const long window = s->drive.log_window > 0 ? s->drive.log_window : every, tick = periods / 100 + 1;
    dqw_sim_row *row = rows;
    double mean_d_V = 0, mean_q_V = 0;
    see(r, -1, 0, 0);
    control(r, 0);
    for (long k = 0; k < periods; ++k) {
        const long phase = k % every - (every - window);
        double v_d, v_q;
        const int status = period(r, k, &v_d, &v_q);
        if (status) return status;
        if (phase == 0) *row = r->seen, mean_d_V = mean_q_V = 0;
        r->report->periods = k + 1;
        if (phase >= 0) mean_d_V += v_d / (double)window, mean_q_V += v_q / (double)window;
        if (phase == window - 1) row->v_d_V = mean_d_V, row->v_q_V = mean_q_V, ++row;
        if (progress && k % tick == 0 && progress(ctx, (double)k / (double)periods))
            return refuse(r->report, DQW_SIM_ERR_ABORTED, "stopped by the caller", -1);
    }
    return 0;
}

static int load_map(const dqw_sim_scenario *s, dqw_sim_map **map, dqw_sim_report *report)
{
    dqw_sim_grid grid;
    int status = dqw_sim_grid_read(s->machine.flux_map, &grid, report->message, sizeof report->message);
    if (status) return status;
    *map = malloc(sizeof **map);
    status = *map ? dqw_sim_map_fit(&grid, *map, report->message, sizeof report->message) : DQW_SIM_ERR_MEMORY;
    dqw_sim_grid_free(&grid);
    if (status) return status;
    report->map_rms_Wb = (*map)->rms_Wb, report->map_max_Wb = (*map)->max_Wb, report->map_curl = (*map)->curl;
    return 0;
}

static int load_curve(const dqw_sim_scenario *s, dqw_sim_curve **curve, dqw_sim_report *report)
{
    *curve = malloc(sizeof **curve);
    return *curve ? dqw_sim_curve_read(s->nonideal.inverter_curve, *curve, report->message, sizeof report->message)
                  : DQW_SIM_ERR_MEMORY;
}

// A log that nobody could read is none.
static int check_rows(const dqw_sim_row *rows, size_t count, dqw_sim_report *report)
{
    for (size_t k = 0; k < count; ++k) {
        const dqw_sim_row *r = &rows[k];
        const double sum = r->t_s + r->v_d_V + r->v_q_V + r->i_d_A + r->i_q_A + r->w_m_rad_s + r->theta_e_rad +
                           r->theta_m_rad + r->v_dc_V + r->temp_winding_C + r->temp_magnet_C + r->torque_Nm;
        if (!isfinite(sum))
            return refuse(report, DQW_SIM_ERR_SCENARIO, "is not finite: a value is far out of scale", r->t_s);
    }
    return 0;
}

int dqw_sim_run(const dqw_sim_scenario *s, dqw_sim_row *rows, size_t capacity, dqw_sim_report *report,
                int (*progress)(void *ctx, double fraction), void *ctx)
{
    dqw_sim_report unread;
    if (!report) report = &unread;
    memset(report, 0, sizeof *report);
    if (!s) return refuse(report, DQW_SIM_ERR_SCENARIO, "no scenario", -1);
    int status = dqw_sim_check(s, report->message, sizeof report->message);
    if (status) return status;
    const size_t count = dqw_sim_rows(s), drive_rows = dqw_sim_drive_rows(s);
    const bool polled = s->polled.rate_Hz > 0;
    if (count == 0)
        return refuse(report, DQW_SIM_ERR_SCENARIO,
                      polled ? "polled.rate_Hz gives no row within duration_s, or all are lost"
                             : "duration_s is shorter than half a row",
                      -1);
    if (!rows || capacity < count) return refuse(report, DQW_SIM_ERR_CAPACITY, "too few rows offered", -1);

    dqw_sim_map *map = NULL;
    dqw_sim_curve *curve = NULL;
    if (s->machine.flux_map[0]) status = load_map(s, &map, report);
    if (status == 0 && s->nonideal.inverter_curve[0]) status = load_curve(s, &curve, report);
    dqw_sim_row *drive = polled ? malloc(drive_rows * sizeof *drive) : rows;
    if (status == 0 && !drive) status = DQW_SIM_ERR_MEMORY;
    run r;
    memset(&r, 0, sizeof r);
    r.s = s, r.report = report;
    if (status == 0) {
        dqw_sim_stage_init(&r.stage, s, map, curve);
        status = begin(&r);
        if (status == 0) status = all_periods(&r, drive, progress, ctx);
        finish(&r);
        dqw_sim_integrator_free(&r.stage.integrator);
    }
    free(map), free(curve);
    if (status == 0)
        dqw_sim_sensor_log(s, drive, drive_rows);
    else if (!report->message[0])
        refuse(report, status, dqw_sim_status_text(status), -1);
    if (status == 0 && polled) dqw_sim_polled_log(s, drive, drive_rows, rows);
    if (polled) free(drive);
    return status ? status : check_rows(rows, count, report);
}

struct dqw_sim_stepper {
    dqw_sim_scenario s;
    run r;
    dqw_sim_report report;
    dqw_sim_row raw, loops;
    dqw_sim_map *map;
    dqw_sim_curve *curve;
    long k;
};

static int told(const dqw_sim_stepper *x, int status, char *why, size_t size)
{
    if (status) snprintf(why, size, "%s", x && x->report.message[0] ? x->report.message : dqw_sim_status_text(status));
    return status;
}

static int open_run(dqw_sim_stepper *x)
{
    dqw_sim_scenario *s = &x->s;
    int status = dqw_sim_check(s, x->report.message, sizeof x->report.message);
    if (status) return status;
    if (s->polled.rate_Hz > 0 || s->drive.log_every > 1 || s->drive.logged != DQW_SIM_LOGGED_MEAN)
        return refuse(&x->report, DQW_SIM_ERR_SCENARIO,
                      "a stepped run logs each period's mean voltage: polled, drive.log_every and drive.logged must be "
                      "as without",
                      -1);
    if (s->machine.flux_map[0]) status = load_map(s, &x->map, &x->report);
    if (status == 0 && s->nonideal.inverter_curve[0]) status = load_curve(s, &x->curve, &x->report);
    if (status) return status;
    x->r.s = s, x->r.report = &x->report;
    x->r.own = &x->raw, x->r.own_loops = &x->loops;
    dqw_sim_stage_init(&x->r.stage, s, x->map, x->curve);
    status = begin(&x->r);
    if (status) return status;
    see(&x->r, -1, 0, 0);
    x->loops = seen_by_loops(&x->r);
    return 0;
}

int dqw_sim_open(const dqw_sim_scenario *s, dqw_sim_stepper **out, dqw_sim_row *seen, char *why, size_t size)
{
    *out = NULL;
    dqw_sim_stepper *x = s ? calloc(1, sizeof *x) : NULL;
    if (!x) return told(NULL, s ? DQW_SIM_ERR_MEMORY : DQW_SIM_ERR_SCENARIO, why, size);
    x->s = *s;
    const int status = told(x, open_run(x), why, size);
    if (status) {
        dqw_sim_close(x);
        return status;
    }
    *seen = x->loops;
    *out = x;
    return 0;
}

int dqw_sim_step(dqw_sim_stepper *x, const dqw_sim_decision *decision, dqw_sim_row *seen, dqw_sim_row *logged,
                 char *why, size_t size)
{
    run *r = &x->r;
    const dqw_sim_measured m = measured(&x->loops);
    double v_d = decision->v_d_V, v_q = decision->v_q_V;
    if (!isfinite(v_d + v_q + decision->load_Nm + decision->speed_rad_s)) {
        refuse(&x->report, DQW_SIM_ERR_VALUE, "a decision that is not finite", m.t_s);
        return told(x, DQW_SIM_ERR_VALUE, why, size);
    }
    dqw_sim_limit(&x->s.drive, m.v_dc_V, &v_d, &v_q);
    decide(r, m, x->k > 0, v_d, v_q);
    r->more_load_Nm = decision->load_Nm, r->more_speed_rad_s = decision->speed_rad_s;
    const int status = period(r, x->k++, &v_d, &v_q);
    if (status) return told(x, status, why, size);
    x->raw.v_d_V = x->loops.v_d_V = v_d, x->raw.v_q_V = x->loops.v_q_V = v_q;
    *seen = x->loops, *logged = x->raw;
    return told(x, check_rows(logged, 1, &x->report), why, size);
}

void dqw_sim_log_of(const dqw_sim_stepper *x, dqw_sim_row *rows, size_t count)
{
    dqw_sim_sensor_log(&x->s, rows, count);
}

void dqw_sim_close(dqw_sim_stepper *x)
{
    if (!x) return;
    dqw_sim_integrator_free(&x->r.stage.integrator);
    free(x->map), free(x->curve), free(x);
}
