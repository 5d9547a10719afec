// From a voltage vector to the duties of three legs, (E95).
#ifndef DQW_SIM_MODULATION_H
#define DQW_SIM_MODULATION_H

#include "dqw_sim.h"

/// Share of the PWM period, 0..1, that each leg's output spends on the positive rail. A vector outside the hexagon
/// becomes the nearest one on its edge, and `kind` places the three within 0..1. v_dc_V above 0; kind not MEAN.
void dqw_sim_modulate(enum dqw_sim_modulation kind, double v_alpha_V, double v_beta_V, double v_dc_V, double duty[3]);

#endif
