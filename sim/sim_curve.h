// What an inverter loses on each phase, as measured: voltage against phase current.
#ifndef DQW_SIM_CURVE_H
#define DQW_SIM_CURVE_H

#include <stddef.h>

enum { DQW_SIM_CURVE_POINTS = 1000 };

/// Straight lines between the points, the last one's voltage beyond. Odd: where the points have both signs, half the
/// difference of both sides; else the origin joins them and the other side is its image.
typedef struct dqw_sim_curve {
    size_t count;
    double i_A[DQW_SIM_CURVE_POINTS + 1], v_V[DQW_SIM_CURVE_POINTS + 1];
} dqw_sim_curve;

/// Reads CSV with the columns i_A, v_V, currents ascending. Returns 0 or DQW_SIM_ERR_MAP with "FILE:LINE: what is
/// wrong" in message.
int dqw_sim_curve_read(const char *path, dqw_sim_curve *curve, char *message, size_t size);

/// Voltage lost at a phase current. O(log points).
double dqw_sim_curve_at(const dqw_sim_curve *curve, double i_A);

#endif
