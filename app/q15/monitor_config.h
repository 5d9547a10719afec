// The fixed-point monitor's configuration from the float one's: the same bands, thresholds and nominal values. For C
// and C++.
#ifndef DQW_APP_Q15_MONITOR_CONFIG_H
#define DQW_APP_Q15_MONITOR_CONFIG_H

#include <math.h>

#include "dqw_monitor.h"
#include "dqw_monitor_q15.h"

/// Full scales are so many bases: what a fault makes of a signal still fits.
#define DQW_Q15_ROOM 1.5

/// As a whole number; what does not fit becomes one that init refuses.
static inline uint32_t dqw_q15_whole(double x) { return x >= 0.0 && x <= 4e9 ? (uint32_t)lround(x) : UINT32_MAX; }

static inline int32_t dqw_q15_whole_either(double x) { return fabs(x) < 2e9 ? (int32_t)lround(x) : INT32_MAX; }

/// With full scales of `room` bases. Effects and lent memory are left out: they are of one arithmetic.
static inline dqw_monitor_q15_config dqw_monitor_config_in_q15(const dqw_monitor_config* from, double room)
{
    const dqw_estimator_config* f = &from->estimator;
    dqw_monitor_q15_config c = dqw_monitor_config_default_q15(NULL);
    dqw_estimator_q15_config* t = &c.estimator;
    t->scale.v_full_mV = dqw_q15_whole(1e3 * room * (double)f->v_base_V);
    t->scale.i_full_mA = dqw_q15_whole(1e3 * room * (double)f->i_base_A);
    t->scale.w_full_mrad_s = dqw_q15_whole(1e3 * room * (double)f->w_base_rad_s);
    t->scale.dt_ns = dqw_q15_whole(1e9 * (double)f->dt_s);
    t->scale.pole_pairs = f->pole_pairs;
    t->R_uohm = dqw_q15_whole(1e6 * (double)f->R_ohm);
    t->Ld_nH = dqw_q15_whole(1e9 * (double)f->Ld_H);
    t->Lq_nH = dqw_q15_whole(1e9 * (double)f->Lq_H);
    t->psi_nWb = dqw_q15_whole(1e9 * (double)f->psi_Wb);
    t->dead_time_width_mA = dqw_q15_whole(1e3 * (double)f->dead_time_width_A);
    // A width so small is a milliampere: 0 would learn none.
    if (t->dead_time_width_mA == 0 && f->dead_time_width_A > 0.0f) t->dead_time_width_mA = 1;
    t->angle_late_ns = dqw_q15_whole_either(1e9 * (double)f->angle_late_s);
    t->voltage_error_mV = dqw_q15_whole(1e3 * (double)f->voltage_error_V);
    t->voltage_scale_ppm = f->voltage_scale_ppm;
    t->modulation = f->modulation;
    t->stale_limit = f->stale_limit;
    t->half_window = (uint8_t)(f->half_window < DQW_WINDOW_Q15_HALF ? f->half_window : DQW_WINDOW_Q15_HALF);
    t->angle = f->angle;
    t->encoder_offset = f->encoder_offset;
    t->follow = f->follow;
    t->observed = f->observed;
    t->noise_on_inputs = f->noise_on_inputs;
    t->voltage_next = f->voltage_next;
    t->voltage_held = f->voltage_held;
    t->speed_electrical = f->speed_electrical;
    // The same in volts, amperes and newton metres as with the bases; L, whose input is a product, a half more.
    t->excitation_q15 = (uint16_t)lround((f->excitation_pu > 0.0f ? (double)f->excitation_pu : 0.01) / room * 32768.0);
    t->threshold_ppm = dqw_q15_whole((f->threshold_ppm != 0 ? f->threshold_ppm : 50000u) / room);
    for (int i = 0; i < DQW_WATCH_CHANNELS; i++) {
        // What is a part of a base, and its default; else of the healthy value.
        const double usual = i == DQW_WATCH_DEAD_TIME  ? 5000.0
                             : i == DQW_WATCH_OFFSET   ? 10000.0
                             : i == DQW_WATCH_FRICTION ? 50000.0
                                                       : 0.0;
        const double ppm = from->band[i] > 0.0f ? 1e6 * (double)from->band[i] : usual;
        c.band_ppm[i] = dqw_q15_whole(ppm / (usual > 0.0 ? room : 1.0));
    }
    c.residual_floor_ppm = dqw_q15_whole(2000.0 / room);
    c.alpha_ppm_per_K = dqw_q15_whole(1e6 * (double)from->alpha_per_K);
    c.beta_ppm_per_K = dqw_q15_whole(1e6 * (double)from->beta_per_K);
    c.heating_mK_s = dqw_q15_whole(1e3 * (double)from->heating_K_s);
    c.J_nkgm2 = dqw_q15_whole(1e9 * (double)from->J_kgm2);
    c.commissioned = from->commissioned;
    return c;
}

#endif
