// Inverter and machine over one control period: what the drive has decided, from edge to edge.
#ifndef DQW_SIM_STAGE_H
#define DQW_SIM_STAGE_H

#include "sim_integrator.h"
#include "sim_inverter.h"
#include "sim_plant.h"

typedef struct dqw_sim_stage {
    dqw_sim_plant plant;
    dqw_sim_integrator integrator;
    dqw_sim_legs legs;
    int carriers;  ///< per control period
    double dt_s;   ///< control period
    bool fresh;    ///< states or slopes have jumped since the integrator's last step
} dqw_sim_stage;

/// Takes what does not change during a run; map, curve: NULL or the caller's. The integrator comes later, when the
/// plant is at its start: dqw_sim_integrator_init.
void dqw_sim_stage_init(dqw_sim_stage *g, const dqw_sim_scenario *s, dqw_sim_map *map, const dqw_sim_curve *curve);

/// Begins a control period: times are from here on those since its beginning.
void dqw_sim_stage_begin(dqw_sim_stage *g, double t_s, double theta_e_rad, double theta_m_rad);

/// Holds a voltage (stationary, or the rotor's where the scenario holds it there) from one time to another. Returns 0
/// or CVODE's negative flag.
int dqw_sim_stage_hold(dqw_sim_stage *g, const double held_V[2], double from_s, double to_s);

/// Switches the legs by these duties from one time of the period to another; the spans of a period follow each other
/// without a gap. Returns as dqw_sim_stage_hold.
int dqw_sim_stage_switch(dqw_sim_stage *g, const double duty[3], double from_s, double to_s);

#endif
