// Where the drive believes its rotor to be, (E97): an encoder that is eccentric or late, or an observer.
#ifndef DQW_SIM_ENCODER_H
#define DQW_SIM_ENCODER_H

#include "dqw_sim.h"

typedef struct dqw_sim_encoder {
    bool begun;
    double theta_m_rad;             ///< the true angle one period before
    double noise_rad;               ///< of the observer, in units of its size
    double track_rad, track_rad_s;  ///< loop that tracks the seen angle
} dqw_sim_encoder;

/// Turns the angles and the speed of a true sample, the k-th (-1: before the first period), into those that the drive
/// sees. Seen angle: the true one
/// `angle_late_periods` ago, plus once sin(theta_m + phase) + twice sin(2 theta_m + phase) mechanical; for an observer
/// the true one minus lag w_e and load i_q, plus noise. Seen speed: of a loop with double pole at speed_bandwidth_rad_s
/// that tracks the seen angle.
void dqw_sim_encoder_see(dqw_sim_encoder *e, const dqw_sim_scenario *s, long k, dqw_sim_row *row);

#endif
