#include "sim_sensor.h"

#include <math.h>

#include "sim_random.h"

static const double two_pi = 6.283185307179586;
static const double sqrt3 = 1.7320508075688772;

static double rounded(double x, double step) { return step > 0 ? step * floor(x / step + 0.5) : x; }

static double wrapped(double angle)
{
    const double turned = angle - two_pi * floor(angle / two_pi);
    return turned < two_pi ? turned : 0;
}

static void quantise_currents(double step, double theta_true, double theta_seen, dqw_sim_row *row)
{
    const double c = cos(theta_true), s = sin(theta_true);
    double alpha = c * row->i_d_A - s * row->i_q_A, beta = s * row->i_d_A + c * row->i_q_A;
    if (step > 0) {
        const double a = rounded(alpha, step), b = rounded(0.5 * (sqrt3 * beta - alpha), step);
        const double g = rounded(-0.5 * (sqrt3 * beta + alpha), step);
        alpha = (2 * a - b - g) / 3, beta = (b - g) / sqrt3;
    }
    const double cs = cos(theta_seen), ss = sin(theta_seen);
    row->i_d_A = cs * alpha + ss * beta, row->i_q_A = cs * beta - ss * alpha;
}

void dqw_sim_sensor_quantise(const dqw_sim_noise *n, int pole_pairs, dqw_sim_row *row)
{
    const double theta_true = row->theta_e_rad;
    if (n->step_theta_m_rad > 0) {
        row->theta_m_rad = wrapped(rounded(row->theta_m_rad, n->step_theta_m_rad));
        row->theta_e_rad = wrapped(pole_pairs * row->theta_m_rad);
    }
    if (n->step_i_A > 0 || n->step_theta_m_rad > 0) quantise_currents(n->step_i_A, theta_true, row->theta_e_rad, row);
    row->v_d_V = rounded(row->v_d_V, n->step_v_V), row->v_q_V = rounded(row->v_q_V, n->step_v_V);
    row->w_m_rad_s = rounded(row->w_m_rad_s, n->step_w_rad_s);
    row->v_dc_V = rounded(row->v_dc_V, n->step_v_dc_V);
    row->temp_winding_C = rounded(row->temp_winding_C, n->step_temp_C);
    row->temp_magnet_C = rounded(row->temp_magnet_C, n->step_temp_C);
    row->torque_Nm = rounded(row->torque_Nm, n->step_torque_Nm);
}

static double *channel(dqw_sim_row *row, size_t offset) { return (double *)(void *)((char *)row + offset); }

static void add_noise(dqw_sim_row *rows, size_t count, size_t offset, double fraction, uint64_t seed, uint64_t stream)
{
    if (!(fraction > 0) || count < 2) return;
    double mean = 0, square = 0;
    for (size_t k = 0; k < count; ++k) mean += *channel(&rows[k], offset);
    mean /= (double)count;
    for (size_t k = 0; k < count; ++k) square += pow(*channel(&rows[k], offset) - mean, 2);
    const double sd = fraction * sqrt(square / (double)count);
    for (size_t k = 0; k < count; ++k) *channel(&rows[k], offset) += sd * dqw_sim_random_normal(seed, stream, k);
}

void dqw_sim_sensor_log(const dqw_sim_scenario *s, dqw_sim_row *rows, size_t count)
{
    const dqw_sim_noise *n = &s->noise;
    // Apart from the excitation's streams, which take the seed as it is.
    const uint64_t seed = dqw_sim_random_bits(s->seed, 0x6e6f697365u, n->seed);
    add_noise(rows, count, offsetof(dqw_sim_row, i_d_A), n->i, seed, 0);
    add_noise(rows, count, offsetof(dqw_sim_row, i_q_A), n->i, seed, 1);
    add_noise(rows, count, offsetof(dqw_sim_row, v_d_V), n->v, seed, 2);
    add_noise(rows, count, offsetof(dqw_sim_row, v_q_V), n->v, seed, 3);
    add_noise(rows, count, offsetof(dqw_sim_row, w_m_rad_s), n->w, seed, 4);
    add_noise(rows, count, offsetof(dqw_sim_row, v_dc_V), n->v_dc, seed, 5);
    add_noise(rows, count, offsetof(dqw_sim_row, temp_winding_C), n->temp, seed, 6);
    add_noise(rows, count, offsetof(dqw_sim_row, temp_magnet_C), n->temp, seed, 7);
    add_noise(rows, count, offsetof(dqw_sim_row, torque_Nm), n->torque, seed, 8);
    // The angle last: the phases' quantisation needs the true one.
    for (size_t k = 0; k < count; ++k) dqw_sim_sensor_quantise(n, s->machine.pole_pairs, &rows[k]);
    add_noise(rows, count, offsetof(dqw_sim_row, theta_e_rad), n->theta, seed, 9);
    add_noise(rows, count, offsetof(dqw_sim_row, theta_m_rad), n->theta, seed, 10);
    if (n->theta > 0)
        for (size_t k = 0; k < count; ++k) {
            rows[k].theta_e_rad = wrapped(rows[k].theta_e_rad);
            rows[k].theta_m_rad = wrapped(rows[k].theta_m_rad);
        }
}
