#include "sim_inverter.h"

#include <math.h>

// Drop of a conducting part against the current through it.
static double drop(double v_V, double ohm, double knee_A, double i_A)
{
    return (v_V > 0 ? v_V * i_A / sqrt(i_A * i_A + knee_A * knee_A) : 0) + ohm * i_A;
}

static double switch_drop(const dqw_sim_inverter *x, bool reverse, double i_A)
{
    if (reverse && x->reverse == DQW_SIM_REVERSE_DIODE) return drop(x->diode_V, x->diode_ohm, x->knee_A, i_A);
    return drop(x->switch_V, x->switch_ohm, x->knee_A, i_A);
}

void dqw_sim_legs_init(dqw_sim_legs *legs, const dqw_sim_inverter *x, double v_dc_V, double i_max_A, double period_s)
{
    legs->x = x;
    // Without a capacitance the current stays at zero once its diode has let go, but for the ring v_dc sqrt(C / (1.5 L)):
    // a hundredth of the geometric mean of i_max and of what v_dc moves in a dead time, v_dc dead / (1.5 L).
    const double least_F = 1e-4 * i_max_A * x->dead_time_s / v_dc_V;
    legs->node_F = fmax(x->node_F, least_F);
    legs->instant_s = x->node_F > 0 ? 1e-6 * period_s : INFINITY;
    for (int n = 0; n < 3; ++n) legs->leg[n] = (dqw_sim_leg){.conducts = DQW_SIM_LOWER, .closes_s = INFINITY};
}

void dqw_sim_legs_rewind(dqw_sim_legs *legs, double period_s)
{
    for (int n = 0; n < 3; ++n) {
        legs->leg[n].closes_s -= period_s;
        for (int e = 0; e < DQW_SIM_LEG_EDGES; ++e) legs->leg[n].edge_s[e] -= period_s;
    }
}

static void add_edge(dqw_sim_leg *leg, double t_s, bool high)
{
    leg->edge_s[leg->edges] = t_s, leg->edge_high[leg->edges++] = high;
}

void dqw_sim_legs_carrier(dqw_sim_legs *legs, double from_s, double period_s, const double duty[3])
{
    // The side that gives the time up does so at both of the pulse's edges: its switch opens that much earlier.
    const double dead = legs->x->dead_time_s, early_rise = legs->x->dead_side == DQW_SIM_DEAD_LOWER ? dead : 0,
                 early_fall = legs->x->dead_side == DQW_SIM_DEAD_UPPER ? dead : 0;
    for (int n = 0; n < 3; ++n) {
        dqw_sim_leg *leg = &legs->leg[n];
        double d = duty[n];
        if (legs->x->compare_counts > 0) d = floor(d * legs->x->compare_counts + 0.5) / legs->x->compare_counts;
        leg->edges = leg->passed = 0;
        const bool rests = d <= 0 || d >= 1, first = d >= 1;
        if (leg->high != first) add_edge(leg, from_s, first);
        if (rests) continue;
        add_edge(leg, fmax(from_s, from_s + 0.5 * period_s * (1 - d) - early_rise), true);
        add_edge(leg, fmax(leg->edge_s[leg->edges - 1], from_s + 0.5 * period_s * (1 + d) - early_fall), false);
    }
}

static double next_of(const dqw_sim_leg *leg)
{
    const double edge = leg->passed < leg->edges ? leg->edge_s[leg->passed] : INFINITY;
    return fmin(edge, leg->closes_s);
}

double dqw_sim_legs_next(const dqw_sim_legs *legs)
{
    return fmin(next_of(&legs->leg[0]), fmin(next_of(&legs->leg[1]), next_of(&legs->leg[2])));
}

static bool is_open(const dqw_sim_leg *leg) { return leg->conducts != DQW_SIM_LOWER && leg->conducts != DQW_SIM_UPPER; }

// Both switches open while the output stands on one rail. The current holds it there, or takes it to the other.
static void open_leg(const dqw_sim_legs *legs, dqw_sim_leg *leg, double i_A, double v_link_V, double *node_V)
{
    const bool on_upper = leg->conducts == DQW_SIM_UPPER, leaves = on_upper ? i_A >= 0 : i_A <= 0;
    const bool at_once = legs->node_F * v_link_V <= legs->instant_s * fabs(i_A) && i_A != 0;
    if (leaves && !at_once) {
        leg->conducts = DQW_SIM_FLOATS;
        *node_V = on_upper ? v_link_V : 0;
        return;
    }
    leg->conducts = i_A > 0 ? DQW_SIM_DIODE_LOWER : DQW_SIM_DIODE_UPPER;
}

static void close_leg(dqw_sim_leg *leg)
{
    leg->conducts = leg->high ? DQW_SIM_UPPER : DQW_SIM_LOWER;
    leg->closes_s = INFINITY;
}

bool dqw_sim_legs_switch(dqw_sim_legs *legs, double t_s, const double i_A[3], double v_link_V, double node_V[3])
{
    bool changed = false;
    for (int n = 0; n < 3; ++n) {
        dqw_sim_leg *leg = &legs->leg[n];
        const enum dqw_sim_conducts before = leg->conducts;
        if (leg->closes_s <= t_s) close_leg(leg);
        for (; leg->passed < leg->edges && leg->edge_s[leg->passed] <= t_s; ++leg->passed) {
            leg->high = leg->edge_high[leg->passed];
            leg->closes_s = t_s + legs->x->dead_time_s;
            if (!is_open(leg)) open_leg(legs, leg, i_A[n], v_link_V, &node_V[n]);
            if (legs->x->dead_time_s <= 0) close_leg(leg);
        }
        changed = changed || leg->conducts != before;
    }
    return changed;
}

double dqw_sim_leg_V(const dqw_sim_legs *legs, int n, double i_A, double v_link_V, double node_V)
{
    const dqw_sim_inverter *x = legs->x;
    switch (legs->leg[n].conducts) {
    case DQW_SIM_UPPER: return v_link_V - switch_drop(x, i_A < 0, i_A);
    case DQW_SIM_LOWER: return -switch_drop(x, i_A > 0, i_A);
    case DQW_SIM_DIODE_UPPER: return v_link_V - drop(x->diode_V, x->diode_ohm, x->knee_A, i_A);
    case DQW_SIM_DIODE_LOWER: return -drop(x->diode_V, x->diode_ohm, x->knee_A, i_A);
    case DQW_SIM_FLOATS: break;
    }
    const double forward = drop(x->diode_V, x->diode_ohm, x->knee_A, fabs(i_A));
    return fmax(-forward, fmin(v_link_V + forward, node_V));
}

double dqw_sim_leg_V_s(const dqw_sim_legs *legs, int n, double i_A)
{
    if (legs->leg[n].conducts != DQW_SIM_FLOATS) return 0;
    return -i_A / legs->node_F;
}

double dqw_sim_legs_link_A(const dqw_sim_legs *legs, const double i_A[3])
{
    double sum = 0;
    for (int n = 0; n < 3; ++n)
        if (legs->leg[n].conducts == DQW_SIM_UPPER || legs->leg[n].conducts == DQW_SIM_DIODE_UPPER) sum += i_A[n];
    return sum;
}

bool dqw_sim_legs_open(const dqw_sim_legs *legs)
{
    return is_open(&legs->leg[0]) || is_open(&legs->leg[1]) || is_open(&legs->leg[2]);
}

double dqw_sim_leg_margin(const dqw_sim_legs *legs, int n, int rail, double i_A, double v_link_V, double node_V)
{
    const dqw_sim_inverter *x = legs->x;
    switch (legs->leg[n].conducts) {
    case DQW_SIM_DIODE_LOWER: return rail == 0 ? i_A : 1;
    case DQW_SIM_DIODE_UPPER: return rail == 1 ? -i_A : 1;
    case DQW_SIM_FLOATS: {
        const double forward = drop(x->diode_V, x->diode_ohm, x->knee_A, fabs(i_A));
        return rail == 0 ? node_V + forward : v_link_V + forward - node_V;
    }
    case DQW_SIM_UPPER:
    case DQW_SIM_LOWER: break;
    }
    return 1;
}

void dqw_sim_leg_commutate(dqw_sim_legs *legs, int n, int rail, double i_A, double v_link_V, double *node_V)
{
    dqw_sim_leg *leg = &legs->leg[n];
    if (leg->conducts == DQW_SIM_FLOATS) {
        // Only a current that pulls the output beyond this rail is its diode's.
        if (rail == 0 && i_A > 0) leg->conducts = DQW_SIM_DIODE_LOWER;
        if (rail == 1 && i_A < 0) leg->conducts = DQW_SIM_DIODE_UPPER;
        return;
    }
    *node_V = leg->conducts == DQW_SIM_DIODE_UPPER ? v_link_V : 0;
    leg->conducts = DQW_SIM_FLOATS;
}
