#include "sim_rk4.h"

#include <cvode/cvode.h>
#include <math.h>
#include <string.h>

#include "sim_circuit.h"

typedef double state[DQW_SIM_STATES_MAX];

// Step over the fastest time constant: 0.1^5 / 120 is 1e-7 of a mode that decays within the span, and those that last
// longer err by far less.
static const double part = 0.1;

// Near zero current a conducting part's drop bends within its knee: a step goes through one knee at most, or half of
// the way to zero.
static double knee_s(const dqw_sim_integrator *g, const dqw_sim_point *o)
{
    const dqw_sim_plant *p = g->plant;
    double i_A[3];
    if (!p->legs || !(p->legs->x->knee_A > 0)) return INFINITY;
    dqw_sim_phases_of(o->i_alpha_A, o->i_beta_A, i_A);
    const double least = fmin(fabs(i_A[0]), fmin(fabs(i_A[1]), fabs(i_A[2])));
    return fmax(p->legs->x->knee_A, 0.5 * least) * g->L_H / fabs(o->v_link_V);
}

static double step_s(const dqw_sim_integrator *g, const double *y)
{
    const dqw_sim_plant *p = g->plant;
    const double w_e = p->p * fabs(p->at_w >= 0 ? y[p->at_w] : p->w_m_rad_s);
    double R = p->R_ref_ohm + fmax(0, p->extra_a_ohm) + fmax(0, p->extra_b_ohm);
    if (p->legs) R += fmax(p->legs->x->switch_ohm, p->legs->x->diode_ohm);
    double rate = R / g->L_H + w_e;
    if (p->at_link >= 0) rate = fmax(rate, p->link_F_inv * p->source_ohm_inv);
    if (p->at_link >= 0) rate = fmax(rate, sqrt(p->link_F_inv / g->L_H));
    if (p->at_iron >= 0) rate = fmax(rate, p->iron_tau_inv);
    if (p->at_short >= 0)
        rate = fmax(rate, (p->now.turn_short_ohm + p->now.turn_short.value * p->R_ref_ohm) / p->now.turn_short_H);
    if (p->ripple_V > 0) rate = fmax(rate, p->ripple_rad_s);
    if (p->now.disturbance_V.value != 0) rate = fmax(rate, p->disturbance_rad_s);
    for (int n = 0; p->legs && p->at_node >= 0 && n < 3; ++n)
        if (p->legs->leg[n].conducts == DQW_SIM_FLOATS) rate = fmax(rate, sqrt(1.5 / (g->L_H * p->legs->node_F)));
    return part / rate;
}

// So many steps a span are no campaign: something is far faster than the rest of the plant.
static const long steps_max = 1000000;

static bool slopes(const dqw_sim_plant *p, double t_s, const double *y, double *dy)
{
    dqw_sim_point o;
    return dqw_sim_plant_point(p, t_s, y, &o) && dqw_sim_plant_slopes(p, t_s, y, &o, dy);
}

// A step, and the state in its middle by the method's own interpolant, whose error is of order four.
static bool advance(const dqw_sim_plant *p, double t_s, double h_s, const double *y, const double *k1, double *out,
                    double *middle)
{
    state k2, k3, k4, at;
    for (int n = 0; n < p->states; ++n) at[n] = y[n] + 0.5 * h_s * k1[n];
    if (!slopes(p, t_s + 0.5 * h_s, at, k2)) return false;
    for (int n = 0; n < p->states; ++n) at[n] = y[n] + 0.5 * h_s * k2[n];
    if (!slopes(p, t_s + 0.5 * h_s, at, k3)) return false;
    for (int n = 0; n < p->states; ++n) at[n] = y[n] + h_s * k3[n];
    if (!slopes(p, t_s + h_s, at, k4)) return false;
    for (int n = 0; n < p->states; ++n) {
        const double inner = k2[n] + k3[n];
        out[n] = y[n] + h_s / 6 * (k1[n] + 2 * inner + k4[n]);
        middle[n] = y[n] + h_s / 24 * (5 * k1[n] + 4 * inner - k4[n]);
    }
    return true;
}

static bool any_ended(const double before[6], const double after[6], int ended[6])
{
    bool any = false;
    for (int k = 0; k < 6; ++k) any = (ended[k] = before[k] >= 0 && after[k] < 0) || any;
    return any;
}

// Of the margins that have ended the one farthest beyond 0, and what it was.
static int farthest(const double after[6], const int ended[6])
{
    int at = 0;
    for (int k = 1; k < 6; ++k)
        if (ended[k] && (!ended[at] || after[k] < after[at])) at = k;
    return at;
}

// Where the first margin reaches 0 within a step: regula falsi with the stale end halved (Illinois), aimed a little
// beyond, until what is beyond is a hundred-millionth of the way.
static bool cross(const dqw_sim_plant *p, double t_s, double *h_s, const double *y, const double *k1,
                  const double before[6], const double after[6], double *out, double *middle, int ended[6])
{
    double low = 0, high = *h_s, margin[6];
    dqw_sim_point o;
    int at = farthest(after, ended), found[6], side = 0;
    double near = before[at], far = after[at];
    const double enough = 1e-8 * (near - far);
    for (int n = 0; n < 60 && far < -enough && high - low > 1e-12 * *h_s; ++n) {
        const double h = n % 20 == 19 ? 0.5 * (low + high)
                                      : low + (high - low) * fmin((near + 0.5 * enough) / (near - far), 1);
        if (!advance(p, t_s, h, y, k1, out, middle) || !dqw_sim_plant_point(p, t_s + h, out, &o)) return false;
        dqw_sim_plant_margins(p, out, &o, margin);
        if (any_ended(before, margin, found)) {
            memcpy(ended, found, sizeof found);
            if (side == 1) near *= 0.5;
            at = farthest(margin, ended), high = h, far = margin[at], side = 1;
        } else {
            if (side == -1) far *= 0.5;
            low = h, near = margin[at], side = -1;
        }
    }
    *h_s = high;
    return advance(p, t_s, high, y, k1, out, middle);
}

int dqw_sim_rk4(dqw_sim_integrator *g, double from_s, double to_s, double *reached_s, int ended[6])
{
    const dqw_sim_plant *p = g->plant;
    const bool watched = p->at_node >= 0 && dqw_sim_legs_open(p->legs);
    double *y = dqw_sim_integrator_state(g), before[6], after[6], t = from_s;
    state k1, out, middle;
    dqw_sim_point o;
    if (!dqw_sim_plant_point(p, t, y, &o)) return -1;
    if (watched) dqw_sim_plant_margins(p, y, &o, before);
    const double most_s = step_s(g, y);
    const long until = g->steps + steps_max;
    bool end = false;
    while (t < to_s && !end) {
        if (g->steps >= until) return CV_TOO_MUCH_WORK;
        double h = (to_s - t) / ceil((to_s - t) / fmin(most_s, knee_s(g, &o)));
        const bool last = h >= to_s - t;
        if (!dqw_sim_plant_slopes(p, t, y, &o, k1) || !advance(p, t, h, y, k1, out, middle)) return -1;
        if (watched) {
            if (!dqw_sim_plant_point(p, t + h, out, &o)) return -1;
            dqw_sim_plant_margins(p, out, &o, after);
            end = any_ended(before, after, ended);
            if (end && !cross(p, t, &h, y, k1, before, after, out, middle, ended)) return -1;
            memcpy(before, after, sizeof before);
        }
        const bool filtered = g->filter.tau_s > 0;
        if ((!watched || end) && (!last || filtered) && !dqw_sim_plant_point(p, t + h, out, &o)) return -1;
        if (filtered && !dqw_sim_filter_step(&g->filter, p, t, h, middle, &o)) return -1;
        memcpy(y, out, (size_t)p->states * sizeof *y);
        t = last && !end ? to_s : t + h;
        g->steps += 1, g->rhs_evaluations += 4;
    }
    *reached_s = t;
    return 0;
}
