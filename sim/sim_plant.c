#include "sim_plant.h"

#include <math.h>
#include <string.h>

#include "sim_signal.h"

static const double sqrt3 = 1.7320508075688772;

static double inverse(double x) { return x > 0 ? 1 / x : 0; }

void dqw_sim_plant_init(dqw_sim_plant *p, const dqw_sim_scenario *s, dqw_sim_map *map)
{
    const dqw_sim_machine *m = &s->machine;
    memset(p, 0, sizeof *p);
    p->p = m->pole_pairs;
    p->R_ref_ohm = m->R_ohm;
    p->temp_ref_C = m->temp_ref_C;
    p->temp_ambient_C = m->temp_ambient_C;
    p->temp_winding_C = p->temp_magnet_C = m->temp_start_C;
    p->flux.map = map;
    p->short_ohm = s->nonideal.turn_short_ohm;
    p->dead_time_width_inv = inverse(s->nonideal.dead_time_width_A);
    p->J_inv = inverse(m->J_kgm2);
    p->coulomb_width_inv = inverse(m->coulomb_width_rad_s);
    p->winding_heat_inv = inverse(m->winding_heat_J_K);
    p->magnet_heat_inv = inverse(m->magnet_heat_J_K);
    p->winding_magnet_W_K = m->winding_magnet_W_K;
    p->winding_ambient_W_K = m->winding_ambient_W_K;
    p->magnet_ambient_W_K = m->magnet_ambient_W_K;
    p->turning_frame = s->drive.hold == DQW_SIM_HOLD_DQ;

    int n = 2;
    p->at_w = s->profile.shaft == DQW_SIM_SHAFT_FREE ? (n += 2) - 2 : -1;
    p->at_temp = m->winding_heat_J_K > 0 ? (n += 2) - 2 : -1;
    p->at_energy = s->balance ? (n += DQW_SIM_ENERGIES) - DQW_SIM_ENERGIES : -1;
    p->states = n;
}

bool dqw_sim_plant_ramp(dqw_sim_plant *p, const dqw_sim_scenario *s, double t_s)
{
    const dqw_sim_machine *m = &s->machine;
    const dqw_sim_nonideal *x = &s->nonideal;
    p->dead_time_V = dqw_sim_ramp_at(&x->dead_time_V, t_s);
    p->iron_S = dqw_sim_ramp_at(&x->iron_loss_S, t_s);
    p->alpha_per_K = dqw_sim_ramp_at(&x->winding_alpha_per_K, t_s);
    p->beta_per_K = dqw_sim_ramp_at(&x->magnet_beta_per_K, t_s);
    p->short_turns = dqw_sim_ramp_at(&x->turn_short, t_s);
    p->connection_ohm = dqw_sim_ramp_at(&x->phase_connection_ohm, t_s);
    p->coulomb_Nm = m->coulomb_Nm + dqw_sim_ramp_at(&x->bearing_Nm, t_s);
    p->B_Nms_rad = m->B_Nms_rad + dqw_sim_ramp_at(&x->bearing_B_Nms_rad, t_s);
    const double kept = 1 - dqw_sim_ramp_at(&x->demagnetisation, t_s);
    dqw_sim_map *map = p->flux.map;
    if (map) {
        double psi_q, L[3];
        dqw_sim_map_flux(map, 0, 0, &p->flux.map_psi_m_Wb, &psi_q, L);
        p->psi_ref_Wb = p->flux.map_psi_m_Wb * kept;
        return true;
    }
    p->psi_ref_Wb = m->psi_Wb * kept;
    return dqw_sim_flux_init(&p->flux, m->Ld_H, m->Lq_H, m->psi_Wb, dqw_sim_ramp_at(&x->saturation_dd_A_Wb3, t_s),
                             dqw_sim_ramp_at(&x->saturation_qq_A_Wb3, t_s), dqw_sim_ramp_at(&x->saturation_dq_A_Wb3, t_s));
}

double dqw_sim_plant_magnet(const dqw_sim_plant *p, double temp_magnet_C) { return p->psi_ref_Wb * (1 + p->beta_per_K * (temp_magnet_C - p->temp_ref_C)); }

// What the inverter's dead time takes from each phase. The currents are those of the windings' flux, without the parts of iron
// loss and short, which hang on the voltage and would close an algebraic loop. Turns the frame's x, y by c, s to phase a's axis.
static void subtract_dead_time(const dqw_sim_plant *p, double c, double s, double im_x, double im_y, double *v_x, double *v_y)
{
    const double alpha = c * im_x - s * im_y, beta = s * im_x + c * im_y, k = p->dead_time_width_inv;
    const double a = tanh(k * alpha), b = tanh(k * 0.5 * (sqrt3 * beta - alpha)), g = tanh(-k * 0.5 * (sqrt3 * beta + alpha));
    const double lost_alpha = p->dead_time_V * (2 * a - b - g) / 3, lost_beta = p->dead_time_V * (b - g) / sqrt3;
    *v_x -= c * lost_alpha + s * lost_beta;
    *v_y -= c * lost_beta - s * lost_alpha;
}

// Stator circuit with phase a unlike the others: a bad connection of dR, and mu of its turns shorted through r_f. All turns share
// one flux, so the short needs no state of its own: Bachir, Tnani, Trigeassou, Champenois, IEEE Trans. Ind. Electron. 53(3),
// 2006, with their direct short generalised to r_f. Along phase a (alpha), with m = 2 mu / 3, d = 2 dR / 3 and G = 1/R_fe:
//     v = (R + d) i - m R i_f + e,   i = i_m + G e + m i_f,   (r_f + mu R) i_f = mu (R i + e);
// along beta v = R i + e, i = i_m + G e.
static void faulty_circuit(const dqw_sim_plant *p, double R, double c, double s, double im_x, double im_y, dqw_sim_point *o)
{
    const double mu = p->short_turns, m = mu * (2.0 / 3), dR = p->connection_ohm, d = dR * (2.0 / 3), G = p->iron_S;
    const double v_alpha = c * o->v_x_V - s * o->v_y_V, v_beta = s * o->v_x_V + c * o->v_y_V;
    const double im_alpha = c * im_x - s * im_y, im_beta = s * im_x + c * im_y;
    const double k = mu > 0 ? mu / (p->short_ohm + mu * R * (1 - m)) : 0;
    const double e_alpha = (v_alpha - (R + d + m * d * k * R) * im_alpha) / (1 + (R + d) * G + m * d * k * (1 + R * G));
    const double e_beta = (v_beta - R * im_beta) / (1 + R * G);
    const double i_f = k * (R * im_alpha + (1 + R * G) * e_alpha);
    const double i_alpha = im_alpha + G * e_alpha + m * i_f, i_beta = im_beta + G * e_beta;
    o->e_x_V = c * e_alpha + s * e_beta, o->e_y_V = c * e_beta - s * e_alpha;
    o->i_x_A = c * i_alpha + s * i_beta, o->i_y_A = c * i_beta - s * i_alpha;
    const double in_short = i_alpha - i_f, bc = 0.5 * (i_alpha * i_alpha + 3 * i_beta * i_beta);
    o->copper_W = R * ((1 - mu) * i_alpha * i_alpha + mu * in_short * in_short + bc) + p->short_ohm * i_f * i_f + dR * i_alpha * i_alpha;
}

static void healthy_circuit(const dqw_sim_plant *p, double R, double im_x, double im_y, dqw_sim_point *o)
{
    const double k = 1 / (1 + R * p->iron_S);
    o->e_x_V = (o->v_x_V - R * im_x) * k, o->e_y_V = (o->v_y_V - R * im_y) * k;
    o->i_x_A = im_x + p->iron_S * o->e_x_V, o->i_y_A = im_y + p->iron_S * o->e_y_V;
    o->copper_W = 1.5 * R * (o->i_x_A * o->i_x_A + o->i_y_A * o->i_y_A);
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
    o->psi_m_Wb = dqw_sim_plant_magnet(p, o->temp_magnet_C);
    const double R = p->R_ref_ohm * (1 + p->alpha_per_K * (o->temp_winding_C - p->temp_ref_C));

    const double c = p->turning_frame ? 1 : cos(o->turn_rad), s = p->turning_frame ? 0 : sin(o->turn_rad);
    o->psi_d_Wb = c * y[0] + s * y[1];
    o->psi_q_Wb = c * y[1] - s * y[0];
    double im_d, im_q;
    if (!dqw_sim_flux_currents(&p->flux, o->psi_m_Wb, o->psi_d_Wb, o->psi_q_Wb, &im_d, &im_q)) return false;
    const double im_x = c * im_d - s * im_q, im_y = s * im_d + c * im_q;
    o->torque_Nm = 1.5 * p->p * (o->psi_d_Wb * im_q - o->psi_q_Wb * im_d);

    o->v_x_V = p->v_x_V, o->v_y_V = p->v_y_V;
    const bool faulty = p->short_turns > 0 || p->connection_ohm > 0;
    double ca = 1, sa = 0;
    if (faulty || p->dead_time_V != 0) {
        const double frame = p->theta_e_rad + (p->turning_frame ? o->turn_rad : 0);
        ca = cos(frame), sa = sin(frame);
    }
    if (p->dead_time_V != 0) subtract_dead_time(p, ca, sa, im_x, im_y, &o->v_x_V, &o->v_y_V);
    if (faulty)
        faulty_circuit(p, R, ca, sa, im_x, im_y, o);
    else
        healthy_circuit(p, R, im_x, im_y, o);
    o->i_d_A = c * o->i_x_A + s * o->i_y_A;
    o->i_q_A = c * o->i_y_A - s * o->i_x_A;
    o->iron_W = 1.5 * p->iron_S * (o->e_x_V * o->e_x_V + o->e_y_V * o->e_y_V);
    o->friction_Nm = p->B_Nms_rad * o->w_m_rad_s;
    if (p->coulomb_Nm != 0) o->friction_Nm += p->coulomb_Nm * tanh(p->coulomb_width_inv * o->w_m_rad_s);
    return true;
}

static double heat_out_W(const dqw_sim_plant *p, const dqw_sim_point *o)
{
    return p->winding_ambient_W_K * (o->temp_winding_C - p->temp_ambient_C) + p->magnet_ambient_W_K * (o->temp_magnet_C - p->temp_ambient_C);
}

bool dqw_sim_plant_rhs(const dqw_sim_plant *p, double tau_s, const double *y, double *dy)
{
    dqw_sim_point o;
    if (!dqw_sim_plant_point(p, tau_s, y, &o)) return false;
    const double w_frame = p->turning_frame ? p->p * o.w_m_rad_s : 0;
    dy[0] = o.e_x_V + w_frame * y[1];
    dy[1] = o.e_y_V - w_frame * y[0];
    if (p->at_w >= 0) {
        dy[p->at_w] = (o.torque_Nm - o.friction_Nm - p->load_Nm) * p->J_inv;
        dy[p->at_w + 1] = p->p * o.w_m_rad_s;
    }
    double magnet_K_s = 0;
    if (p->at_temp >= 0) {
        const double across = p->winding_magnet_W_K * (o.temp_winding_C - o.temp_magnet_C);
        dy[p->at_temp] = p->winding_heat_inv * (o.copper_W - across - p->winding_ambient_W_K * (o.temp_winding_C - p->temp_ambient_C));
        magnet_K_s = p->magnet_heat_inv * (o.iron_W + across - p->magnet_ambient_W_K * (o.temp_magnet_C - p->temp_ambient_C));
        dy[p->at_temp + 1] = magnet_K_s;
    }
    if (p->at_energy >= 0) {
        double *e = dy + p->at_energy, W, dW_dpsi_m = 0;
        if (magnet_K_s != 0 && !dqw_sim_flux_energy(&p->flux, o.psi_m_Wb, o.psi_d_Wb, o.psi_q_Wb, &W, &dW_dpsi_m)) return false;
        e[DQW_SIM_E_ELECTRICAL] = 1.5 * (o.v_x_V * o.i_x_A + o.v_y_V * o.i_y_A);
        e[DQW_SIM_E_COPPER] = o.copper_W;
        e[DQW_SIM_E_IRON] = o.iron_W;
        e[DQW_SIM_E_MECHANICAL] = o.torque_Nm * o.w_m_rad_s;
        e[DQW_SIM_E_MAGNET] = -1.5 * dW_dpsi_m * p->psi_ref_Wb * p->beta_per_K * magnet_K_s;
        e[DQW_SIM_E_FRICTION] = o.friction_Nm * o.w_m_rad_s;
        e[DQW_SIM_E_LOAD] = p->load_Nm * o.w_m_rad_s;
        e[DQW_SIM_E_AMBIENT] = p->at_temp >= 0 ? heat_out_W(p, &o) : 0;
    }
    return true;
}

bool dqw_sim_plant_energy(const dqw_sim_plant *p, double psi_m_Wb, double psi_d_Wb, double psi_q_Wb, double *joule)
{
    double W, unused;
    if (!dqw_sim_flux_energy(&p->flux, psi_m_Wb, psi_d_Wb, psi_q_Wb, &W, &unused)) return false;
    *joule = 1.5 * W;
    return true;
}
