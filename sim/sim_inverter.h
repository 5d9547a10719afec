// Three legs at their switches, (E96): gates with dead time, what conducts, and the voltage at each output.
//
// A leg's reference is high in the middle of the carrier's period, for duty times its length. Its switch that opens
// does so at the edge, the other closes a dead time later; in between the current decides: the output goes at once to
// the rail whose diode takes it (or as fast as the current turns the output's capacitance over), stays there until the
// current crosses zero, and then floats.
#ifndef DQW_SIM_INVERTER_H
#define DQW_SIM_INVERTER_H

#include <math.h>

#include "dqw_sim.h"

enum dqw_sim_conducts {
    DQW_SIM_LOWER,        ///< switch to the negative rail closed
    DQW_SIM_UPPER,        ///< switch to the positive rail closed
    DQW_SIM_DIODE_LOWER,  ///< both open, current out of the leg
    DQW_SIM_DIODE_UPPER,  ///< both open, current into the leg
    DQW_SIM_FLOATS        ///< both open, the output's capacitance alone carries the current
};

enum { DQW_SIM_LEG_EDGES = 3 };

typedef struct dqw_sim_leg {
    enum dqw_sim_conducts conducts;
    bool high;        ///< its reference
    double closes_s;  ///< when the switch that the reference asks for closes; infinity: it is closed
    /// where the reference changes and one switch opens, and when the other closes
    double edge_s[DQW_SIM_LEG_EDGES], edge_closes_s[DQW_SIM_LEG_EDGES];
    bool edge_high[DQW_SIM_LEG_EDGES];
    int edges, passed;
} dqw_sim_leg;

/// Times are those of the control period, from its beginning.
typedef struct dqw_sim_legs {
    const dqw_sim_inverter *x;
    double node_F;     ///< the inverter's, or so little that only a current near zero notices
    double instant_s;  ///< an output that turns over faster does so at once
    dqw_sim_leg leg[3];
} dqw_sim_legs;

/// The drive's scale: link, largest current, smallest inductance.
typedef struct dqw_sim_scale {
    double v_dc_V, i_max_A, L_H;
} dqw_sim_scale;

/// All lower switches closed. period_s: of the carrier.
void dqw_sim_legs_init(dqw_sim_legs *legs, const dqw_sim_inverter *x, const dqw_sim_scale *scale, double period_s);

/// Sets the edges of a carrier's period that begins at from_s; what is past is taken off the clock first, so that the
/// last period's unfinished dead times go on.
void dqw_sim_legs_carrier(dqw_sim_legs *legs, double from_s, double period_s, const double duty[3]);

/// Moves the clock back: a new control period begins.
void dqw_sim_legs_rewind(dqw_sim_legs *legs, double period_s);

/// Time of the next edge or closing switch; infinity: none.
double dqw_sim_legs_next(const dqw_sim_legs *legs);

/// Does what is due at t_s. i_A: out of the legs; node_V: of floating outputs, set where one begins to float. Returns
/// whether anything conducts otherwise than before.
bool dqw_sim_legs_switch(dqw_sim_legs *legs, double t_s, const double i_A[3], double v_link_V, double node_V[3]);

// What each evaluation of the plant asks stands here, for the compiler to see through.

/// Drop of a conducting part against the current through it.
static inline double dqw_sim_drop_V(double v_V, double ohm, double knee_A, double i_A)
{
    return (v_V > 0 ? v_V * i_A / sqrt(i_A * i_A + knee_A * knee_A) : 0) + ohm * i_A;
}

/// Of a closed switch; `reverse`: against its own direction.
static inline double dqw_sim_switch_drop_V(const dqw_sim_inverter *x, bool reverse, double i_A)
{
    if (reverse && x->reverse == DQW_SIM_REVERSE_DIODE) return dqw_sim_drop_V(x->diode_V, x->diode_ohm, x->knee_A, i_A);
    return dqw_sim_drop_V(x->switch_V, x->switch_ohm, x->knee_A, i_A);
}

/// Voltage of leg n's output above the negative rail at its current.
static inline double dqw_sim_leg_V(const dqw_sim_legs *legs, int n, double i_A, double v_link_V, double node_V)
{
    const dqw_sim_inverter *x = legs->x;
    switch (legs->leg[n].conducts) {
    case DQW_SIM_UPPER: return v_link_V - dqw_sim_switch_drop_V(x, i_A < 0, i_A);
    case DQW_SIM_LOWER: return -dqw_sim_switch_drop_V(x, i_A > 0, i_A);
    case DQW_SIM_DIODE_UPPER: return v_link_V - dqw_sim_drop_V(x->diode_V, x->diode_ohm, x->knee_A, i_A);
    case DQW_SIM_DIODE_LOWER: return -dqw_sim_drop_V(x->diode_V, x->diode_ohm, x->knee_A, i_A);
    case DQW_SIM_FLOATS: break;
    }
    const double forward = dqw_sim_drop_V(x->diode_V, x->diode_ohm, x->knee_A, fabs(i_A));
    return fmax(-forward, fmin(v_link_V + forward, node_V));
}

/// Slope of leg n's output where it floats, else 0.
double dqw_sim_leg_V_s(const dqw_sim_legs *legs, int n, double i_A);

/// Current from the link's capacitor.
static inline double dqw_sim_legs_link_A(const dqw_sim_legs *legs, const double i_A[3])
{
    double sum = 0;
    for (int n = 0; n < 3; ++n)
        if (legs->leg[n].conducts == DQW_SIM_UPPER || legs->leg[n].conducts == DQW_SIM_DIODE_UPPER) sum += i_A[n];
    return sum;
}

/// Whether a leg is within its dead time, and must be watched by dqw_sim_leg_margin.
bool dqw_sim_legs_open(const dqw_sim_legs *legs);

/// How far a leg within its dead time is from what ends its state, above 0: current of its diode, or distance of a
/// floating output to the `rail` (0 lower, 1 upper); 1 where nothing can end it.
double dqw_sim_leg_margin(const dqw_sim_legs *legs, int n, int rail, double i_A, double v_link_V, double node_V);

/// A margin of leg n has reached 0: its diode lets go, or the one of `rail` takes over.
void dqw_sim_leg_commutate(dqw_sim_legs *legs, int n, int rail, double i_A, double v_link_V, double *node_V);

#endif
