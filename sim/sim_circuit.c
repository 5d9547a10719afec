#include "sim_circuit.h"

#include <math.h>

static const double sqrt3 = 1.7320508075688772;

// What the inverter takes from each phase at the line's currents. Turns the frame's x, y by c, s to phase a's axis.
static void subtract_loss(const dqw_sim_plant *p, double c, double s, double i_x, double i_y, dqw_sim_point *o)
{
    const double alpha = c * i_x - s * i_y, beta = s * i_x + c * i_y;
    const double i_b = 0.5 * (sqrt3 * beta - alpha), i_c = -0.5 * (sqrt3 * beta + alpha);
    double a, b, g, scale = 1;
    if (p->curve) {
        a = dqw_sim_curve_at(p->curve, alpha), b = dqw_sim_curve_at(p->curve, i_b), g = dqw_sim_curve_at(p->curve, i_c);
    } else {
        const double k = p->dead_time_width_inv;
        a = tanh(k * alpha), b = tanh(k * i_b), g = tanh(k * i_c), scale = p->now.dead_time_V.value;
    }
    const double lost_alpha = scale * (2 * a - b - g) / 3, lost_beta = scale * (b - g) / sqrt3;
    o->v_x_V -= c * lost_alpha + s * lost_beta;
    o->v_y_V -= c * lost_beta - s * lost_alpha;
}

// Stator circuit with phase a unlike the others: dR more in series, and mu of its turns shorted through r_f. All turns
// share one flux, so the short needs no state of its own: Bachir, Tnani, Trigeassou, Champenois, IEEE Trans. Ind.
// Electron. 53(3),
// 2006, with their direct short generalised to r_f. Along phase a (alpha), with m = 2 mu / 3, d = 2 dR / 3 and G =
// 1/R_fe:
//     v = (R + d) i - m R i_f + e,   i = i_m + G e + m i_f,   (r_f + mu R) i_f = mu (R i + e);
// along beta v = R i + e, i = i_m + G e.
static void shorted_circuit(const dqw_sim_plant *p, double R, double c, double s, double im_x, double im_y,
                            dqw_sim_point *o)
{
    const double mu = p->now.turn_short.value, m = mu * (2.0 / 3), dR = p->extra_a_ohm, d = dR * (2.0 / 3),
                 G = o->iron_S;
    const double v_alpha = c * o->v_x_V - s * o->v_y_V, v_beta = s * o->v_x_V + c * o->v_y_V;
    const double im_alpha = c * im_x - s * im_y, im_beta = s * im_x + c * im_y;
    const double k = mu > 0 ? mu / (p->now.turn_short_ohm + mu * R * (1 - m)) : 0;
    const double e_alpha = (v_alpha - (R + d + m * d * k * R) * im_alpha) / (1 + (R + d) * G + m * d * k * (1 + R * G));
    const double e_beta = (v_beta - R * im_beta) / (1 + R * G);
    const double i_f = k * (R * im_alpha + (1 + R * G) * e_alpha);
    const double i_alpha = im_alpha + G * e_alpha + m * i_f, i_beta = im_beta + G * e_beta;
    o->e_x_V = c * e_alpha + s * e_beta, o->e_y_V = c * e_beta - s * e_alpha;
    o->i_x_A = c * i_alpha + s * i_beta, o->i_y_A = c * i_beta - s * i_alpha;
    const double in_short = i_alpha - i_f, bc = 0.5 * (i_alpha * i_alpha + 3 * i_beta * i_beta);
    o->copper_W = R * ((1 - mu) * i_alpha * i_alpha + mu * in_short * in_short + bc) +
                  p->now.turn_short_ohm * i_f * i_f + dR * i_alpha * i_alpha;
}

static void healthy_circuit(double R, double im_x, double im_y, dqw_sim_point *o)
{
    const double G = o->iron_S, k = 1 / (1 + R * G);
    o->e_x_V = (o->v_x_V - R * im_x) * k, o->e_y_V = (o->v_y_V - R * im_y) * k;
    o->i_x_A = im_x + G * o->e_x_V, o->i_y_A = im_y + G * o->e_y_V;
    o->copper_W = 1.5 * R * (o->i_x_A * o->i_x_A + o->i_y_A * o->i_y_A);
}

// Extra resistances A, B in series with phases a and b, and the sum of the currents zero: in the stationary frame the
// matrix
//     M = [2A/3 + B/6, -B/(2 sqrt 3); -B/(2 sqrt 3), B/2],   v = (R + M) i + e,   i = i_m + G e.
static void unequal_circuit(const dqw_sim_plant *p, double R, double c, double s, double im_x, double im_y,
                            dqw_sim_point *o)
{
    const double A = p->extra_a_ohm, B = p->extra_b_ohm, G = o->iron_S;
    const double m_aa = R + (2.0 / 3) * A + B / 6, m_ab = -B / (2 * sqrt3), m_bb = R + 0.5 * B;
    const double im_alpha = c * im_x - s * im_y, im_beta = s * im_x + c * im_y;
    const double rest_alpha = c * o->v_x_V - s * o->v_y_V - m_aa * im_alpha - m_ab * im_beta;
    const double rest_beta = s * o->v_x_V + c * o->v_y_V - m_ab * im_alpha - m_bb * im_beta;
    const double a = 1 + G * m_aa, b = G * m_ab, d = 1 + G * m_bb, det_inv = 1 / (a * d - b * b);
    const double e_alpha = (d * rest_alpha - b * rest_beta) * det_inv,
                 e_beta = (a * rest_beta - b * rest_alpha) * det_inv;
    const double i_alpha = im_alpha + G * e_alpha, i_beta = im_beta + G * e_beta,
                 i_b = 0.5 * (sqrt3 * i_beta - i_alpha);
    o->e_x_V = c * e_alpha + s * e_beta, o->e_y_V = c * e_beta - s * e_alpha;
    o->i_x_A = c * i_alpha + s * i_beta, o->i_y_A = c * i_beta - s * i_alpha;
    o->copper_W = 1.5 * R * (i_alpha * i_alpha + i_beta * i_beta) + A * i_alpha * i_alpha + B * i_b * i_b;
}

// The vector of the legs' outputs at these currents.
static void switched_voltage(const dqw_sim_plant *p, const double *y, dqw_sim_point *o, double *v_alpha, double *v_beta)
{
    double i_A[3], v_V[3];
    dqw_sim_phases_of(o->i_alpha_A, o->i_beta_A, i_A);
    for (int n = 0; n < 3; ++n)
        v_V[n] = dqw_sim_leg_V(p->legs, n, i_A[n], o->v_link_V, p->at_node >= 0 ? y[p->at_node + n] : 0);
    *v_alpha += (2 * v_V[0] - v_V[1] - v_V[2]) * (1.0 / 3), *v_beta += (v_V[1] - v_V[2]) * (1 / sqrt3);
    o->i_link_A = dqw_sim_legs_link_A(p->legs, i_A);
}

// (E98): currents of the eddies and of the shorted turns are states here, each behind an inductance of its own: at an
// edge of the inverter they cannot jump, as those of shorted_circuit would. Otherwise the same circuit, with phase b
// unlike too.
static void branched_circuit(const dqw_sim_plant *p, double R, double c, double s, double im_x, double im_y,
                             const double *y, dqw_sim_point *o)
{
    const double A = p->extra_a_ohm, B = p->extra_b_ohm, m = p->now.turn_short.value * (2.0 / 3);
    const double i_f = p->at_short >= 0 ? y[p->at_short] : 0;
    o->i_alpha_A = c * im_x - s * im_y + m * i_f, o->i_beta_A = s * im_x + c * im_y;
    if (p->at_iron >= 0) o->i_alpha_A += y[p->at_iron], o->i_beta_A += y[p->at_iron + 1];
    const double i_alpha = o->i_alpha_A, i_beta = o->i_beta_A, i_b = 0.5 * (sqrt3 * i_beta - i_alpha);
    double v_alpha = c * o->v_x_V - s * o->v_y_V, v_beta = s * o->v_x_V + c * o->v_y_V;
    if (p->legs) switched_voltage(p, y, o, &v_alpha, &v_beta);
    o->v_x_V = c * v_alpha + s * v_beta, o->v_y_V = c * v_beta - s * v_alpha;
    const double m_ab = -B * (0.5 / sqrt3);
    o->e_alpha_V = v_alpha - (R + (2.0 / 3) * A + (1.0 / 6) * B) * i_alpha - m_ab * i_beta + m * R * i_f;
    o->e_beta_V = v_beta - m_ab * i_alpha - (R + 0.5 * B) * i_beta;
    o->e_x_V = c * o->e_alpha_V + s * o->e_beta_V, o->e_y_V = c * o->e_beta_V - s * o->e_alpha_V;
    o->i_x_A = c * i_alpha + s * i_beta, o->i_y_A = c * i_beta - s * i_alpha;
    const double mu = p->now.turn_short.value, in_short = i_alpha - i_f,
                 bc = 0.5 * (i_alpha * i_alpha + 3 * i_beta * i_beta);
    o->copper_W = R * ((1 - mu) * i_alpha * i_alpha + mu * in_short * in_short + bc) +
                  p->now.turn_short_ohm * i_f * i_f + A * i_alpha * i_alpha + B * i_b * i_b;
    o->R_ohm = R;
}

void dqw_sim_circuit_branches(const dqw_sim_plant *p, const dqw_sim_point *o, const double *y, double *dy)
{
    if (p->at_iron >= 0) {
        dy[p->at_iron] = p->iron_tau_inv * (o->iron_S * o->e_alpha_V - y[p->at_iron]);
        dy[p->at_iron + 1] = p->iron_tau_inv * (o->iron_S * o->e_beta_V - y[p->at_iron + 1]);
    }
    if (p->at_short >= 0) {
        const double mu = p->now.turn_short.value;
        dy[p->at_short] = (mu * (o->R_ohm * o->i_alpha_A + o->e_alpha_V) -
                           (p->now.turn_short_ohm + mu * o->R_ohm) * y[p->at_short]) /
                          p->now.turn_short_H;
    }
}

double dqw_sim_circuit_energy(const dqw_sim_plant *p, const double *y)
{
    return p->at_short >= 0 ? 0.5 * p->now.turn_short_H * y[p->at_short] * y[p->at_short] : 0;
}

typedef struct {
    const dqw_sim_plant *p;
    double R, c, s, im_x, im_y, v_x_V, v_y_V;
    bool loss, unlike;
} dqw_sim_circuit_at;

// Currents and voltages of a circuit without branches whose legs lose as these currents have them.
static void circuit_of(const dqw_sim_circuit_at *at, double i_x, double i_y, dqw_sim_point *o)
{
    o->v_x_V = at->v_x_V, o->v_y_V = at->v_y_V;
    if (at->loss) subtract_loss(at->p, at->c, at->s, i_x, i_y, o);
    if (!at->unlike)
        healthy_circuit(at->R, at->im_x, at->im_y, o);
    else if (at->p->extra_b_ohm != 0)
        unequal_circuit(at->p, at->R, at->c, at->s, at->im_x, at->im_y, o);
    else
        shorted_circuit(at->p, at->R, at->c, at->s, at->im_x, at->im_y, o);
}

// The line's currents by which the legs lose what leaves those: Newton's steps, slopes by difference. The loss grows
// with the current, so there is one solution.
static void close_loop(const dqw_sim_circuit_at *at, dqw_sim_point *o)
{
    double i[2] = {at->im_x, at->im_y};
    for (int n = 0; n < 20; ++n) {
        circuit_of(at, i[0], i[1], o);
        const double size = fabs(o->i_x_A) + fabs(o->i_y_A) + 1e-3, step = 1e-7 * size,
                     off[2] = {o->i_x_A - i[0], o->i_y_A - i[1]};
        if (fabs(off[0]) + fabs(off[1]) <= 1e-13 * size) return;
        double J[2][2];
        for (int k = 0; k < 2; ++k) {
            dqw_sim_point moved = *o;
            circuit_of(at, i[0] + (k == 0 ? step : 0), i[1] + (k == 1 ? step : 0), &moved);
            J[0][k] = (k == 0) - (moved.i_x_A - o->i_x_A) / step, J[1][k] = (k == 1) - (moved.i_y_A - o->i_y_A) / step;
        }
        const double det_inv = 1 / (J[0][0] * J[1][1] - J[0][1] * J[1][0]);
        i[0] += det_inv * (J[1][1] * off[0] - J[0][1] * off[1]);
        i[1] += det_inv * (J[0][0] * off[1] - J[1][0] * off[0]);
    }
}

void dqw_sim_circuit(const dqw_sim_plant *p, double R, double im_x, double im_y, const double *y, dqw_sim_point *o)
{
    if (p->legs || p->at_iron >= 0 || p->at_short >= 0) {
        double c = p->cos_frame, s = p->sin_frame;
        if (p->turning_frame) c = cos(p->theta_e_rad + o->turn_rad), s = sin(p->theta_e_rad + o->turn_rad);
        if (p->curve || p->now.dead_time_V.value != 0) {
            const double m_i_f = p->at_short >= 0 ? p->now.turn_short.value * (2.0 / 3) * y[p->at_short] : 0,
                         alpha = m_i_f + (p->at_iron >= 0 ? y[p->at_iron] : 0),
                         beta = p->at_iron >= 0 ? y[p->at_iron + 1] : 0;
            subtract_loss(p, c, s, im_x + c * alpha + s * beta, im_y + c * beta - s * alpha, o);
        }
        branched_circuit(p, R, c, s, im_x, im_y, y, o);
        // With the little that eddies store and give back.
        o->iron_W = p->at_iron < 0 ? 0 : 1.5 * (o->e_alpha_V * y[p->at_iron] + o->e_beta_V * y[p->at_iron + 1]);
        return;
    }
    const bool loss = p->curve || p->now.dead_time_V.value != 0,
               unlike = p->now.turn_short.value > 0 || p->extra_a_ohm != 0 || p->extra_b_ohm != 0;
    double c = 1, s = 0;
    if (loss || unlike) {
        const double frame = p->theta_e_rad + (p->turning_frame ? o->turn_rad : 0);
        c = cos(frame), s = sin(frame);
    }
    const dqw_sim_circuit_at at = {p, R, c, s, im_x, im_y, o->v_x_V, o->v_y_V, loss, unlike};
    // What iron and short take of the line's current hangs on the voltage, and that on the current where legs lose.
    if (loss && (o->iron_S != 0 || p->now.turn_short.value > 0))
        close_loop(&at, o);
    else
        circuit_of(&at, im_x, im_y, o);
    o->iron_W = 1.5 * o->iron_S * (o->e_x_V * o->e_x_V + o->e_y_V * o->e_y_V);
}
