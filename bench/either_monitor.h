// The monitor in float, or in whole numbers with full scales of twice the bases and bands of the same size: what the benches run.
#ifndef BENCH_EITHER_MONITOR_H
#define BENCH_EITHER_MONITOR_H

#include <math.h>
#include <stdbool.h>

#include "dqw_monitor.h"
#include "dqw_monitor_q15.h"

#define EITHER_ROOM 2.0

typedef struct {
    bool q15;
    dqw_monitor_q15_config config_q15;
    dqw_monitor f;
    dqw_monitor_q15 q;
} either_monitor;

static inline uint32_t either_whole(double x) { return (uint32_t)lrint(x); }

static inline dqw_monitor_q15_config either_config(const dqw_monitor_config *c)
{
    const dqw_estimator_config *t = &c->estimator;
    dqw_monitor_q15_config q = {.estimator = {.scale = {.v_full_mV = either_whole(1e3 * EITHER_ROOM * (double)t->v_base_V),
                                                        .i_full_mA = either_whole(1e3 * EITHER_ROOM * (double)t->i_base_A),
                                                        .w_full_mrad_s = either_whole(1e3 * EITHER_ROOM * (double)t->w_base_rad_s),
                                                        .dt_ns = either_whole(1e9 * (double)t->dt_s),
                                                        .pole_pairs = t->pole_pairs},
                                              .R_uohm = either_whole(1e6 * (double)t->R_ohm),
                                              .Ld_nH = either_whole(1e9 * (double)t->Ld_H),
                                              .Lq_nH = either_whole(1e9 * (double)t->Lq_H),
                                              .psi_nWb = either_whole(1e9 * (double)t->psi_Wb),
                                              .dead_time_width_mA = either_whole(1e3 * (double)t->dead_time_width_A),
                                              .drift_ppm = either_whole(1e6 * (double)t->drift_per_sqrt_s),
                                              .stale_limit = t->stale_limit,
                                              .threshold_ppm = either_whole((t->threshold_ppm != 0 ? t->threshold_ppm : 50000) / EITHER_ROOM),
                                              .excitation_q15 = (uint16_t)lrint(0.01 / EITHER_ROOM * 32768),
                                              .half_window = (uint8_t)t->half_window,
                                              .angle = t->angle,
                                              .encoder_offset = t->encoder_offset,
                                              .noise_on_inputs = t->noise_on_inputs},
                                .alpha_ppm_per_K = either_whole(1e6 * (double)c->alpha_per_K),
                                .beta_ppm_per_K = either_whole(1e6 * (double)c->beta_per_K),
                                .heating_mK_s = either_whole(1e3 * (double)c->heating_K_s),
                                .J_nkgm2 = either_whole(1e9 * (double)c->J_kgm2),
                                .residual_floor_ppm = either_whole(2000 / EITHER_ROOM),
                                .commissioned = c->commissioned};
    for (int i = 0; i < DQW_WATCH_CHANNELS; i++) q.band_ppm[i] = either_whole(1e6 * (double)c->band[i]);
    if (q.band_ppm[DQW_WATCH_DEAD_TIME] == 0) q.band_ppm[DQW_WATCH_DEAD_TIME] = either_whole(5000 / EITHER_ROOM);
    if (q.band_ppm[DQW_WATCH_OFFSET] == 0) q.band_ppm[DQW_WATCH_OFFSET] = either_whole(10000 / EITHER_ROOM);
    if (q.band_ppm[DQW_WATCH_FRICTION] == 0) q.band_ppm[DQW_WATCH_FRICTION] = either_whole(50000 / EITHER_ROOM);
    return q;
}

static inline enum dqw_status either_init(either_monitor *m, const dqw_monitor_config *config, bool q15)
{
    m->q15 = q15;
    m->config_q15 = either_config(config);
    return q15 ? dqw_monitor_init_q15(&m->q, &m->config_q15) : dqw_monitor_init(&m->f, config);
}

/// Time has jumped.
static inline void either_jump(either_monitor *m)
{
    if (m->q15)
        dqw_monitor_missing_q15(&m->q, 0);
    else
        dqw_monitor_missing(&m->f, 0);
}

static inline int16_t either_q15(double x, double base) { return (int16_t)lrint(fmax(-32768, fmin(32767, 32768 * x / (EITHER_ROOM * base)))); }

/// One sample and the background. What has changed has its values in parts of its unit there where they are whole numbers.
static inline bool either_step(either_monitor *m, const dqw_monitor_config *c, const dqw_sample *s, dqw_monitor_change *e)
{
    if (!m->q15) {
        (void)dqw_monitor_sample(&m->f, s, false);
        return dqw_monitor_background(&m->f) && dqw_monitor_event(&m->f, e);
    }
    const dqw_estimator_config *t = &c->estimator;
    const double turn = atan2((double)s->sine, (double)s->cosine) / (2 * acos(-1.0));
    const dqw_sample_q15 x = dqw_sample_from_dq_q15(either_q15((double)s->v_d_V, (double)t->v_base_V), either_q15((double)s->v_q_V, (double)t->v_base_V),
                                                    either_q15((double)s->i_d_A, (double)t->i_base_A), either_q15((double)s->i_q_A, (double)t->i_base_A),
                                                    either_q15((double)s->w_m_rad_s, (double)t->w_base_rad_s),
                                                    (uint16_t)(lrint((turn - floor(turn)) * 65536) & 65535));
    dqw_monitor_change_q15 q;
    (void)dqw_monitor_sample_q15(&m->q, &x, false);
    if (!dqw_monitor_background_q15(&m->q) || !dqw_monitor_event_q15(&m->q, &q)) return false;
    e->sample = q.sample;
    e->since = q.since;
    e->parameter = q.parameter;
    e->value = ldexpf((float)q.value_q40, -40);
    e->sd = ldexpf((float)q.sd_q40, -40);
    e->healthy = ldexpf((float)q.healthy_q40, -40);
    e->fault.name = q.fault.name;
    e->fault.confidence = (float)q.fault.confidence_q15 / 32768.0f;
    e->fault.phase = q.fault.phase;
    return true;
}

static inline const dqw_stage *either_stage(const either_monitor *m) { return m->q15 ? &m->q.estimator.stage : &m->f.estimator.stage; }

#endif
