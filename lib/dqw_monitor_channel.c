// What the monitor reads: every channel's value, its change from the healthy one, its deviation and its band.
#include "dqw_monitor_channel.h"

#include <math.h>

#include "dqw_estimator_block.h"
#include "dqw_number.h"
#include "dqw_segment.h"

// No band is narrower than this many deviations.
#define DEVIATIONS 5.0f
// Nor than so many of its scatters between segments.
#define WANDERS 3.0f
#define USABLE_SD (0.1f / 3.0f)

static const float BAND[DQW_WATCH_CHANNELS] = {
    [DQW_WATCH_R] = 0.04f,       [DQW_WATCH_LD] = 0.06f,         [DQW_WATCH_LQ] = 0.06f,
    [DQW_WATCH_PSI] = 0.012f,    [DQW_WATCH_DEAD_TIME] = 0.005f, [DQW_WATCH_ANGLE] = 0.02f,
    [DQW_WATCH_OFFSET] = 0.01f,  [DQW_WATCH_RESISTANCE] = 0.03f, [DQW_WATCH_REACTANCE] = 0.03f,
    [DQW_WATCH_SHORT] = 0.003f,  [DQW_WATCH_FRICTION] = 0.05f,   [DQW_WATCH_TEMPERATURE] = 110.0f,
    [DQW_WATCH_RESIDUAL] = 3.0f,
};
#define ALPHA_PER_K 0.0039f
#define BETA_PER_K 0.001f

static float or_else(float configured, float otherwise)
{
    return configured > 0.0f ? configured : otherwise;
}

float dqw_monitor_band(const dqw_monitor *m, int channel)
{
    return or_else(m->config->band[channel], BAND[channel]);
}

float dqw_monitor_alpha(const dqw_monitor *m)
{
    return or_else(m->config->alpha_per_K, ALPHA_PER_K);
}

float dqw_monitor_beta(const dqw_monitor *m)
{
    return or_else(m->config->beta_per_K, BETA_PER_K);
}

float dqw_monitor_rise_K(const dqw_monitor *m, float R_ohm)
{
    return (R_ohm / m->healthy.cold_R_ohm - 1.0f) / dqw_monitor_alpha(m);
}

float dqw_monitor_band_of(const dqw_monitor *m, int channel)
{
    const dqw_estimator_config *c = &m->config->estimator;
    const float *h = m->healthy.weight;
    const float L3 = (h[DQW_LD] + h[DQW_LQ]) * (1.0f / 6.0f);
    const float unit[DQW_WATCH_TEMPERATURE] = {
        h[DQW_R],
        h[DQW_LD],
        h[DQW_LQ],
        h[DQW_PSI],
        c->v_base_V,
        h[DQW_PSI],
        c->i_base_A,
        h[DQW_R] * (1.0f / 3.0f),
        L3,
        1.0f / (3.0f * h[DQW_R]),
        1.5f * (float)c->pole_pairs * h[DQW_PSI] * c->i_base_A,
    };
    return dqw_monitor_band(m, channel) * unit[channel];
}

void dqw_monitor_read_channel(const dqw_monitor *m, int channel, dqw_monitor_channel_value *r)
{
    if (channel < DQW_WATCH_OFFSET) {
        r->now = dqw_estimator_value(&m->estimator, channel);
        r->change = r->now - m->healthy.weight[channel];
        r->sd = dqw_estimator_sd(&m->estimator, channel);
    } else if (channel < DQW_WATCH_FRICTION) {
        const int k = channel - DQW_WATCH_OFFSET;
        const float re = m->witness.re[k] - m->healthy.re[k];
        const float im = m->witness.im[k] - m->healthy.im[k];
        r->now = dqw_witness_size(&m->witness, (enum dqw_witness_input)k);
        r->change = sqrtf(re * re + im * im);
        r->sd = dqw_witness_sd(&m->witness, &m->estimator, (enum dqw_witness_input)k);
    } else if (channel == DQW_WATCH_FRICTION) {
        r->now = m->friction_Nm;
        r->change = r->now - m->healthy.friction_Nm;
        const uint8_t n = m->watch.reversals;
        r->sd = n >= DQW_WATCH_REVERSALS_LEAST ? sqrtf(2.0f * m->spread_Nm2 / (float)n) : DQW_UNKNOWN;
    } else {
        const bool hot = channel == DQW_WATCH_TEMPERATURE;
        r->now = r->change = hot ? dqw_monitor_rise_K(m, dqw_estimator_value(&m->estimator, DQW_R))
                                 : sqrtf(m->estimator.recent_pu2) * m->config->estimator.v_base_V;
        const float R_sd = dqw_estimator_sd(&m->estimator, DQW_R);
        r->sd = !hot ? 0.0f : R_sd < DQW_UNKNOWN ? R_sd / (m->healthy.cold_R_ohm * dqw_monitor_alpha(m)) : DQW_UNKNOWN;
    }
}

void dqw_monitor_move_healthy(dqw_monitor *m, int channel, float keep)
{
    if (channel < DQW_WATCH_OFFSET) {
        m->healthy.weight[channel] = dqw_estimator_value(&m->estimator, channel) +
                                     keep * (m->healthy.weight[channel] - dqw_estimator_value(&m->estimator, channel));
    } else if (channel < DQW_WATCH_FRICTION) {
        const int k = channel - DQW_WATCH_OFFSET;
        m->healthy.re[k] = m->witness.re[k] + keep * (m->healthy.re[k] - m->witness.re[k]);
        m->healthy.im[k] = m->witness.im[k] + keep * (m->healthy.im[k] - m->witness.im[k]);
    } else {
        m->healthy.friction_Nm = m->friction_Nm + keep * (m->healthy.friction_Nm - m->friction_Nm);
    }
}

float dqw_monitor_surely(const dqw_monitor *m, int channel, float deviation)
{
    if (!(deviation < DQW_UNKNOWN)) return DQW_UNKNOWN;
    // [CHN.1] the deviation of a change: the healthy value has one too, less, the more looks it is the mean of
    const float looks = (float)m->watch.looks[channel];
    const float sure = DEVIATIONS * deviation *
                       sqrtf(1.0f + (float)DQW_WATCH_LOOKS_ALIKE / ((float)DQW_WATCH_LOOKS_ALIKE + looks));
    // [CHN.2] no narrower than the band, nor than it was seen to wander
    const float width = dqw_monitor_band_of(m, channel);
    const float least = width > sure ? width : sure;
    if (channel >= DQW_WATCH_OFFSET || !m->config->estimator.follow) return least;
    const dqw_estimator *e = &m->estimator;
    const float wanders = WANDERS * e->segment.band_pu[channel] * dqw_estimator_unit(e, channel);
    return wanders > least ? wanders : least;
}

dqw_reading dqw_monitor_read(const dqw_monitor *m, enum dqw_monitor_channel channel)
{
    dqw_reading r = {.value = 0.0f, .sd = DQW_UNKNOWN, .sd_change = DQW_UNKNOWN, .usable = false};
    if ((unsigned)channel >= DQW_WATCH_CHANNELS) return r;
    if ((int)channel < DQW_WATCH_OFFSET) return dqw_estimator_read(&m->estimator, (enum dqw_parameter)channel);
    // Temperature counts from a cold value that is taken on entering service.
    if (channel == DQW_WATCH_TEMPERATURE && !(m->healthy.cold_R_ohm > 0.0f)) return r;
    dqw_monitor_channel_value x;
    dqw_monitor_read_channel(m, (int)channel, &x);
    r.value = x.now;
    r.sd = r.sd_change = x.sd;
    r.usable = r.sd < USABLE_SD * fabsf(r.value);
    return r;
}

float dqw_monitor_sensitivity(const dqw_monitor *m, enum dqw_monitor_channel channel)
{
    if ((unsigned)channel >= DQW_WATCH_CHANNELS || dqw_monitor_why(m) != DQW_WHY_IN_SERVICE) return DQW_UNKNOWN;
    dqw_monitor_channel_value x;
    dqw_monitor_read_channel(m, (int)channel, &x);
    if (channel == DQW_WATCH_TEMPERATURE) return x.sd < DQW_UNKNOWN ? dqw_monitor_band(m, (int)channel) : DQW_UNKNOWN;
    if (channel == DQW_WATCH_RESIDUAL)
        return dqw_monitor_band(m, (int)channel) * sqrtf(m->healthy.residual_pu2) * m->config->estimator.v_base_V;
    if (m->watch.looks[channel] < DQW_WATCH_LOOKS_LEAST) return DQW_UNKNOWN;
    const float sure = dqw_monitor_surely(m, (int)channel, x.sd);
    const dqw_estimator *e = &m->estimator;
    if ((int)channel >= DQW_WATCH_OFFSET || !e->config->follow) return sure;
    const float sees = dqw_segment_sees(&e->segment, (int)channel);
    const float seen = sees < DQW_UNKNOWN ? sees * dqw_estimator_unit(e, (int)channel) : DQW_UNKNOWN;
    return seen > sure ? seen : sure;
}
