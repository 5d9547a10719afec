#include "sim_plant.h"

#include <math.h>
#include <string.h>

#include "sim_circuit.h"
#include "sim_keys.h"

static const double two_pi = 6.283185307179586;

static double inverse(double x) { return x > 0 ? 1 / x : 0; }

// Lays out the state vector.
static void place_states(dqw_sim_plant *p, const dqw_sim_scenario *s)
{
    const dqw_sim_machine *m = &s->machine;
    const dqw_sim_nonideal *x = &s->nonideal;
    int n = 2;
    p->at_w = s->profile.shaft == DQW_SIM_SHAFT_FREE ? (n += 2) - 2 : -1;
    p->at_temp = m->winding_heat_J_K > 0 ? (n += 2) - 2 : -1;
    p->at_housing = p->at_temp >= 0 && m->housing_heat_J_K > 0 ? n++ : -1;
    p->at_link = s->inverter.source_ohm > 0 ? n++ : -1;
    p->at_node = p->legs && s->inverter.dead_time_s > 0 ? (n += 3) - 3 : -1;
    p->at_iron = x->iron_loss_tau_s > 0 ? (n += 2) - 2 : -1;
    p->at_short = x->turn_short_H > 0 ? n++ : -1;
    p->at_energy = s->balance ? (n += DQW_SIM_ENERGIES) - DQW_SIM_ENERGIES : -1;
    p->states = n;
}

void dqw_sim_plant_init(dqw_sim_plant *p, const dqw_sim_scenario *s, dqw_sim_map *map, const dqw_sim_curve *curve,
                        const dqw_sim_legs *legs)
{
    const dqw_sim_machine *m = &s->machine;
    memset(p, 0, sizeof *p);
    p->p = m->pole_pairs;
    p->R_ref_ohm = m->R_ohm;
    p->temp_ref_C = m->temp_ref_C;
    p->temp_ambient_C = m->temp_ambient_C;
    p->temp_winding_C = p->temp_magnet_C = m->temp_start_C;
    p->flux.map = map;
    p->curve = curve;
    p->legs = legs;
    p->v_source_V = s->drive.v_dc_V;
    p->source_ohm_inv = inverse(s->inverter.source_ohm);
    p->link_F_inv = inverse(s->inverter.link_F);
    p->ripple_V = s->inverter.ripple_V;
    p->ripple_rad_s = two_pi * s->inverter.ripple_Hz;
    p->iron_tau_inv = inverse(s->nonideal.iron_loss_tau_s);
    p->iron_corner_rad_s = s->nonideal.iron_hysteresis_corner_rad_s;
    p->now = s->nonideal;
    p->dead_time_width_inv = inverse(s->nonideal.dead_time_width_A);
    p->J_inv = inverse(m->J_kgm2);
    p->coulomb_width_inv = inverse(m->coulomb_width_rad_s);
    p->stribeck_width_inv = inverse(s->nonideal.stribeck_width_rad_s);
    p->disturbance_rad_s = two_pi * s->nonideal.disturbance_Hz;
    p->winding_heat_inv = inverse(m->winding_heat_J_K);
    p->magnet_heat_inv = inverse(m->magnet_heat_J_K);
    p->winding_magnet_W_K = m->winding_magnet_W_K;
    p->winding_ambient_W_K = m->winding_ambient_W_K;
    p->magnet_ambient_W_K = m->magnet_ambient_W_K;
    p->housing_heat_inv = inverse(m->housing_heat_J_K);
    p->winding_housing_W_K = m->winding_housing_W_K;
    p->magnet_housing_W_K = m->magnet_housing_W_K;
    p->housing_ambient_W_K = m->housing_ambient_W_K;
    p->turning_frame = s->drive.hold == DQW_SIM_HOLD_DQ;
    place_states(p, s);
}

bool dqw_sim_plant_ramp(dqw_sim_plant *p, const dqw_sim_scenario *s, double t_s)
{
    const dqw_sim_machine *m = &s->machine;
    const dqw_sim_nonideal *x = &p->now;
    dqw_sim_ramps_at(s, t_s, &p->now);
    p->extra_a_ohm = x->phase_connection_ohm.value + x->phase_resistance_a_ohm.value;
    p->extra_b_ohm = x->phase_resistance_b_ohm.value;
    p->harmonic = x->flux_harmonic_6d_Wb.value != 0 || x->flux_harmonic_6q_Wb.value != 0 ||
                  x->flux_harmonic_12d_Wb.value != 0 || x->flux_harmonic_12q_Wb.value != 0 ||
                  x->magnet_asymmetry_Wb.value != 0;
    p->coulomb_Nm = m->coulomb_Nm + x->bearing_Nm.value;
    p->B_Nms_rad = m->B_Nms_rad + x->bearing_B_Nms_rad.value;
    const double kept = 1 - x->demagnetisation.value;
    dqw_sim_map *map = p->flux.map;
    if (map) {
        double psi_q, L[3];
        dqw_sim_map_flux(map, 0, 0, &p->flux.map_psi_m_Wb, &psi_q, L);
        p->psi_ref_Wb = p->flux.map_psi_m_Wb * kept;
        return true;
    }
    p->psi_ref_Wb = m->psi_Wb * kept;
    return dqw_sim_flux_init(&p->flux, m->Ld_H, m->Lq_H, m->psi_Wb, x->saturation_dd_A_Wb3.value,
                             x->saturation_qq_A_Wb3.value, x->saturation_dq_A_Wb3.value);
}

double dqw_sim_plant_magnet(const dqw_sim_plant *p, double temp_magnet_C)
{
    return p->psi_ref_Wb * (1 + p->now.magnet_beta_per_K.value * (temp_magnet_C - p->temp_ref_C));
}

dqw_sim_harmonic dqw_sim_plant_harmonic(const dqw_sim_plant *p, double theta_e_rad)
{
    const dqw_sim_nonideal *x = &p->now;
    const struct {
        double order, d_Wb, q_Wb, phase_rad;
    } parts[] = {
        {6, x->flux_harmonic_6d_Wb.value, x->flux_harmonic_6q_Wb.value, x->flux_harmonic_6_phase_rad},
        {12, x->flux_harmonic_12d_Wb.value, x->flux_harmonic_12q_Wb.value, x->flux_harmonic_12_phase_rad},
    };
    dqw_sim_harmonic h = {0, 0, 0, 0};
    if (!p->harmonic) return h;
    for (size_t k = 0; k < sizeof parts / sizeof *parts; ++k) {
        const double n = parts[k].order, d_Wb = parts[k].d_Wb, q_Wb = parts[k].q_Wb;
        if (d_Wb == 0 && q_Wb == 0) continue;
        const double angle = n * theta_e_rad + parts[k].phase_rad, c = cos(angle), s = sin(angle);
        h.d_Wb += d_Wb * c, h.q_Wb += q_Wb * s;
        h.d_slope_Wb -= n * d_Wb * s, h.q_slope_Wb += n * q_Wb * c;
    }
    if (x->magnet_asymmetry_Wb.value != 0) {
        const double theta_m_rad = p->theta_m_rad + (theta_e_rad - p->theta_e_rad) / p->p,
                     angle = theta_m_rad + x->magnet_asymmetry_phase_rad;
        h.d_Wb += x->magnet_asymmetry_Wb.value * cos(angle);
        h.d_slope_Wb -= x->magnet_asymmetry_Wb.value * sin(angle) / p->p;
    }
    return h;
}

static double friction_Nm(const dqw_sim_plant *p, double w)
{
    double dry = w < 0 ? p->coulomb_Nm - p->now.friction_asymmetry_Nm.value
                       : p->coulomb_Nm + p->now.friction_asymmetry_Nm.value;
    if (p->now.stribeck_Nm.value != 0)
        dry += p->now.stribeck_Nm.value * exp(-p->stribeck_width_inv * w * p->stribeck_width_inv * w);
    double friction = p->B_Nms_rad * w;
    if (dry != 0) friction += dry * tanh(p->coulomb_width_inv * w);
    return friction;
}

// A rotor turns little within a PWM period, and legs ask a hundred times in it: Taylor to below 1e-15 up to half a
// radian, in half the time of cos and sin.
static void turned(double x, double *c, double *s)
{
    if (fabs(x) > 0.5) {
        *c = cos(x), *s = sin(x);
        return;
    }
    const double u = x * x;
    *s = x * (1 - u * (1.0 / 6) *
                      (1 - u * (1.0 / 20) *
                               (1 - u * (1.0 / 42) *
                                        (1 - u * (1.0 / 72) * (1 - u * (1.0 / 110) * (1 - u * (1.0 / 156)))))));
    *c = 1 - u * (1.0 / 2) *
                 (1 - u * (1.0 / 12) *
                          (1 - u * (1.0 / 30) * (1 - u * (1.0 / 56) * (1 - u * (1.0 / 90) * (1 - u * (1.0 / 132))))));
}

bool dqw_sim_plant_point(const dqw_sim_plant *p, double tau_s, const double *y, dqw_sim_point *o)
{
    if (p->at_w >= 0) {
        o->w_m_rad_s = y[p->at_w];
        o->turn_rad = y[p->at_w + 1];
    } else {
        o->w_m_rad_s = p->w_m_rad_s + p->accel_rad_s2 * tau_s;
        o->turn_rad = p->p * tau_s * (p->w_m_rad_s + 0.5 * p->accel_rad_s2 * tau_s);
    }
    o->temp_winding_C = p->at_temp >= 0 ? y[p->at_temp] : p->temp_winding_C;
    o->temp_magnet_C = p->at_temp >= 0 ? y[p->at_temp + 1] : p->temp_magnet_C;
    o->temp_housing_C = p->at_housing >= 0 ? y[p->at_housing] : p->temp_winding_C;
    o->psi_m_Wb = dqw_sim_plant_magnet(p, o->temp_magnet_C);
    o->iron_S = p->now.iron_loss_S.value;
    if (p->now.iron_hysteresis_S_rad_s.value != 0)
        o->iron_S += p->now.iron_hysteresis_S_rad_s.value /
                     sqrt(p->p * o->w_m_rad_s * p->p * o->w_m_rad_s + p->iron_corner_rad_s * p->iron_corner_rad_s);
    double R = p->R_ref_ohm * (1 + p->now.winding_alpha_per_K.value * (o->temp_winding_C - p->temp_ref_C));
    if (p->now.skin_effect_s2_rad2.value != 0)
        R *= 1 + p->now.skin_effect_s2_rad2.value * (p->p * o->w_m_rad_s) * (p->p * o->w_m_rad_s);

    double c = 1, s = 0;
    if (p->legs)
        turned(o->turn_rad, &c, &s);
    else if (!p->turning_frame)
        c = cos(o->turn_rad), s = sin(o->turn_rad);
    o->psi_d_Wb = c * y[0] + s * y[1];
    o->psi_q_Wb = c * y[1] - s * y[0];
    dqw_sim_harmonic h = {0, 0, 0, 0};
    if (p->harmonic) h = dqw_sim_plant_harmonic(p, p->theta_e_rad + o->turn_rad);
    double im_d, im_q;
    if (!dqw_sim_flux_currents(&p->flux, o->psi_m_Wb, o->psi_d_Wb - h.d_Wb, o->psi_q_Wb - h.q_Wb, &im_d, &im_q))
        return false;
    const double im_x = c * im_d - s * im_q, im_y = s * im_d + c * im_q;
    o->torque_Nm = 1.5 * p->p * (o->psi_d_Wb * im_q - o->psi_q_Wb * im_d + h.d_slope_Wb * im_d + h.q_slope_Wb * im_q);

    o->v_x_V = p->v_x_V, o->v_y_V = p->v_y_V;
    if (p->now.disturbance_V.value != 0) {
        const double phase = p->disturbance_rad_s * (p->t_s + tau_s), d = p->now.disturbance_V.value * sin(phase),
                     q = -p->now.disturbance_V.value * cos(phase);
        o->v_x_V += c * d - s * q, o->v_y_V += s * d + c * q;
    }
    o->v_link_V = p->at_link >= 0 ? y[p->at_link] : dqw_sim_plant_source(p, tau_s);
    o->i_link_A = 0;
    dqw_sim_circuit(p, R, im_x, im_y, y, o);
    o->i_d_A = c * o->i_x_A + s * o->i_y_A;
    o->i_q_A = c * o->i_y_A - s * o->i_x_A;
    o->friction_Nm = friction_Nm(p, o->w_m_rad_s);
    o->against_Nm = p->load_Nm;
    if (p->now.cogging_Nm.value != 0)
        o->against_Nm -= p->now.cogging_Nm.value *
                         sin(p->now.cogging_order * (p->theta_m_rad + o->turn_rad / p->p) + p->now.cogging_phase_rad);
    return true;
}

double dqw_sim_plant_source(const dqw_sim_plant *p, double tau_s)
{
    return p->v_source_V + (p->ripple_V > 0 ? p->ripple_V * sin(p->ripple_rad_s * (p->t_s + tau_s)) : 0);
}

// To the ambient, less what comes from elsewhere.
static double heat_out_W(const dqw_sim_plant *p, const dqw_sim_point *o)
{
    const double housing = p->at_housing >= 0 ? p->housing_ambient_W_K * (o->temp_housing_C - p->temp_ambient_C) : 0;
    return p->winding_ambient_W_K * (o->temp_winding_C - p->temp_ambient_C) +
           p->magnet_ambient_W_K * (o->temp_magnet_C - p->temp_ambient_C) + housing - p->now.heat_W.value;
}

// Returns the magnet's slope in K/s.
static double heat(const dqw_sim_plant *p, const dqw_sim_point *o, double *dy)
{
    const bool housing = p->at_housing >= 0;
    const double across = p->winding_magnet_W_K * (o->temp_winding_C - o->temp_magnet_C);
    double into_winding = o->copper_W - across - p->winding_ambient_W_K * (o->temp_winding_C - p->temp_ambient_C),
           into_magnet = across - p->magnet_ambient_W_K * (o->temp_magnet_C - p->temp_ambient_C);
    if (housing) {
        const double winding = p->winding_housing_W_K * (o->temp_winding_C - o->temp_housing_C),
                     magnet = p->magnet_housing_W_K * (o->temp_magnet_C - o->temp_housing_C),
                     out = p->housing_ambient_W_K * (o->temp_housing_C - p->temp_ambient_C);
        into_winding -= winding, into_magnet -= magnet;
        dy[p->at_housing] = p->housing_heat_inv * (o->iron_W + winding + magnet + p->now.heat_W.value - out);
    } else {
        into_magnet += o->iron_W, into_winding += p->now.heat_W.value;
    }
    dy[p->at_temp] = p->winding_heat_inv * into_winding;
    return dy[p->at_temp + 1] = p->magnet_heat_inv * into_magnet;
}

// What is neither flux nor shaft nor heat: the link, outputs that float, branches of the stator.
static void others(const dqw_sim_plant *p, double tau_s, const double *y, const dqw_sim_point *o, double *dy)
{
    if (p->at_link >= 0)
        dy[p->at_link] = p->link_F_inv *
                         (p->source_ohm_inv * (dqw_sim_plant_source(p, tau_s) - o->v_link_V) - o->i_link_A);
    if (p->at_node >= 0) {
        double i_A[3];
        dqw_sim_phases_of(o->i_alpha_A, o->i_beta_A, i_A);
        for (int n = 0; n < 3; ++n) dy[p->at_node + n] = dqw_sim_leg_V_s(p->legs, n, i_A[n]);
    }
    dqw_sim_circuit_branches(p, o, y, dy);
}

bool dqw_sim_plant_slopes(const dqw_sim_plant *p, double tau_s, const double *y, const dqw_sim_point *o, double *dy)
{
    const double w_frame = p->turning_frame ? p->p * o->w_m_rad_s : 0;
    dy[0] = o->e_x_V + w_frame * y[1];
    dy[1] = o->e_y_V - w_frame * y[0];
    if (p->at_w >= 0) {
        dy[p->at_w] = (o->torque_Nm - o->friction_Nm - o->against_Nm) * p->J_inv;
        dy[p->at_w + 1] = p->p * o->w_m_rad_s;
    }
    const double magnet_K_s = p->at_temp >= 0 ? heat(p, o, dy) : 0;
    others(p, tau_s, y, o, dy);
    if (p->at_energy >= 0) {
        double *e = dy + p->at_energy, W, dW_dpsi_m = 0;
        const dqw_sim_harmonic h = dqw_sim_plant_harmonic(p, p->theta_e_rad + o->turn_rad);
        if (magnet_K_s != 0 &&
            !dqw_sim_flux_energy(&p->flux, o->psi_m_Wb, o->psi_d_Wb - h.d_Wb, o->psi_q_Wb - h.q_Wb, &W, &dW_dpsi_m))
            return false;
        e[DQW_SIM_E_ELECTRICAL] = 1.5 * (o->v_x_V * o->i_x_A + o->v_y_V * o->i_y_A);
        e[DQW_SIM_E_COPPER] = o->copper_W;
        e[DQW_SIM_E_IRON] = o->iron_W;
        e[DQW_SIM_E_MECHANICAL] = o->torque_Nm * o->w_m_rad_s;
        e[DQW_SIM_E_MAGNET] = -1.5 * dW_dpsi_m * p->psi_ref_Wb * p->now.magnet_beta_per_K.value * magnet_K_s;
        e[DQW_SIM_E_FRICTION] = o->friction_Nm * o->w_m_rad_s;
        e[DQW_SIM_E_LOAD] = o->against_Nm * o->w_m_rad_s;
        e[DQW_SIM_E_AMBIENT] = p->at_temp >= 0 ? heat_out_W(p, o) : 0;
    }
    return true;
}

void dqw_sim_plant_margins(const dqw_sim_plant *p, const double *y, const dqw_sim_point *o, double margin[6])
{
    double i_A[3];
    for (int k = 0; k < 6; ++k) margin[k] = 1;
    if (!dqw_sim_legs_open(p->legs)) return;
    dqw_sim_phases_of(o->i_alpha_A, o->i_beta_A, i_A);
    for (int k = 0; k < 6; ++k)
        margin[k] = dqw_sim_leg_margin(p->legs, k / 2, k % 2, i_A[k / 2], o->v_link_V, y[p->at_node + k / 2]);
}

bool dqw_sim_plant_energy(const dqw_sim_plant *p, double theta_e_rad, double psi_m_Wb, double psi_d_Wb, double psi_q_Wb,
                          double *joule)
{
    const dqw_sim_harmonic h = dqw_sim_plant_harmonic(p, theta_e_rad);
    double W, unused;
    if (!dqw_sim_flux_energy(&p->flux, psi_m_Wb, psi_d_Wb - h.d_Wb, psi_q_Wb - h.q_Wb, &W, &unused)) return false;
    *joule = 1.5 * W;
    return true;
}
