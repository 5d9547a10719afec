#include "sim_signal.h"

#include <math.h>

#include "sim_random.h"

static const double two_pi = 6.283185307179586;

// Holds and periods are multiples of the control period in exact arithmetic only: a sample this much early counts as
// there.
static const double edge = 1e-9;

static double wave_at(const dqw_sim_signal *g, double t_s)
{
    const double turns = t_s / g->wave_period_s + edge;
    const double phase = turns - floor(turns);
    switch (g->shape) {
    case DQW_SIM_SHAPE_SQUARE: return phase < 0.5 ? g->wave : -g->wave;
    case DQW_SIM_SHAPE_TRIANGLE:
        return g->wave * (phase < 0.25 ? 4 * phase : phase < 0.75 ? 2 - 4 * phase : 4 * phase - 4);
    case DQW_SIM_SHAPE_STAIRS:
        return g->levels > 1 ? g->wave * (2 * floor(phase * g->levels) / (g->levels - 1) - 1) : g->wave;
    case DQW_SIM_SHAPE_SINE: break;
    }
    return g->wave * sin(two_pi * phase);
}

static double table_at(const dqw_sim_signal *g, double t_s)
{
    const double at = t_s / g->table_dt_s + edge;
    if (!(at > 0)) return g->table[0];
    if (at >= (double)(g->table_rows - 1)) return g->table[g->table_rows - 1];
    const size_t k = (size_t)at;
    // At a row's own time the table says it to the last digit.
    const double part = at - (double)k < 2 * edge ? 0 : at - (double)k - edge;
    return (1 - part) * g->table[k] + part * g->table[k + 1];
}

double dqw_sim_signal_at(const dqw_sim_signal *g, double t_s, uint64_t seed, uint64_t stream)
{
    double y = g->value;
    if (g->step != 0.0 && t_s >= g->t_step_s - edge * (1 + g->t_step_s)) y += g->step;
    if (g->wave != 0.0) y += wave_at(g, t_s);
    if (g->table && g->table_rows > 0) y += table_at(g, t_s);
    if (g->random != 0.0) {
        const uint64_t hold = (uint64_t)(t_s / g->random_hold_s + edge);
        y += g->random * (2 * dqw_sim_random_uniform(seed, 2 * stream, hold) - 1);
    }
    if (g->binary != 0.0) {
        const uint64_t hold = (uint64_t)(t_s / g->binary_hold_s + edge);
        y += dqw_sim_random_bits(seed, 2 * stream + 1, hold) >> 63 ? g->binary : -g->binary;
    }
    return y;
}

double dqw_sim_ramp_at(const dqw_sim_ramp *r, double t_s)
{
    if (r->value == 0.0 || t_s < r->t_start_s) return 0.0;
    if (t_s >= r->t_end_s) return r->value;
    return r->value * (t_s - r->t_start_s) / (r->t_end_s - r->t_start_s);
}
