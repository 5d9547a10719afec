#include "sim_encoder.h"

#include <math.h>

#include "sim_random.h"
#include "sim_sensor.h"

static const double two_pi = 6.283185307179586;

static double wrapped(double angle)
{
    const double turned = angle - two_pi * floor(angle / two_pi);
    return turned < two_pi ? turned : 0;
}

// Within half a turn of 0.
static double apart(double angle) { return angle - two_pi * floor(angle / two_pi + 0.5); }

static double observed(dqw_sim_encoder *e, const dqw_sim_scenario *s, long k, const dqw_sim_row *row)
{
    const dqw_sim_sensing *x = &s->sensing;
    const double w_e = s->machine.pole_pairs * row->w_m_rad_s;
    double error = -x->observer_lag_s * w_e - x->observer_load_rad_A * row->i_q_A;
    if (x->observer_noise_rad > 0) {
        const double kept = exp(-x->observer_bandwidth_rad_s * s->drive.dt_s),
                     drawn = dqw_sim_random_normal(dqw_sim_sensor_seed(s), DQW_SIM_STREAM_OBSERVER, (uint64_t)k);
        e->noise_rad = e->begun ? kept * e->noise_rad + sqrt(1 - kept * kept) * drawn : drawn;
        error += x->observer_noise_rad * x->observer_corner_rad_s / (fabs(w_e) + x->observer_corner_rad_s) *
                 e->noise_rad;
    }
    return error / s->machine.pole_pairs;
}

static double encoded(const dqw_sim_encoder *e, const dqw_sim_sensing *x, const dqw_sim_row *row)
{
    const double late = e->begun ? x->angle_late_periods * apart(row->theta_m_rad - e->theta_m_rad) : 0,
                 theta = row->theta_m_rad - late;
    return x->once_rad * sin(theta + x->once_phase_rad) + x->twice_rad * sin(2 * theta + x->twice_phase_rad) - late;
}

static double tracked(dqw_sim_encoder *e, double bandwidth_rad_s, double dt_s, const dqw_sim_row *row)
{
    if (!e->begun) e->track_rad = row->theta_m_rad, e->track_rad_s = row->w_m_rad_s;
    const double error = apart(row->theta_m_rad - e->track_rad), kept = exp(-bandwidth_rad_s * dt_s);
    e->track_rad_s += (1 - kept) * (1 - kept) / dt_s * error;
    e->track_rad = wrapped(e->track_rad + (1 - kept * kept) * error + dt_s * e->track_rad_s);
    return e->track_rad_s;
}

void dqw_sim_encoder_see(dqw_sim_encoder *e, const dqw_sim_scenario *s, long k, dqw_sim_row *row)
{
    const dqw_sim_sensing *x = &s->sensing;
    const double true_rad = row->theta_m_rad, error = x->observer ? observed(e, s, k, row) : encoded(e, x, row);
    if (error != 0) {
        row->theta_m_rad = wrapped(row->theta_m_rad + error);
        row->theta_e_rad = wrapped(row->theta_e_rad + s->machine.pole_pairs * error);
    }
    if (x->speed_bandwidth_rad_s > 0) row->w_m_rad_s = tracked(e, x->speed_bandwidth_rad_s, s->drive.dt_s, row);
    e->theta_m_rad = true_rad, e->begun = k >= 0;
}
