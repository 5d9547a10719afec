// Inverter and stator circuit: from terminal voltage and magnetising current to induced voltage and terminal current.
#ifndef DQW_SIM_CIRCUIT_H
#define DQW_SIM_CIRCUIT_H

#include "sim_plant.h"

/// Takes the inverter's loss from o's terminal voltage, or the voltage from the legs' switches, and fills induced
/// voltage, terminal currents, and copper and iron loss. R: of a phase; y: the states.
void dqw_sim_circuit(const dqw_sim_plant *p, double R, double im_x, double im_y, const double *y, dqw_sim_point *o);

/// dy/dt of the stator's branches that have a current of their own.
void dqw_sim_circuit_branches(const dqw_sim_plant *p, const dqw_sim_point *o, const double *y, double *dy);

/// Magnetic energy of the short's leakage in joule.
double dqw_sim_circuit_energy(const dqw_sim_plant *p, const double *y);

/// Phase values of a vector without zero sequence.
static inline void dqw_sim_phases_of(double alpha, double beta, double phase[3])
{
    const double sqrt3 = 1.7320508075688772;
    phase[0] = alpha, phase[1] = 0.5 * (sqrt3 * beta - alpha), phase[2] = -0.5 * (sqrt3 * beta + alpha);
}

#endif
