#include "sim_modulation.h"

#include <math.h>

static const double sqrt3 = 1.7320508075688772;

static double largest(const double u[3]) { return fmax(u[0], fmax(u[1], u[2])); }
static double smallest(const double u[3]) { return fmin(u[0], fmin(u[1], u[2])); }

// What all legs have in common, so that the vector keeps: 0.5 (centre of the link) plus this is the duty.
static double common(enum dqw_sim_modulation kind, double high, double low)
{
    switch (kind) {
    case DQW_SIM_MODULATION_CLAMPED_LOW: return -0.5 - low;
    case DQW_SIM_MODULATION_CLAMPED_HIGH: return 0.5 - high;
    case DQW_SIM_MODULATION_CLAMPED_60: return high > -low ? 0.5 - high : -0.5 - low;
    case DQW_SIM_MODULATION_MEAN:
    case DQW_SIM_MODULATION_CENTRED: break;
    }
    return -0.5 * (high + low);
}

// Centred legs cut off at the rails move the vector square to the hexagon's edge, and beyond a corner into it.
static void into_hexagon(double u[3])
{
    const double middle = 0.5 * (largest(u) + smallest(u));
    for (int n = 0; n < 3; ++n) u[n] = fmax(-0.5, fmin(0.5, u[n] - middle));
    const double sum = (u[0] + u[1] + u[2]) / 3;
    for (int n = 0; n < 3; ++n) u[n] -= sum;
}

void dqw_sim_modulate(enum dqw_sim_modulation kind, double v_alpha_V, double v_beta_V, double v_dc_V, double duty[3])
{
    double u[3] = {v_alpha_V / v_dc_V, 0.5 * (sqrt3 * v_beta_V - v_alpha_V) / v_dc_V,
                   -0.5 * (sqrt3 * v_beta_V + v_alpha_V) / v_dc_V};
    if (largest(u) - smallest(u) > 1) into_hexagon(u);
    const double shift = 0.5 + common(kind, largest(u), smallest(u));
    for (int n = 0; n < 3; ++n) {
        duty[n] = fmax(0, fmin(1, u[n] + shift));
        // A leg that rests is exactly on its rail: rounding would switch it for an instant.
        if (duty[n] < 1e-12) duty[n] = 0;
        if (duty[n] > 1 - 1e-12) duty[n] = 1;
    }
}
