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
// Nor than what a ripple moves by that turns round: twice itself.
#define RIPPLE_TURNED 2.0f
#define USABLE_SD (0.1f / 3.0f)
// A change so much larger is told: in twenty looks (E63), and by two segments in 95 of 100 (E105). (E178)
#define TOLD 1.25f
// A weight that is found changed is no surer than so many segments later.
#define OPENED 3u
// In 95 of 100, on one side.
#define ONE_SIDED 1.64f
// The witness' memories within which a ripple is to be told, 2 s.
#define APART_MEMORIES 7.0f
// More than any fault makes of it: so much of R, L_d, L_q or the flux; of the others so many usual bands.
#define COARSE 0.3f
#define COARSE_BANDS 10.0f

static const float BAND[DQW_WATCH_CHANNELS] = {
    [DQW_WATCH_R] = 0.04f,       [DQW_WATCH_LD] = 0.06f,         [DQW_WATCH_LQ] = 0.06f,
    [DQW_WATCH_PSI] = 0.012f,    [DQW_WATCH_DEAD_TIME] = 0.005f, [DQW_WATCH_ANGLE] = 0.02f,
#if DQW_MAP_WEIGHTS > 0
    [DQW_WATCH_MAP_D] = 0.06f,   [DQW_WATCH_MAP_Q] = 0.06f,
#endif
    [DQW_WATCH_OFFSET] = 0.01f,  [DQW_WATCH_RESISTANCE] = 0.03f, [DQW_WATCH_REACTANCE] = 0.03f,
    [DQW_WATCH_SHORT] = 0.003f,  [DQW_WATCH_FRICTION] = 0.05f,   [DQW_WATCH_TEMPERATURE] = 110.0f,
    [DQW_WATCH_RESIDUAL] = 3.0f,
};
#define ALPHA_PER_K 0.0039f
#define BETA_PER_K 0.001f
#define HEATING_K_S 1.0f

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

float dqw_monitor_heat_since(const dqw_monitor *m, int channel)
{
    const dqw_monitor_config *c = m->config;
    const bool flux = channel == DQW_WATCH_PSI;
    const float rate = flux ? dqw_monitor_beta(m) * m->healthy.cold_psi_Wb
                            : dqw_monitor_alpha(m) * m->healthy.cold_R_ohm;
    const uint16_t halves = dqw_watch_unfollowed(&m->watch, channel, m->estimator.number);
    return rate * (c->heating_K_s > 0.0f ? c->heating_K_s : HEATING_K_S) *
           (DQW_MONITOR_SLACK * (float)(1u << DQW_WATCH_FOLLOW_SHIFT)) * c->estimator.dt_s *
           (float)(halves * m->estimator.window.half);
}

bool dqw_monitor_knows_heat(const dqw_monitor *m)
{
    // Until its healthy value has settled, what is cold goes with R.
    const bool has_cold = m->config->commissioned || m->watch.looks[DQW_WATCH_R] >= DQW_WATCH_LOOKS_LEAST;
    return has_cold && dqw_estimator_read(&m->estimator, DQW_R).sd < dqw_monitor_band_of(m, DQW_WATCH_R);
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
#if DQW_MAP_WEIGHTS > 0
        fabsf(h[DQW_WATCH_MAP_D]),
        fabsf(h[DQW_WATCH_MAP_Q]),
#endif
        c->i_base_A,
        h[DQW_R] * (1.0f / 3.0f),
        L3,
        1.0f / (3.0f * h[DQW_R]),
        1.5f * (float)c->pole_pairs * h[DQW_PSI] * c->i_base_A,
    };
    return dqw_monitor_band(m, channel) * unit[channel];
}

// 0 of a map's weight where there is no map.
static float weight_of(const dqw_monitor *m, int channel)
{
    const int weight = dqw_watch_weight(channel);
    return dqw_estimator_is_apart(&m->estimator, weight) ? 0.0f : dqw_estimator_value(&m->estimator, weight);
}

static float weight_sd(const dqw_monitor *m, int channel)
{
    const int weight = dqw_watch_weight(channel);
    return dqw_estimator_is_apart(&m->estimator, weight) ? DQW_UNKNOWN : dqw_estimator_sd(&m->estimator, weight);
}

float dqw_monitor_ripple(const float re[], const float im[], int channel)
{
    const int k = channel - DQW_WATCH_OFFSET;
    return sqrtf(re[k] * re[k] + im[k] * im[k]);
}

// What a healthy ripple may be another time: a resistance and a reactance share theirs while the speed stays, and either
// may be the other's, where that stands. (E63)
static float ripple_shared(const dqw_monitor *m, int channel)
{
    const float own = dqw_monitor_ripple(m->healthy.re, m->healthy.im, channel);
    if (channel != DQW_WATCH_RESISTANCE && channel != DQW_WATCH_REACTANCE) return own;
    const int other = channel == DQW_WATCH_RESISTANCE ? DQW_WATCH_REACTANCE : DQW_WATCH_RESISTANCE;
    const float power = m->witness.power[channel - DQW_WATCH_OFFSET];
    if (!(power > 0.0f) || m->watch.looks[other] < DQW_WATCH_LOOKS_LEAST) return own;
    return own + fabsf(m->witness.across) / power * dqw_monitor_ripple(m->healthy.re, m->healthy.im, other);
}

void dqw_monitor_read_channel(const dqw_monitor *m, int channel, dqw_monitor_channel_value *r)
{
    if (channel < DQW_WATCH_OFFSET) {
        r->now = weight_of(m, channel);
        r->change = r->now - m->healthy.weight[channel];
        r->sd = weight_sd(m, channel);
    } else if (channel < DQW_WATCH_FRICTION) {
        const int k = channel - DQW_WATCH_OFFSET;
        const float re = m->witness.re[k] - m->healthy.re[k];
        const float im = m->witness.im[k] - m->healthy.im[k];
        r->now = dqw_monitor_ripple(m->witness.re, m->witness.im, channel);
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
        const float now = weight_of(m, channel);
        m->healthy.weight[channel] = now + keep * (m->healthy.weight[channel] - now);
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
    float wanders = 0.0f;
    if (channel >= DQW_WATCH_OFFSET) {
        if (channel < DQW_WATCH_FRICTION) wanders = RIPPLE_TURNED * ripple_shared(m, channel);
    } else if (m->config->estimator.follow) {
        const dqw_estimator *e = &m->estimator;
        const int weight = dqw_watch_weight(channel);
        wanders = WANDERS * e->segment.band_pu[weight] * dqw_estimator_unit(e, weight);
    }
    return wanders > least ? wanders : least;
}

dqw_reading dqw_monitor_read(const dqw_monitor *m, enum dqw_monitor_channel channel)
{
    dqw_reading r = {.value = 0.0f, .sd = DQW_UNKNOWN, .sd_change = DQW_UNKNOWN, .usable = false};
    if ((unsigned)channel >= DQW_WATCH_CHANNELS) return r;
    if (channel <= DQW_WATCH_ANGLE) return dqw_estimator_read(&m->estimator, (enum dqw_parameter)channel);
    // Temperature counts from a cold value that is taken on entering service.
    if (channel == DQW_WATCH_TEMPERATURE && !(m->healthy.cold_R_ohm > 0.0f)) return r;
    dqw_monitor_channel_value x;
    dqw_monitor_read_channel(m, (int)channel, &x);
    r.value = x.now;
    r.sd = r.sd_change = x.sd;
    if ((int)channel < DQW_WATCH_OFFSET && x.sd < DQW_UNKNOWN)
        r.sd = dqw_estimator_sd_value(&m->estimator, dqw_watch_weight((int)channel));
    r.usable = r.sd < USABLE_SD * fabsf(r.value);
    return r;
}

static bool is_asked_for(const dqw_monitor *m, int channel)
{
    const dqw_estimator *e = &m->estimator;
    if (channel == DQW_WATCH_DEAD_TIME) return dqw_estimator_has_dead_time(e);
    if (channel == DQW_WATCH_ANGLE) return dqw_estimator_has_flux_q(e);
    if (dqw_watch_is_map(channel)) return dqw_estimator_has_map(e);
    if (channel == DQW_WATCH_FRICTION) return m->config->J_kgm2 > 0.0f;
    return channel < DQW_WATCH_OFFSET || channel > DQW_WATCH_FRICTION || e->config->angle;
}

// More than any fault makes of it.
static float too_much(const dqw_monitor *m, int channel)
{
    if (dqw_watch_is_part(channel)) return COARSE * fabsf(m->healthy.weight[channel]);
    return COARSE_BANDS * BAND[channel] * dqw_monitor_band_of(m, channel) / dqw_monitor_band(m, channel);
}

// A ripple over what its own input has of it after so many memories: resistance and reactance share it while the speed
// stays, those and shorted turns while the current does. (E178)
static float shared(const dqw_monitor *m, int channel)
{
    if (channel <= DQW_WATCH_OFFSET || channel >= DQW_WATCH_FRICTION) return 1.0f;
    const dqw_segment *s = &m->estimator.segment;
    const int k = channel == DQW_WATCH_SHORT ? 1 : 0;
    const float mean = s->mean[k] * s->mean[k];
    const float like = mean > 0.0f ? sqrtf(mean / (mean + s->variance[k])) : 0.0f;
    const float apart = APART_MEMORIES * (1.0f - like);
    return (1.0f + apart) / (0.5f + apart);
}

// Why not, and where it is watched the smallest change that would be an event; DQW_UNKNOWN else.
static enum dqw_why sees(const dqw_monitor *m, int channel, float *least)
{
    const dqw_estimator *e = &m->estimator;
    *least = DQW_UNKNOWN;
    // [CHN.3] what the configuration asks for, and while anything is watched
    if ((unsigned)channel >= DQW_WATCH_CHANNELS || !is_asked_for(m, channel)) return DQW_WHY_NOT_ASKED;
    const enum dqw_why nothing = dqw_monitor_why(m);
    if (nothing != DQW_WHY_IN_SERVICE) return nothing;
    if (channel == DQW_WATCH_RESIDUAL) {
        *least = dqw_monitor_band(m, channel) * sqrtf(m->healthy.residual_pu2) * m->config->estimator.v_base_V;
        return DQW_WHY_IN_SERVICE;
    }

    // [CHN.4] what the motion teaches, and makes sense
    const int weight = channel == DQW_WATCH_TEMPERATURE ? (int)DQW_R
                       : channel < DQW_WATCH_OFFSET     ? dqw_watch_weight(channel)
                                                        : channel;
    dqw_monitor_channel_value x;
    dqw_monitor_read_channel(m, channel, &x);
    const bool by_weight = channel < DQW_WATCH_OFFSET || channel == DQW_WATCH_TEMPERATURE;
    const bool moves = !by_weight || e->excess_q10[weight] > 0;
    if (!moves || !(x.sd < DQW_UNKNOWN)) return DQW_WHY_NOT_TAUGHT;
    if (by_weight && weight <= DQW_PSI && !(dqw_estimator_value(e, weight) > 0.0f)) return DQW_WHY_SIGN;
    if (channel == DQW_WATCH_LQ && m->config->estimator.observed) return DQW_WHY_OBSERVED;

    // [CHN.5] what is known well enough: a temperature where R is to its band
    if (channel == DQW_WATCH_TEMPERATURE) {
        if (!dqw_monitor_knows_heat(m)) return DQW_WHY_UNSETTLED;
        *least = dqw_monitor_band(m, channel) +
                 ONE_SIDED * dqw_estimator_read(e, DQW_R).sd_change / (m->healthy.cold_R_ohm * dqw_monitor_alpha(m));
        return DQW_WHY_IN_SERVICE;
    }
    if (m->watch.looks[channel] < DQW_WATCH_LOOKS_LEAST) return DQW_WHY_UNSETTLED;

    // [CHN.6] what segments tell as well, and an opening leaves unsure; and what is too much
    const bool followed = channel < DQW_WATCH_OFFSET && e->config->follow;
    const uint16_t since = followed && e->segment.since > OPENED ? OPENED : e->segment.since;
    float sure = dqw_monitor_surely(m, channel, followed ? dqw_estimator_sd_since(e, weight, since) : x.sd);
    if (followed) {
        const float seen_pu = dqw_segment_sees(&e->segment, weight);
        if (!(seen_pu < DQW_UNKNOWN)) return e->segment.segments == 0 ? DQW_WHY_UNSETTLED : DQW_WHY_NOT_TAUGHT;
        const float seen = seen_pu * dqw_estimator_unit(e, weight);
        sure = seen > sure ? seen : sure;
    }
    *least = TOLD * shared(m, channel) * sure;
    if (channel == DQW_WATCH_R || channel == DQW_WATCH_PSI) *least += dqw_monitor_heat_since(m, channel);
    return sure < too_much(m, channel) ? DQW_WHY_IN_SERVICE : DQW_WHY_COARSE;
}

enum dqw_why dqw_monitor_unwatched(const dqw_monitor *m, enum dqw_monitor_channel channel)
{
    float least;
    return sees(m, (int)channel, &least);
}

float dqw_monitor_sensitivity(const dqw_monitor *m, enum dqw_monitor_channel channel)
{
    float least;
    (void)sees(m, (int)channel, &least);
    return least;
}
