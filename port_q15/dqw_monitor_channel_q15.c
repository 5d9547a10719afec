// What the monitor reads: every channel's value, its change from the healthy one, its deviation and its band.
#include "dqw_monitor_channel_q15.h"

#include "dqw_estimator_block_q15.h"
#include "dqw_q15.h"

// No band is narrower than this many deviations.
#define DEVIATIONS 5
// Nor than so many of its scatters between segments.
#define WANDERS 3
// Nor than what a ripple moves by that turns round: twice itself.
#define RIPPLE_TURNED 2
// Usable: three deviations are below a tenth of the value.
#define USABLE_PARTS 30
// More than any fault makes of it: 0.3 of R, L_d, L_q or the flux; of the others so many usual bands.
#define COARSE_TENTHS 3
#define COARSE_BANDS 10
// A weight that is found changed is no surer than so many segments later.
#define OPENED 3u
// In 95 of 100, on one side.
#define ONE_SIDED_PARTS 164
// The witness' memories within which a ripple is to be told, 2 s.
#define APART_MEMORIES 7
#define MILLION 1000000
#define ONE_Q30 1073741824

static const uint32_t BAND_PPM[DQW_WATCH_CHANNELS] = {
    [DQW_WATCH_R] = 40000,          [DQW_WATCH_LD] = 60000,         [DQW_WATCH_LQ] = 60000,
    [DQW_WATCH_PSI] = 12000,        [DQW_WATCH_DEAD_TIME] = 5000,   [DQW_WATCH_ANGLE] = 20000,
#if DQW_MAP_WEIGHTS > 0
    [DQW_WATCH_MAP_D] = 60000,      [DQW_WATCH_MAP_Q] = 60000,
#endif
    [DQW_WATCH_OFFSET] = 10000,     [DQW_WATCH_RESISTANCE] = 30000, [DQW_WATCH_REACTANCE] = 30000,
    [DQW_WATCH_SHORT] = 3000,       [DQW_WATCH_FRICTION] = 50000,   [DQW_WATCH_TEMPERATURE] = 110000000,
    [DQW_WATCH_RESIDUAL] = 3000000,
};
#define ALPHA_PPM_PER_K 3900u
#define BETA_PPM_PER_K 1000u
#define HEATING_MK_S 1000u

int64_t dqw_monitor_band_q24(const dqw_monitor_q15 *m, int channel)
{
    return dqw_q_quotient64(dqw_monitor_or_else(m->config->band_ppm[channel], BAND_PPM[channel]), MILLION, 24);
}

int64_t dqw_monitor_alpha_ppm(const dqw_monitor_q15 *m)
{
    return dqw_monitor_or_else(m->config->alpha_ppm_per_K, ALPHA_PPM_PER_K);
}

int64_t dqw_monitor_beta_ppm(const dqw_monitor_q15 *m)
{
    return dqw_monitor_or_else(m->config->beta_ppm_per_K, BETA_PPM_PER_K);
}

int32_t dqw_monitor_heat_since_q24(const dqw_monitor_q15 *m, int channel)
{
    const dqw_monitor_q15_config *c = m->config;
    const bool flux = channel == DQW_WATCH_PSI;
    const int64_t halves = dqw_watch_unfollowed(&m->watch, channel, m->estimator.number);
    const int64_t ppm_per_K = flux ? dqw_monitor_beta_ppm(m) : dqw_monitor_alpha_ppm(m);
    // Millionths by mK up to 2^40, by 13 over 10^10; ns up to 2^30 by 2^31
    const int64_t rate_q40 = dqw_q_quotient64(
        ppm_per_K * dqw_monitor_or_else(c->heating_mK_s, HEATING_MK_S) * DQW_MONITOR_SLACK_TENTHS, 10000000000, 40);
    const int64_t time_q20 = dqw_q_quotient64((int64_t)c->estimator.scale.dt_ns *
                                                  ((halves << DQW_WATCH_FOLLOW_SHIFT) * m->estimator.window.half),
                                              1000000000, 20);
    return dqw_q_times32(dqw_q_product64(rate_q40, time_q20, -20),
                         flux ? m->healthy.cold_psi_q24 : m->healthy.cold_R_q24, -40);
}

// A part of R, which is that of its cold value per kelvin, in kelvin.
static int32_t kelvin_q16(const dqw_monitor_q15 *m, int64_t R_q24)
{
    return dqw_q_quotient32(R_q24 * MILLION, m->healthy.cold_R_q24 * dqw_monitor_alpha_ppm(m), 16);
}

int32_t dqw_monitor_rise_q16(const dqw_monitor_q15 *m, int32_t R_q24)
{
    return kelvin_q16(m, (int64_t)R_q24 - m->healthy.cold_R_q24);
}

int32_t dqw_monitor_band_of_q15(const dqw_monitor_q15 *m, int channel)
{
    const dqw_estimator_q15_config *c = &m->config->estimator;
    const int32_t *h = m->healthy.weight_q24;
    const int64_t band = dqw_monitor_band_q24(m, channel);
    int32_t of = h[DQW_PSI];
    switch (channel) {
    case DQW_WATCH_DEAD_TIME: return dqw_q31_sat(band * DQW_DEAD_TIME_Q15_PARTS);
    case DQW_WATCH_OFFSET: return dqw_q31_sat(band);
    case DQW_WATCH_SHORT: return dqw_q_quotient32(band, 3 * dqw_q_times64(dqw_witness_short_q40(c), h[DQW_R], -24), 40);
    case DQW_WATCH_RESISTANCE: of = h[DQW_R] / 3; break;
    case DQW_WATCH_REACTANCE: of = dqw_witness_mean_L_q24(c, h[DQW_LD], h[DQW_LQ]) / 3; break;
    case DQW_WATCH_ANGLE:
    case DQW_WATCH_FRICTION: break;
#if DQW_MAP_WEIGHTS > 0
    case DQW_WATCH_MAP_D:
    case DQW_WATCH_MAP_Q: of = dqw_q31_sat(dqw_q_size64(h[channel])); break;
#endif
    default: of = h[channel]; break;
    }
    return dqw_q_times32(band, of, -24);
}

static int32_t q24_of(int32_t x_q28)
{
    return x_q28 == INT32_MAX ? INT32_MAX : dqw_q_floor32(x_q28, 4);
}

static int32_t difference(int32_t a, int32_t b)
{
    return dqw_q31_sat((int64_t)a - b);
}

// A number of a channel's weight as the estimator counts it: of a map's as the map does, 0 where there is none.
static int32_t counted_q24(const dqw_monitor_q15 *m, int channel, int32_t x_q24)
{
#if DQW_MAP_WEIGHTS > 0
    const dqw_estimator_q15 *e = &m->estimator;
    const int weight = dqw_watch_weight(channel);
    if (weight < DQW_PARAMETERS || x_q24 == INT32_MAX) return x_q24;
    if (!dqw_estimator_has_map_q15(e)) return 0;
    const int64_t w_q40 = dqw_q_scale64(x_q24, 16 + (int)dqw_estimator_shift_q15(e, weight));
    return dqw_q31_sat(dqw_q_round64(dqw_effect_restored_q40(&e->effect, 0, weight - DQW_PARAMETERS, w_q40), 16));
#else
    (void)m;
    (void)channel;
    return x_q24;
#endif
}

static int32_t weight_q24(const dqw_monitor_q15 *m, int channel)
{
    return counted_q24(m, channel, dqw_estimator_value_q24(&m->estimator, dqw_watch_weight(channel)));
}

static int32_t sd_q24(const dqw_monitor_q15 *m, int channel)
{
    const int weight = dqw_watch_weight(channel);
    return dqw_estimator_is_apart_q15(&m->estimator, weight)
               ? INT32_MAX
               : counted_q24(m, channel, dqw_estimator_sd_q24(&m->estimator, weight));
}

int32_t dqw_monitor_ripple_q24(const int32_t re_q28[], const int32_t im_q28[], int channel)
{
    const int k = channel - DQW_WATCH_OFFSET;
    return dqw_q_floor32(dqw_q_length32(re_q28[k], im_q28[k]), 4);
}

// What a healthy ripple may be another time: a resistance and a reactance share theirs while the speed stays, and either
// may be the other's, where that stands. (E63)
static int64_t ripple_shared_q24(const dqw_monitor_q15 *m, int channel)
{
    const int32_t own = dqw_monitor_ripple_q24(m->healthy.re_q28, m->healthy.im_q28, channel);
    if (channel != DQW_WATCH_RESISTANCE && channel != DQW_WATCH_REACTANCE) return own;
    const int other = channel == DQW_WATCH_RESISTANCE ? DQW_WATCH_REACTANCE : DQW_WATCH_RESISTANCE;
    if (m->watch.looks[other] < DQW_WATCH_LOOKS_LEAST) return own;
    const int64_t power_q52 = m->witness.power_q52[channel - DQW_WATCH_OFFSET];
    const int64_t part_q24 = dqw_q_quotient64(dqw_q_size64(m->witness.across_q52), power_q52, 24);
    return own + dqw_q_times64(part_q24, dqw_monitor_ripple_q24(m->healthy.re_q28, m->healthy.im_q28, other), -24);
}

void dqw_monitor_read_channel_q15(const dqw_monitor_q15 *m, int channel, dqw_monitor_channel_q15 *r)
{
    if (channel < DQW_WATCH_OFFSET) {
        r->now = weight_q24(m, channel);
        r->change = difference(r->now, m->healthy.weight_q24[channel]);
        r->sd = sd_q24(m, channel);
    } else if (channel < DQW_WATCH_FRICTION) {
        const int k = channel - DQW_WATCH_OFFSET;
        const int32_t re = difference(m->witness.re_q28[k], m->healthy.re_q28[k]);
        const int32_t im = difference(m->witness.im_q28[k], m->healthy.im_q28[k]);
        r->now = dqw_monitor_ripple_q24(m->witness.re_q28, m->witness.im_q28, channel);
        r->change = q24_of(dqw_q_length32(re, im));
        r->sd = q24_of(dqw_witness_sd_q28(&m->witness, &m->estimator, (enum dqw_witness_input)k));
    } else if (channel == DQW_WATCH_FRICTION) {
        r->now = m->friction_q24;
        r->change = difference(r->now, m->healthy.friction_q24);
        const uint8_t n = m->watch.reversals;
        r->sd = n >= DQW_WATCH_REVERSALS_LEAST
                    ? dqw_q31_sat(dqw_q_root64((uint64_t)dqw_q_quotient64(m->spread_q48, n, 1)))
                    : INT32_MAX;
    } else if (channel == DQW_WATCH_TEMPERATURE) {
        const int32_t R_sd = dqw_estimator_sd_q24(&m->estimator, DQW_R);
        r->now = r->change = dqw_monitor_rise_q16(m, m->estimator.w_q24[DQW_R]);
        r->sd = R_sd == INT32_MAX ? INT32_MAX : kelvin_q16(m, R_sd);
    } else {
        r->now = r->change = (int32_t)(dqw_estimator_recent_q27(&m->estimator) >> 3);
        r->sd = 0;
    }
}

static void nearer(int32_t *healthy, int32_t now, int n)
{
    *healthy = dqw_q31_sat(*healthy + dqw_q_quotient64((int64_t)now - *healthy, n, 0));
}

void dqw_monitor_move_healthy_q15(dqw_monitor_q15 *m, int channel, int n)
{
    if (channel < DQW_WATCH_OFFSET) {
        nearer(&m->healthy.weight_q24[channel], weight_q24(m, channel), n);
    } else if (channel < DQW_WATCH_FRICTION) {
        const int k = channel - DQW_WATCH_OFFSET;
        nearer(&m->healthy.re_q28[k], m->witness.re_q28[k], n);
        nearer(&m->healthy.im_q28[k], m->witness.im_q28[k], n);
    } else {
        nearer(&m->healthy.friction_q24, m->friction_q24, n);
    }
}

int64_t dqw_monitor_surely_q15(const dqw_monitor_q15 *m, int channel, int32_t deviation)
{
    // [CHN.1] the deviation of a change: the healthy value has one too, less, the more looks it is the mean of
    const uint32_t looks = m->watch.looks[channel];
    const uint32_t wider_q15 = dqw_q_root64((uint64_t)ONE_Q30 + (uint64_t)ONE_Q30 / (DQW_WATCH_LOOKS_ALIKE + looks) *
                                                                    DQW_WATCH_LOOKS_ALIKE);
    const int64_t sure = dqw_q_round64((int64_t)deviation * DEVIATIONS * wider_q15, 15);
    // [CHN.2] no narrower than the band, nor than it was seen to wander
    const int64_t width = dqw_monitor_band_of_q15(m, channel);
    const int64_t least = width > sure ? width : sure;
    int64_t wanders = 0;
    if (channel >= DQW_WATCH_OFFSET) {
        if (channel < DQW_WATCH_FRICTION) wanders = RIPPLE_TURNED * ripple_shared_q24(m, channel);
    } else if (m->config->estimator.follow) {
        const int32_t band_q24 = m->estimator.segment.band_q28[dqw_watch_weight(channel)] >> 4;
        wanders = (int64_t)WANDERS * counted_q24(m, channel, band_q24);
    }
    return wanders > least ? wanders : least;
}

int32_t dqw_monitor_residual_limit_q24(const dqw_monitor_q15 *m)
{
    return dqw_q_times32(dqw_monitor_band_q24(m, DQW_WATCH_RESIDUAL),
                         dqw_q31_sat(dqw_q_root64((uint64_t)m->healthy.residual_q54)), -27);
}

int32_t dqw_monitor_of_cold_q24(int32_t cold_q24, int64_t more_q24)
{
    return dqw_q_times32(((int64_t)1 << 24) + more_q24, cold_q24, -24);
}

int64_t dqw_monitor_flux_lost_q24(const dqw_monitor_q15 *m, int64_t rise_q16)
{
    // 2^20 by 2^31 by 2^4
    return dqw_q_quotient64(dqw_monitor_beta_ppm(m) * rise_q16 * DQW_MONITOR_SLACK_TENTHS, (int64_t)10 * MILLION, 8) +
           dqw_q_round64(dqw_monitor_band_q24(m, DQW_WATCH_PSI), 1);
}

int64_t dqw_monitor_q40_of(int channel, int32_t x)
{
    return x == INT32_MAX ? INT64_MAX : x * (channel == DQW_WATCH_TEMPERATURE ? (int64_t)1 << 24 : (int64_t)1 << 16);
}

dqw_reading_q15 dqw_monitor_read_q15(const dqw_monitor_q15 *m, enum dqw_monitor_channel channel)
{
    dqw_reading_q15 r = {.value_q40 = 0, .sd_q40 = INT64_MAX, .sd_change_q40 = INT64_MAX, .usable = false};
    if ((unsigned)channel >= DQW_WATCH_CHANNELS) return r;
    if (channel <= DQW_WATCH_ANGLE) return dqw_estimator_read_q15(&m->estimator, (enum dqw_parameter)channel);
    // Temperature counts from a cold value that is taken on entering service.
    if (channel == DQW_WATCH_TEMPERATURE && m->healthy.cold_R_q24 <= 0) return r;
    dqw_monitor_channel_q15 x;
    dqw_monitor_read_channel_q15(m, (int)channel, &x);
    r.value_q40 = dqw_monitor_q40_of((int)channel, x.now);
    r.sd_q40 = r.sd_change_q40 = dqw_monitor_q40_of((int)channel, x.sd);
#if DQW_MAP_WEIGHTS > 0
    if ((int)channel < DQW_WATCH_OFFSET && x.sd != INT32_MAX) {
        int64_t value_q40[DQW_MAP_WEIGHTS];
        int64_t sd_q40[DQW_MAP_WEIGHTS];
        (void)dqw_estimator_read_effect_q15(&m->estimator, 0, value_q40, sd_q40);
        r.sd_q40 = sd_q40[channel - DQW_WATCH_MAP_D];
        x.sd = dqw_q31_sat(dqw_q_scale64(r.sd_q40, -16));
    }
#endif
    r.usable = (int64_t)x.sd * USABLE_PARTS < dqw_q_size64(x.now);
    return r;
}

static bool is_asked_for(const dqw_monitor_q15 *m, int channel)
{
    const dqw_estimator_q15 *e = &m->estimator;
    if (channel == DQW_WATCH_DEAD_TIME) return dqw_estimator_has_dead_time_q15(e);
    if (channel == DQW_WATCH_ANGLE) return dqw_estimator_has_psi_q_q15(e);
    if (dqw_watch_is_map(channel)) return dqw_estimator_has_map_q15(e);
    if (channel == DQW_WATCH_FRICTION) return m->config->J_nkgm2 > 0;
    return channel < DQW_WATCH_OFFSET || channel > DQW_WATCH_FRICTION || e->config->angle;
}

bool dqw_monitor_knows_heat_q15(const dqw_monitor_q15 *m)
{
    // Until its healthy value has settled, what is cold goes with R.
    const bool has_cold = m->config->commissioned || m->watch.looks[DQW_WATCH_R] >= DQW_WATCH_LOOKS_LEAST;
    const int64_t sd_q24 = dqw_estimator_read_q15(&m->estimator, DQW_R).sd_q40 >> 16;
    return has_cold && sd_q24 < dqw_monitor_band_of_q15(m, DQW_WATCH_R);
}

// More than any fault makes of it.
static int64_t too_much(const dqw_monitor_q15 *m, int channel)
{
    if (dqw_watch_is_part(channel)) return dqw_q_size64(m->healthy.weight_q24[channel]) * COARSE_TENTHS / 10;
    return (int64_t)dqw_monitor_band_of_q15(m, channel) * BAND_PPM[channel] * COARSE_BANDS /
           dqw_monitor_or_else(m->config->band_ppm[channel], BAND_PPM[channel]);
}

// A ripple over what its own input has of it after so many memories: resistance and reactance share it while the speed
// stays, those and shorted turns while the current does. (E178)
static int32_t shared_q24(const dqw_monitor_q15 *m, int channel)
{
    if (channel <= DQW_WATCH_OFFSET || channel >= DQW_WATCH_FRICTION) return 1 << 24;
    const dqw_moments_q15 *s = &m->estimator.segment.ever[channel == DQW_WATCH_SHORT ? 1 : 0];
    const int64_t mean = dqw_q_floor64((int64_t)s->mean_q30 * s->mean_q30, 29);
    const int64_t like_q48 = dqw_q_quotient64(mean, mean + s->variance_q31, 48);
    const int64_t apart_q24 = APART_MEMORIES * ((1 << 24) - (int64_t)dqw_q_root64((uint64_t)like_q48));
    return dqw_q_quotient32((1 << 24) + apart_q24, (1 << 23) + apart_q24, 24);
}

// Why not, and where it is watched the smallest change that would be an event; INT64_MAX else.
static enum dqw_why sees(const dqw_monitor_q15 *m, int channel, int64_t *least)
{
    const dqw_estimator_q15 *e = &m->estimator;
    *least = INT64_MAX;
    // [CHN.3] what the configuration asks for, and while anything is watched
    if ((unsigned)channel >= DQW_WATCH_CHANNELS || !is_asked_for(m, channel)) return DQW_WHY_NOT_ASKED;
    const enum dqw_why nothing = dqw_monitor_why_q15(m);
    if (nothing != DQW_WHY_IN_SERVICE) return nothing;
    if (channel == DQW_WATCH_RESIDUAL) {
        *least = dqw_monitor_q40_of(channel, dqw_monitor_residual_limit_q24(m));
        return DQW_WHY_IN_SERVICE;
    }

    // [CHN.4] what the motion teaches, and makes sense
    const int weight = channel == DQW_WATCH_TEMPERATURE ? (int)DQW_R
                       : channel < DQW_WATCH_OFFSET     ? dqw_watch_weight(channel)
                                                        : channel;
    dqw_monitor_channel_q15 x;
    dqw_monitor_read_channel_q15(m, channel, &x);
    const bool by_weight = channel < DQW_WATCH_OFFSET || channel == DQW_WATCH_TEMPERATURE;
    const bool moves = !by_weight || e->excess_q10[weight] > 0;
    if (!moves || x.sd == INT32_MAX) return DQW_WHY_NOT_TAUGHT;
    if (by_weight && weight <= DQW_PSI && e->w_q24[weight] <= 0) return DQW_WHY_SIGN;
    if (channel == DQW_WATCH_LQ && m->config->estimator.observed) return DQW_WHY_OBSERVED;

    // [CHN.5] what is known well enough: a temperature where R is to its band
    if (channel == DQW_WATCH_TEMPERATURE) {
        if (!dqw_monitor_knows_heat_q15(m)) return DQW_WHY_UNSETTLED;
        const int64_t sd_q24 = dqw_estimator_read_q15(e, DQW_R).sd_change_q40 >> 16;
        *least = dqw_monitor_band_q24(m, channel) * 65536 +
                 dqw_monitor_q40_of(channel, kelvin_q16(m, sd_q24 * ONE_SIDED_PARTS / 100));
        return DQW_WHY_IN_SERVICE;
    }
    if (m->watch.looks[channel] < DQW_WATCH_LOOKS_LEAST) return DQW_WHY_UNSETTLED;

    // [CHN.6] what segments tell as well, and an opening leaves unsure; and what is too much
    const bool followed = channel < DQW_WATCH_OFFSET && m->config->estimator.follow;
    const uint16_t since = e->segment.since < OPENED ? e->segment.since : OPENED;
    if (followed) x.sd = counted_q24(m, channel, dqw_estimator_sd_since_q24(e, weight, since));
    int64_t sure = dqw_monitor_surely_q15(m, channel, x.sd) * 65536;
    if (followed) {
        const int32_t seen_q28 = dqw_segment_sees_q15(&e->segment, weight);
        if (seen_q28 == INT32_MAX) return e->segment.segments == 0 ? DQW_WHY_UNSETTLED : DQW_WHY_NOT_TAUGHT;
        const int64_t seen = (int64_t)counted_q24(m, channel, seen_q28) * 4096;
        sure = seen > sure ? seen : sure;
    }
    // A change a quarter larger is told: in twenty looks (E63), and by two segments in 95 of 100 (E105). (E178)
    *least = dqw_q_times64(sure + sure / 4, shared_q24(m, channel), -24);
    if (channel == DQW_WATCH_R || channel == DQW_WATCH_PSI)
        *least += (int64_t)dqw_monitor_heat_since_q24(m, channel) * 65536;
    return sure / 65536 < too_much(m, channel) ? DQW_WHY_IN_SERVICE : DQW_WHY_COARSE;
}

enum dqw_why dqw_monitor_unwatched_q15(const dqw_monitor_q15 *m, enum dqw_monitor_channel channel)
{
    int64_t least;
    return sees(m, (int)channel, &least);
}

int64_t dqw_monitor_sensitivity_q15(const dqw_monitor_q15 *m, enum dqw_monitor_channel channel)
{
    int64_t least;
    (void)sees(m, (int)channel, &least);
    return least;
}
