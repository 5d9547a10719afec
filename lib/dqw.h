// dqwatch: learns the parameters of a permanent-magnet motor while it runs. Include this one header.
//
// Conventions, everywhere in this library:
//   * amplitude-invariant Clarke transform: a phase current of 10 A peak is a dq current of 10 A;
//   * R, L and psi per phase, to neutral (star). Of a line-to-line value take half; of a delta winding's phase a third;
//   * psi is peak flux linkage: induced phase voltage, peak, over electrical speed;
//   * w_m is mechanical, w_e = p w_m electrical, both rad/s; p counts pole pairs;
//   * motor sign convention: v_d = R i_d + L_d di_d/dt - w_e L_q i_q,  v_q = R i_q + L_q di_q/dt + w_e L_d i_d + w_e
//   psi;
//   * row k: currents and speed sampled at t_k, voltages as means over t_k .. t_{k+1} in the rotating frame.
#ifndef DQW_H
#define DQW_H

#include "dqw_estimator.h"
#include "dqw_monitor.h"
#include "dqw_sample.h"
#include "dqw_shaft.h"
#include "dqw_text.h"
#include "dqw_version.h"

#endif
