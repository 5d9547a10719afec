// Uniform quartic B-splines on one axis of a flux map.
#ifndef DQW_SIM_SPLINE_H
#define DQW_SIM_SPLINE_H

#include "sim_map.h"

/// The five basis functions that live at `x_A`: b[0] values, b[1] slopes, b[2] curvatures. Returns the first one's
/// index.
/// Outside the cells each goes on with its value, slope and curvature at the edge.
int dqw_sim_spline(const dqw_sim_map_axis *axis, double x_A, double b[3][5]);

#endif
