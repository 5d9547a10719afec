// The example's configuration, also that of what is measured on the target. From the data sheet: starting points, no
// more; it is constant and stays in flash. Of a nameplate alone dqw_monitor_config_default() makes much the same,
// without what this board's samples are.
#ifndef FOC_CONFIG_H
#define FOC_CONFIG_H

#include "dqw_monitor.h"

static const dqw_monitor_config CONFIG = {
    .estimator = {.dt_s = 50e-6f,
                  .v_base_V = 14,
                  .i_base_A = 6,
                  .w_base_rad_s = 110,
                  .R_ohm = 0.6f,
                  .Ld_H = 0.9e-3f,
                  .Lq_H = 1.6e-3f,
                  .psi_Wb = 0.018f,
                  .pole_pairs = 4,
                  .half_window = 20,
                  .dead_time_width_A = 0.05f,
                  .follow = true,
                  .stale_limit = 10,
                  .angle = true,
                  .encoder_offset = true,
                  .noise_on_inputs = true,
                  .voltage_next = true,   // the timer loads it a period later,
                  .voltage_held = true},  // as a vector that the inverter holds: alpha-beta
    .J_kgm2 = 3e-4f,
};

#endif
