// With what `dqwatch monitor --arith q15` ran over gap.csv. In firmware, with DQW_EFFECT_WEIGHTS=0 for all of lib/ and port_q15/:
//     static const dqw_monitor_q15_config config = {DQW_Q15_MONITOR};
// Samples are parts of 12.753 V, 9.008 A, 138.61 rad/s: lround(32768 x / full scale); beyond +-32766 one counts as saturated; the angle 65536 a turn.
// Bands, threshold and floor that are parts of a full scale are those of the usual largest signals, a third less.
#ifndef DQW_Q15_MONITOR_H
#define DQW_Q15_MONITOR_H

#include "dqw_monitor_q15.h"

#define DQW_Q15_MONITOR_SCALE \
    {.v_full_mV = 12753u, .i_full_mA = 9008u, .w_full_mrad_s = 138610u, .dt_ns = 50000u, .pole_pairs = 4u}

#if DQW_MAP_WEIGHTS > 0
#define DQW_Q15_MONITOR_BANDS {0u, 0u, 0u, 0u, 3333u, 0u, 0u, 0u, 6667u, 0u, 0u, 0u, 33333u, 0u, 0u}
#else
#define DQW_Q15_MONITOR_BANDS {0u, 0u, 0u, 0u, 3333u, 0u, 6667u, 0u, 0u, 0u, 33333u, 0u, 0u}
#endif

#define DQW_Q15_MONITOR \
    .estimator = {.scale = DQW_Q15_MONITOR_SCALE, .R_uohm = 500000u, .Ld_nH = 1000000u, .Lq_nH = 1400000u, .psi_nWb = 20000000u, .dead_time_width_mA = 120u, .voltage_scale_ppm = 241u, .stale_limit = 10u, .excitation_q15 = 218u, .half_window = 20u, .angle = true, .encoder_offset = true, .follow = true, .noise_on_inputs = true, .threshold_ppm = 33333u}, \
    .band_ppm = DQW_Q15_MONITOR_BANDS, .alpha_ppm_per_K = 3900u, .J_nkgm2 = 300000u, .residual_floor_ppm = 1333u

#endif
