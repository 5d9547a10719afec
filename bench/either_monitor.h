// The monitor in float, or in whole numbers as the command configures it: what the benches run, and
// tests of both.
#ifndef BENCH_EITHER_MONITOR_H
#define BENCH_EITHER_MONITOR_H

#include <math.h>
#include <stdbool.h>

#include "app/q15/monitor_config.h"
#include "dqw_monitor.h"
#include "dqw_monitor_q15.h"

typedef struct {
    bool q15;
    dqw_monitor_q15_config config_q15;
    dqw_monitor f;
    dqw_monitor_q15 q;
} either_monitor;

static inline enum dqw_status either_init(either_monitor *m, const dqw_monitor_config *config, bool q15)
{
    m->q15 = q15;
    m->config_q15 = dqw_monitor_config_in_q15(config, DQW_Q15_ROOM);
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

static inline int16_t either_q15(double x, double base)
{
    return (int16_t)lrint(fmax(-32768, fmin(32767, 32768 * x / (DQW_Q15_ROOM * base))));
}

/// One sample and the background. What has changed has its values in parts of its unit there where they are whole
/// numbers.
static inline bool either_step(either_monitor *m, const dqw_monitor_config *c, const dqw_sample *s,
                               dqw_monitor_change *e)
{
    if (!m->q15) {
        (void)dqw_monitor_sample(&m->f, s, false);
        return dqw_monitor_background(&m->f) && dqw_monitor_event(&m->f, e);
    }
    const dqw_estimator_config *t = &c->estimator;
    const double turn = atan2((double)s->sine, (double)s->cosine) / (2 * acos(-1.0));
    dqw_sample_q15 x = dqw_sample_from_dq_q15(
        either_q15((double)s->v_d_V, (double)t->v_base_V), either_q15((double)s->v_q_V, (double)t->v_base_V),
        either_q15((double)s->i_d_A, (double)t->i_base_A), either_q15((double)s->i_q_A, (double)t->i_base_A),
        either_q15((double)s->w_m_rad_s, (double)t->w_base_rad_s),
        (uint16_t)(lrint((turn - floor(turn)) * 65536) & 65535));
    x.resting = s->resting;
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

/// R, L_d, L_q or the flux, SI.
static inline dqw_reading either_read(const either_monitor *m, enum dqw_parameter parameter)
{
    if (!m->q15) return dqw_estimator_read(&m->f.estimator, parameter);
    // Micro-ohms, else nanohenries and nanowebers.
    const double unit = ldexp(parameter == DQW_R ? 1e-6 : 1e-9, -40) *
                        (double)dqw_estimator_unit_q15(&m->config_q15.estimator, parameter);
    const dqw_reading_q15 q = dqw_estimator_read_q15(&m->q.estimator, parameter);
    const dqw_reading r = {.value = (float)((double)q.value_q40 * unit),
                           .sd = q.sd_q40 < INT64_MAX ? (float)((double)q.sd_q40 * unit) : DQW_UNKNOWN,
                           .sd_change = q.sd_change_q40 < INT64_MAX ? (float)((double)q.sd_change_q40 * unit)
                                                                    : DQW_UNKNOWN,
                           .usable = q.usable};
    return r;
}

static inline enum dqw_why either_why(const either_monitor *m)
{
    return m->q15 ? dqw_monitor_why_q15(&m->q) : dqw_monitor_why(&m->f);
}

static inline enum dqw_why either_unwatched(const either_monitor *m, enum dqw_monitor_channel channel)
{
    return m->q15 ? dqw_monitor_unwatched_q15(&m->q, channel) : dqw_monitor_unwatched(&m->f, channel);
}

static inline const dqw_stage *either_stage(const either_monitor *m)
{
    return m->q15 ? &m->q.estimator.stage : &m->f.estimator.stage;
}

#endif
