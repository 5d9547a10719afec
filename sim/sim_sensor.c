#include "sim_sensor.h"

#include <math.h>

#include "sim_circuit.h"
#include "sim_random.h"
#include "sim_signal.h"

static const double two_pi = 6.283185307179586;
static const double sqrt3 = 1.7320508075688772;

static double rounded(double x, double step) { return step > 0 ? step * floor(x / step + 0.5) : x; }

static double wrapped(double angle)
{
    const double turned = angle - two_pi * floor(angle / two_pi);
    return turned < two_pi ? turned : 0;
}

static double clamped(double x, double limit) { return x > limit ? limit : x < -limit ? -limit : x; }

static double held_at(const dqw_sim_ramp *r, const dqw_sim_row *row) { return dqw_sim_ramp_at(r, row->t_s); }

uint64_t dqw_sim_sensor_seed(const dqw_sim_scenario *s)
{
    return dqw_sim_random_bits(s->seed, 0x6e6f697365u, s->noise.seed);
}

// A phase without a sensor is what the other two leave.
static void infer_phase(enum dqw_sim_phases phases, double i_A[3])
{
    if (phases == DQW_SIM_PHASES_AB) i_A[2] = -i_A[0] - i_A[1];
    if (phases == DQW_SIM_PHASES_BC) i_A[0] = -i_A[1] - i_A[2];
    if (phases == DQW_SIM_PHASES_CA) i_A[1] = -i_A[2] - i_A[0];
}

static void phases_of(const dqw_sim_row *row, double theta_e_rad, double i_A[3])
{
    const double c = cos(theta_e_rad), s = sin(theta_e_rad);
    dqw_sim_phases_of(c * row->i_d_A - s * row->i_q_A, s * row->i_d_A + c * row->i_q_A, i_A);
}

static void alpha_beta(enum dqw_sim_phases phases, double i_A[3], double *alpha, double *beta)
{
    infer_phase(phases, i_A);
    *alpha = (2 * i_A[0] - i_A[1] - i_A[2]) / 3, *beta = (i_A[1] - i_A[2]) / sqrt3;
}

static void see_currents(double theta_e_rad, double alpha, double beta, dqw_sim_row *row)
{
    const double c = cos(theta_e_rad), s = sin(theta_e_rad);
    row->i_d_A = c * alpha + s * beta, row->i_q_A = c * beta - s * alpha;
}

void dqw_sim_sensor_white(const dqw_sim_scenario *s, long k, double *i_alpha_A, double *i_beta_A)
{
    double n[3], alpha, beta;
    for (uint64_t x = 0; x < 3; ++x)
        n[x] = s->sensing.noise_A *
               dqw_sim_random_normal(dqw_sim_sensor_seed(s), DQW_SIM_STREAM_SENSOR + x, (uint64_t)k);
    alpha_beta(s->sensing.phases, n, &alpha, &beta);
    *i_alpha_A += alpha, *i_beta_A += beta;
}

void dqw_sim_sensor_mistake(const dqw_sim_scenario *s, dqw_sim_row *row)
{
    const dqw_sim_nonideal *x = &s->nonideal;
    const double gain[3] = {held_at(&x->current_gain_a, row), held_at(&x->current_gain_b, row),
                            held_at(&x->current_gain_c, row)};
    const double off_alpha = held_at(&x->current_offset_alpha_A, row),
                 off_beta = held_at(&x->current_offset_beta_A, row);
    const double turn = held_at(&x->angle_offset_rad, row);
    if (gain[0] != 0 || gain[1] != 0 || gain[2] != 0 || off_alpha != 0 || off_beta != 0 || turn != 0) {
        double i_A[3], alpha, beta;
        phases_of(row, row->theta_e_rad, i_A);
        for (int n = 0; n < 3; ++n) i_A[n] *= 1 + gain[n];
        alpha_beta(s->sensing.phases, i_A, &alpha, &beta);
        row->theta_e_rad = wrapped(row->theta_e_rad + turn),
        row->theta_m_rad = wrapped(row->theta_m_rad + turn / s->machine.pole_pairs);
        see_currents(row->theta_e_rad, alpha + off_alpha, beta + off_beta, row);
        const double ct = cos(turn), st = sin(turn), v_d = row->v_d_V;
        if (s->drive.logged == DQW_SIM_LOGGED_MEAN)
            row->v_d_V = ct * v_d + st * row->v_q_V, row->v_q_V = ct * row->v_q_V - st * v_d;
    }
    row->v_d_V += held_at(&x->voltage_offset_d_V, row), row->v_q_V += held_at(&x->voltage_offset_q_V, row);
}

// Of phase a's sensor.
static void add_hum(const dqw_sim_scenario *s, dqw_sim_row *row)
{
    const double hum_A = held_at(&s->nonideal.hum_A, row);
    double i_A[3], alpha, beta;
    if (hum_A == 0) return;
    phases_of(row, row->theta_e_rad, i_A);
    i_A[0] += hum_A * sin(two_pi * s->nonideal.hum_Hz * row->t_s);
    alpha_beta(s->sensing.phases, i_A, &alpha, &beta);
    see_currents(row->theta_e_rad, alpha, beta, row);
}

static void clip_currents(const dqw_sim_scenario *s, dqw_sim_row *row)
{
    double i_A[3], alpha, beta;
    phases_of(row, row->theta_e_rad, i_A);
    for (int n = 0; n < 3; ++n) i_A[n] = clamped(i_A[n], s->nonideal.clip_A);
    alpha_beta(s->sensing.phases, i_A, &alpha, &beta);
    see_currents(row->theta_e_rad, alpha, beta, row);
}

static void quantise_currents(const dqw_sim_scenario *s, double theta_true, double theta_seen, dqw_sim_row *row)
{
    double i_A[3], alpha, beta;
    phases_of(row, theta_true, i_A);
    for (int n = 0; n < 3; ++n) i_A[n] = rounded(i_A[n], s->noise.step_i_A);
    alpha_beta(s->sensing.phases, i_A, &alpha, &beta);
    see_currents(theta_seen, alpha, beta, row);
}

void dqw_sim_sensor_quantise(const dqw_sim_scenario *s, dqw_sim_row *row)
{
    const dqw_sim_noise *n = &s->noise;
    const double theta_true = row->theta_e_rad;
    if (n->step_theta_m_rad > 0) {
        row->theta_m_rad = wrapped(rounded(row->theta_m_rad, n->step_theta_m_rad));
        row->theta_e_rad = wrapped(s->machine.pole_pairs * row->theta_m_rad);
    }
    if (n->step_i_A > 0 || n->step_theta_m_rad > 0) quantise_currents(s, theta_true, row->theta_e_rad, row);
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
    const dqw_sim_nonideal *x = &s->nonideal;
    for (size_t k = 0; k < count; ++k) dqw_sim_sensor_mistake(s, &rows[k]), add_hum(s, &rows[k]);
    const uint64_t seed = dqw_sim_sensor_seed(s);
    add_noise(rows, count, offsetof(dqw_sim_row, i_d_A), n->i, seed, 0);
    add_noise(rows, count, offsetof(dqw_sim_row, i_q_A), n->i, seed, 1);
    add_noise(rows, count, offsetof(dqw_sim_row, v_d_V), n->v, seed, 2);
    add_noise(rows, count, offsetof(dqw_sim_row, v_q_V), n->v, seed, 3);
    add_noise(rows, count, offsetof(dqw_sim_row, w_m_rad_s), n->w, seed, 4);
    add_noise(rows, count, offsetof(dqw_sim_row, v_dc_V), n->v_dc, seed, 5);
    add_noise(rows, count, offsetof(dqw_sim_row, temp_winding_C), n->temp, seed, 6);
    add_noise(rows, count, offsetof(dqw_sim_row, temp_magnet_C), n->temp, seed, 7);
    add_noise(rows, count, offsetof(dqw_sim_row, torque_Nm), n->torque, seed, 8);
    for (size_t k = 0; x->clip_A > 0 && k < count; ++k) clip_currents(s, &rows[k]);
    // The angle last: the phases' quantisation needs the true one.
    for (size_t k = 0; k < count; ++k) dqw_sim_sensor_quantise(s, &rows[k]);
    for (size_t k = 1; x->dropped_fraction > 0 && k < count; ++k)
        if (dqw_sim_random_uniform(seed, 11, k) < x->dropped_fraction)
            rows[k].i_d_A = rows[k - 1].i_d_A, rows[k].i_q_A = rows[k - 1].i_q_A;
    add_noise(rows, count, offsetof(dqw_sim_row, theta_e_rad), n->theta, seed, 9);
    add_noise(rows, count, offsetof(dqw_sim_row, theta_m_rad), n->theta, seed, 10);
    if (n->theta > 0)
        for (size_t k = 0; k < count; ++k) {
            rows[k].theta_e_rad = wrapped(rows[k].theta_e_rad);
            rows[k].theta_m_rad = wrapped(rows[k].theta_m_rad);
        }
}
