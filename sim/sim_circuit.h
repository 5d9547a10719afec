// Inverter and stator circuit: from terminal voltage and magnetising current to induced voltage and terminal current.
#ifndef DQW_SIM_CIRCUIT_H
#define DQW_SIM_CIRCUIT_H

#include "sim_plant.h"

/// Takes the inverter's loss from o's terminal voltage, and fills its induced voltage, terminal currents and copper
/// loss. R: of a phase.
void dqw_sim_circuit(const dqw_sim_plant *p, double R, double im_x, double im_y, dqw_sim_point *o);

#endif
