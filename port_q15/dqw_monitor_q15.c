#include "dqw_monitor_q15.h"

#include <stddef.h>

#include "dqw_estimator_block_q15.h"
#include "dqw_fault_kind.h"
#include "dqw_monitor_channel_q15.h"
#include "dqw_q15.h"

// A healthy value is learned while its deviation is within this part of its band. A wider one does where looks are soon
// unlike, so that their mean is better than each, as in dqw_monitor.c: 0.2, flux 0.4, witness 0.5.
#define KNOWN_PART_Q15 6554
#define KNOWN_PART_FLUX_Q15 13107
#define KNOWN_PART_WITNESS_Q15 16384
// Known to 1.5 bands it shows what any fault may make of it: five deviations, with the healthy value's, are ten.
#define KNOWN_BANDS_Q15 49152
// The winding's highest rise is forgotten by half in about twenty minutes of looks every 16 ms: a part of 1e-5.
#define HOTTEST_FORGETS 100000
// A parameter is known well enough for service, so many deviations from nought; beside an observer's angle, whose lean
// its deviation holds whole (E106).
#define SERVICE_PARTS 10
#define SERVICE_PARTS_OBSERVED 5
// Confidence of what needs no pattern: 0.99.
#define SURE_Q15 32440
// A pattern of less confidence is no name while the residual is above the threshold, and is waited for elsewhere.
#define SURE_ENOUGH_Q15 26214
// And one of less than that is none at all: about two to one.
#define SURE_LEAST_Q15 21299
// A change is named within so many looks of being found; bands are known after so many segments.
#define OPENED_LOOKS 64u
// What shows waits so long for a segment of its own, and a weight that was found changed settles for so many looks.
#define WAITS_NS 5000000000u
#define OPENED_SETTLES 16u
#define YOUNG_SEGMENTS 20u
// While hardly any were met, a speed that steps for the first time makes any residual.
#define NEW_SEGMENTS 3u
// Until healthy values stand.
#define FEW_SEGMENTS_OBSERVED 5u
// Of a change a weight shows so much at least, for its share is a divisor: 0.05.
#define SHARE_LEAST_Q24 838861
#define TEMPERATURE_BAND_K 5
// Part of the full speed above which a direction is one: a fifteenth, a full scale being half as much again as a rated
// value.
#define SLOWEST_Q28 17895697
#define FLOOR_PPM 2000u
#define PARTS_MOST 1000000u
// Of what is rated: dead time's, offset's and friction's band, threshold, floor and excitation where a full scale is
// half as much again.
#define RATED_DEAD_TIME_PPM 3333u
#define RATED_OFFSET_PPM 6667u
#define RATED_FRICTION_PPM 33333u
#define RATED_THRESHOLD_PPM 33333u
#define RATED_FLOOR_PPM 1333u
#define RATED_EXCITATION_Q15 218u
#define ONE_Q16 65536
#define ONE_Q24 16777216
#define MILLION 1000000

dqw_monitor_q15_config dqw_monitor_config_default_q15(const dqw_nameplate_q15 *plate)
{
    dqw_monitor_q15_config c = {.J_nkgm2 = 0};
    c.estimator = dqw_estimator_config_default_q15(plate);
    c.estimator.threshold_ppm = RATED_THRESHOLD_PPM;
    c.estimator.excitation_q15 = RATED_EXCITATION_Q15;
    c.band_ppm[DQW_WATCH_DEAD_TIME] = RATED_DEAD_TIME_PPM;
    c.band_ppm[DQW_WATCH_OFFSET] = RATED_OFFSET_PPM;
    c.band_ppm[DQW_WATCH_FRICTION] = RATED_FRICTION_PPM;
    c.residual_floor_ppm = RATED_FLOOR_PPM;
    return c;
}

static enum dqw_status check(const dqw_monitor_q15 *m, const dqw_monitor_q15_config *c)
{
    if (m == NULL || c == NULL) return DQW_ERR_NULL;
    if (c->alpha_ppm_per_K > PARTS_MOST) return DQW_ERR_ALPHA;
    if (c->beta_ppm_per_K > PARTS_MOST) return DQW_ERR_BETA;
    if (c->heating_mK_s > PARTS_MOST) return DQW_ERR_HEATING;
    if (c->residual_floor_ppm > PARTS_MOST) return DQW_ERR_RESIDUAL_FLOOR;
    if (c->estimator.scale.pole_pairs == 0) return DQW_ERR_POLE_PAIRS;
    if (c->commissioned && c->estimator.R_uohm == 0) return DQW_ERR_R;
    return c->commissioned && c->estimator.psi_nWb == 0 ? DQW_ERR_PSI : DQW_OK;
}

// In place, once nothing can be refused any more: a small core's stack has no room for a second one.
static void begin(dqw_monitor_q15 *m, const dqw_monitor_q15_config *config)
{
    unsigned char *bytes = (unsigned char *)(void *)m;
    for (size_t i = 0; i < offsetof(dqw_monitor_q15, estimator); i++) bytes[i] = 0;
    m->config = config;
}

enum dqw_status dqw_monitor_init_q15(dqw_monitor_q15 *m, const dqw_monitor_q15_config *config)
{
    enum dqw_status status = check(m, config);
    if (status == DQW_OK) status = dqw_estimator_init_q15(&m->estimator, &config->estimator);
    if (status == DQW_OK) begin(m, config);
    return status;
}

enum dqw_status dqw_monitor_define_q15(dqw_monitor_q15 *m, const dqw_monitor_q15_config *config)
{
    enum dqw_status status = check(m, config);
    if (status == DQW_OK) status = dqw_estimator_define_q15(&m->estimator, &config->estimator);
    if (status == DQW_OK) begin(m, config);
    return status;
}

enum dqw_stage_name dqw_monitor_stage_q15(const dqw_monitor_q15 *m)
{
    return m->estimator.stage.name;
}

uint32_t dqw_monitor_sample_q15(dqw_monitor_q15 *m, const dqw_sample_q15 *s, bool saturated)
{
    return dqw_estimator_sample_q15(&m->estimator, s, saturated);
}

void dqw_monitor_missing_q15(dqw_monitor_q15 *m, uint32_t periods)
{
    dqw_estimator_missing_q15(&m->estimator, periods);
}

static int32_t value(const dqw_monitor_q15 *m, int weight)
{
    return m->estimator.w_q24[weight];
}

static int32_t sd(const dqw_monitor_q15 *m, int weight)
{
    return dqw_estimator_sd_q24(&m->estimator, weight);
}

// Half the difference of two stretches' mean torque, one in each direction, is friction: a load is the same on both
// sides of a reversal, or its change has no sign.
static void reversal(dqw_monitor_q15 *m, int way, int32_t torque_q24)
{
    if (dqw_watch_reversal(&m->watch, way)) {
        const int64_t half = dqw_q_round64(way * ((int64_t)torque_q24 - m->before_q24), 1);
        const int32_t off = dqw_q31_sat(half - m->friction_q24);
        const int n = m->watch.reversals;
        m->friction_q24 = dqw_q31_sat((int64_t)m->friction_q24 + off / n);
        // The first is no spread: nothing was known.
        if (n > 1) m->spread_q48 += dqw_q_quotient64((int64_t)off * off - m->spread_q48, n, 0);
    }
    m->before_q24 = torque_q24;
}

// What the full speed, gained in half a window, takes: of the torque at nominal flux and full current. J w / (1.5 p psi
// i dt half), Q24
static int64_t accelerating_q24(const dqw_estimator_q15_config *c, const dqw_units_q15 *u, uint32_t J_nkgm2, int half)
{
    const dqw_scale *s = &c->scale;
    // 1e-12 over 1e-12, in seconds; then over 1.5e-9. Up to 2^56 each, and 2^56; each stops at 2^62, and no drive comes
    // near
    const int64_t part_q30 = dqw_q_quotient64((int64_t)J_nkgm2 * s->w_full_mrad_s,
                                              (int64_t)u->si[DQW_PSI] * s->i_full_mA, 30);
    const int64_t per_ns_q54 = dqw_q_quotient64(part_q30, (int64_t)s->dt_ns * half * 3 * s->pole_pairs, 24);
    return dqw_q_quotient64(dqw_q_times64(per_ns_q54, 2000000000, -30), c->speed_electrical ? s->pole_pairs : 1, 0);
}

static void watch_friction(dqw_monitor_q15 *m, const dqw_estimator_q15_block *block, bool unbroken)
{
    const dqw_estimator_q15 *t = &m->estimator;
    const uint32_t J_nkgm2 = m->config->J_nkgm2;
    const dqw_block_q15 b = dqw_estimator_means_q15(block);
    dqw_units_q15 n;
    (void)dqw_units_of_q15(t->config, t->pole_pairs, &n);
    const int64_t Ld = dqw_q_times64(dqw_q_quotient64(n.X_q40[0], n.psi_q40, 24), value(m, DQW_LD), -24);
    const int64_t Lq = dqw_q_times64(dqw_q_quotient64(n.X_q40[1], n.psi_q40, 24), value(m, DQW_LQ), -24);
    const int64_t flux_q24 = value(m, DQW_PSI) + dqw_q_times64(Ld - Lq, b.i_d, -28);
    const int64_t faster_q24 = dqw_q_product64(accelerating_q24(t->config, &n, J_nkgm2, t->window.half),
                                               (int64_t)b.w_m - m->w_before_q28, -28);
    const int32_t used_q24 = dqw_q31_sat(dqw_q_times64(flux_q24, b.i_q, -28) - faster_q24);
    m->w_before_q28 = b.w_m;
    const int way = b.w_m > SLOWEST_Q28 ? 1 : b.w_m < -SLOWEST_Q28 ? -1 : 0;
    // A torque of 128 times the nominal one is none.
    const bool fits = used_q24 < INT32_MAX && used_q24 > -INT32_MAX;
    const int gathered = dqw_watch_stretch(&m->watch, fits ? way : 0, unbroken);
    const int32_t part_q24 = used_q24 / DQW_WATCH_STRETCH_BLOCKS;
    m->gathered_q24 = gathered > 1 ? m->gathered_q24 + part_q24 : part_q24;
    if (gathered == DQW_WATCH_STRETCH_BLOCKS) reversal(m, way, m->gathered_q24);
}

static bool within_part(int32_t deviation, int32_t part_q15, int32_t band)
{
    return deviation != INT32_MAX && (int64_t)deviation * 32768 < (int64_t)part_q15 * band;
}

// Where a temperature counts from, after what has broken, or is known better.
static void recount(int32_t *cold, int32_t now, int32_t healthy)
{
    *cold = dqw_q_times32(dqw_q_quotient64(now, healthy, 24), *cold, -24);
}

static void adopt(dqw_monitor_q15 *m)
{
    for (int i = 0; i < DQW_WATCH_TEMPERATURE; i++) dqw_monitor_move_healthy_q15(m, i, 1);
    const int64_t floor_q27 = dqw_q_quotient64(dqw_monitor_or_else(m->config->residual_floor_ppm, FLOOR_PPM), MILLION,
                                               27);
    const int64_t floor_q54 = floor_q27 * floor_q27;  // up to 2^54
    m->healthy.residual_q54 = m->estimator.recent_q54 > floor_q54 ? m->estimator.recent_q54 : floor_q54;
    dqw_watch_adopt(&m->watch, m->estimator.number);
}

// R or flux as measured, as far as heat can have made it since its healthy value last followed, and `more`.
static int32_t heated(const dqw_monitor_q15 *m, int channel, int32_t more)
{
    const int64_t bound = (int64_t)dqw_monitor_heat_since_q24(m, channel) + more;
    const int32_t from = m->healthy.weight_q24[channel];
    const int64_t off = (int64_t)value(m, channel) - from;
    return from + (int32_t)(off > bound ? bound : off < -bound ? -bound : off);
}

// Healthy R or flux goes with the measured one, no faster than heat can. Not while the measured one is unsure: it would
// follow noise.
static void follow(dqw_monitor_q15 *m, int channel)
{
    const int32_t part_q15 = channel == DQW_WATCH_PSI ? KNOWN_PART_FLUX_Q15 : KNOWN_PART_Q15;
    if (!within_part(sd(m, channel), part_q15, dqw_monitor_band_of_q15(m, channel))) return;
    m->healthy.weight_q24[channel] = heated(m, channel, 0);
    dqw_watch_follow(&m->watch, channel, m->estimator.number);
}

// The flux no further than the winding's heat explains, now or a while ago.
static void follow_temperature(dqw_monitor_q15 *m)
{
    follow(m, DQW_WATCH_R);
    follow(m, DQW_WATCH_PSI);
    const int32_t rise = dqw_monitor_rise_q16(m, m->healthy.weight_q24[DQW_R]);
    m->healthy.hottest_q16 -= m->healthy.hottest_q16 / HOTTEST_FORGETS;
    if (rise > m->healthy.hottest_q16) m->healthy.hottest_q16 = rise;
    const int32_t coldest = dqw_monitor_of_cold_q24(m->healthy.cold_psi_q24,
                                                    -dqw_monitor_flux_lost_q24(m, m->healthy.hottest_q16));
    if (m->healthy.weight_q24[DQW_PSI] < coldest) m->healthy.weight_q24[DQW_PSI] = coldest;
}

// Size of a channel's change over its band, Q5; 0 where it is not known.
static int32_t deviation_q5(const dqw_monitor_q15 *m, int channel)
{
    const int64_t most = (int64_t)100 * DQW_CHANGE_BAND_Q5;
    int64_t over;
    int64_t width;
    int n = 5;
    if (channel == DQW_WATCH_TEMPERATURE) {
        if (!dqw_monitor_knows_heat_q15(m)) return 0;
        // What is more than a band of R beyond that is R's own change.
        const int32_t R_q24 = heated(m, DQW_WATCH_R, dqw_monitor_band_of_q15(m, DQW_WATCH_R));
        width = (int64_t)TEMPERATURE_BAND_K * ONE_Q16;
        over = dqw_monitor_rise_q16(m, R_q24) - dqw_q_round64(dqw_monitor_band_q24(m, channel), 8) + width;
    } else if (channel == DQW_WATCH_RESIDUAL) {
        over = dqw_q_root64((uint64_t)dqw_q_quotient64(m->estimator.recent_q54, m->healthy.residual_q54, 20));  // Q10
        width = dqw_monitor_band_q24(m, channel);
        n = 19;
    } else {
        dqw_monitor_channel_q15 x;
        dqw_monitor_read_channel_q15(m, channel, &x);
        if (m->watch.looks[channel] < DQW_WATCH_LOOKS_LEAST || x.sd == INT32_MAX) return 0;
        // What heat may have made of it meanwhile is no change.
        const bool heats = channel == DQW_WATCH_R || channel == DQW_WATCH_PSI;
        over = dqw_q_size64(heats ? (int64_t)x.now - heated(m, channel, 0) : x.change);
        width = dqw_monitor_surely_q15(m, channel, x.sd);
    }
    const int64_t q5 = dqw_q_quotient64(over, width, n);
    return (int32_t)(q5 < 0 ? 0 : q5 < most ? q5 : most);
}

// A map's weight where there is no map.
static bool is_apart(const dqw_monitor_q15 *m, int channel)
{
    return dqw_estimator_is_apart_q15(&m->estimator, dqw_watch_weight(channel));
}

static int32_t over(int32_t a, int32_t b_q24)
{
    return a == INT32_MAX ? INT32_MAX : dqw_q_quotient32(a, b_q24, 24);
}

static dqw_fault_verdict_q15 name_it(const dqw_monitor_q15 *m)
{
    int32_t change_q24[DQW_SIGNS];
    int32_t unit_q24[DQW_SIGNS];
    const int32_t *h = m->healthy.weight_q24;
    const dqw_estimator_q15 *e = &m->estimator;
    for (int channel = 0; channel < DQW_WATCH_FRICTION; channel++) {
        dqw_monitor_channel_q15 x;
        dqw_monitor_read_channel_q15(m, channel, &x);
        // A change of a third of a band is none; what is not known, or was not, counts for nothing.
        int32_t least = dqw_q_length32(x.sd, dqw_monitor_band_of_q15(m, channel) / 3);
        if (m->watch.looks[channel] < DQW_WATCH_LOOKS_LEAST) least = INT32_MAX;
        if (channel < DQW_WATCH_OFFSET) {
            int32_t scale = channel == DQW_WATCH_ANGLE       ? h[DQW_PSI]
                            : channel == DQW_WATCH_DEAD_TIME ? ONE_Q24
                                                             : h[channel];
            // Of a change a weight shows what its gain has let it follow since. (E64)
            const int weight = dqw_watch_weight(channel);
            // Two rows a block: Q40 by Q31 of up to 2^39 to Q24
            const int64_t looks_q31 = (int64_t)e->residual.alone_q31[weight] * m->named_looks;
            const int64_t share_q24 = SHARE_LEAST_Q24 + dqw_q_product64(e->cov_q40[weight], looks_q31, -42);
            if (share_q24 < ONE_Q24) scale = dqw_q_times32(share_q24, scale, -24);
            change_q24[channel] = is_apart(m, channel) ? 0 : over(x.change, scale);
            unit_q24[channel] = over(least, scale);
        } else {
            const int k = channel - DQW_WATCH_OFFSET;
            const int at = DQW_SIGN_OFFSET_RE + 2 * k;
            change_q24[at] = dqw_q_floor32(m->witness.re_q28[k], 4) - dqw_q_floor32(m->healthy.re_q28[k], 4);
            change_q24[at + 1] = dqw_q_floor32(m->witness.im_q28[k], 4) - dqw_q_floor32(m->healthy.im_q28[k], 4);
            unit_q24[at] = unit_q24[at + 1] = least;
        }
    }
    // A resistance and a gain share a ripple: at the mean speed it is known whatever their shares. (E177)
    const int32_t speed_q24 = dqw_witness_speed_q24(&m->witness);
    int32_t *ripple_q24 = &change_q24[DQW_SIGN_RESISTANCE_RE];
    const int64_t re = dqw_q_times64(speed_q24, change_q24[DQW_SIGN_REACTANCE_IM], -24);
    const int64_t im = dqw_q_times64(speed_q24, change_q24[DQW_SIGN_REACTANCE_RE], -24);
    ripple_q24[0] = dqw_q31_sat(ripple_q24[0] - re);
    ripple_q24[1] = dqw_q31_sat(ripple_q24[1] + im);
    const dqw_estimator_q15_config *c = m->estimator.config;
    const dqw_fault_machine_q15 machine = {h[DQW_R],
                                           dqw_witness_mean_L_q24(c, h[DQW_LD], h[DQW_LQ]),
                                           dqw_witness_short_q40(c),
                                           speed_q24,
                                           c->observed,
                                           h[DQW_DEAD_TIME]};
    return dqw_fault_name_it_q15(change_q24, unit_q24, machine);
}

static bool above_threshold(const dqw_monitor_q15 *m)
{
    return dqw_estimator_recent_ppm_q15(&m->estimator) > m->estimator.stage.threshold_ppm;
}

// What the healthy value of a channel is; of temperature and residual the limit.
static int32_t healthy_of(const dqw_monitor_q15 *m, int channel)
{
    if (channel < DQW_WATCH_OFFSET) return m->healthy.weight_q24[channel];
    if (channel == DQW_WATCH_FRICTION) return m->healthy.friction_q24;
    if (channel == DQW_WATCH_TEMPERATURE) return dqw_q31_sat(dqw_q_round64(dqw_monitor_band_q24(m, channel), 8));
    if (channel == DQW_WATCH_RESIDUAL) return dqw_monitor_residual_limit_q24(m);
    return dqw_monitor_ripple_q24(m->healthy.re_q28, m->healthy.im_q28, channel);
}

static void name(dqw_monitor_q15 *m, int channel)
{
    dqw_monitor_channel_q15 x;
    dqw_monitor_read_channel_q15(m, channel, &x);
    m->named_value = x.now;
    m->named_sd = x.sd;
    m->named_at = m->estimator.number;
    m->named_looks = dqw_watch_since(&m->watch, channel);
    // A weight that was found changed began to be so in a segment that had passed by then.
    const dqw_residual_q15 *k = &m->estimator.residual;
    const uint32_t found = (m->estimator.number - k->opened_at) / DQW_WATCH_TICK_BLOCKS;
    const uint32_t began = (m->estimator.number - k->opened_since) / DQW_WATCH_TICK_BLOCKS;
    if (k->opened > 0 && found < OPENED_LOOKS && began > m->named_looks)
        m->named_looks = (uint8_t)(began < UINT8_MAX ? began : UINT8_MAX);
    m->named_channel = (uint8_t)channel;
    m->named_healthy = healthy_of(m, channel);
    const enum dqw_fault_name of_channel = dqw_watch_fault_of(channel, x.change > 0);
    const dqw_fault_verdict_q15 sure = {.name = of_channel, .confidence_q15 = SURE_Q15, .phase = 0};
    m->named_fault = of_channel != DQW_FAULT_NONE ? sure : name_it(m);
    // Where the model does not hold at all, a pattern is none that explains no more of what moved, or where the residual
    // has moved by more of its band than any weight.
    if (above_threshold(m) && (channel == DQW_WATCH_RESIDUAL || m->named_fault.confidence_q15 < SURE_ENOUGH_Q15))
        m->named_fault.name = DQW_FAULT_UNKNOWN;
}

static bool is_known(const dqw_monitor_q15 *m, int weight)
{
    const int parts = m->config->estimator.observed ? SERVICE_PARTS_OBSERVED : SERVICE_PARTS;
    return (int64_t)sd(m, weight) * parts < value(m, weight);
}

// Have so many segments ended? Before the first a drive has been seen at one operating point.
static bool has_met(const dqw_monitor_q15 *m, unsigned segments)
{
    return !dqw_estimator_forgets_q15(&m->estimator) || m->estimator.segment.segments >= segments;
}

// Before its healthy value stands. An observer leans at each operating point as it does there; of few and short segments
// a dead time may stand for a resistance.
static unsigned segments_of(const dqw_monitor_q15 *m, int channel)
{
    if (m->config->estimator.observed) return FEW_SEGMENTS_OBSERVED;
    return channel == DQW_WATCH_DEAD_TIME ? NEW_SEGMENTS : 1u;
}

// A healthy value is the mean over the first looks at which it is known, as long as nothing seems to change.
static void settle(dqw_monitor_q15 *m, int channel)
{
    if (channel == DQW_WATCH_FRICTION) {
        if (dqw_watch_friction_settles(&m->watch)) dqw_monitor_move_healthy_q15(m, channel, 1);
        return;
    }
    const int32_t part_q15 = channel >= DQW_WATCH_OFFSET ? KNOWN_PART_WITNESS_Q15
                             : channel == DQW_WATCH_PSI  ? KNOWN_PART_FLUX_Q15
                                                         : KNOWN_PART_Q15;
    dqw_monitor_channel_q15 x;
    dqw_monitor_read_channel_q15(m, channel, &x);
    const int32_t band = dqw_monitor_band_of_q15(m, channel);
    // Known less well it is watched with a band of five deviations, and its healthy value goes on being learned. Nothing
    // is known within the first segment, at whose operating point weights may stand for one another.
    const bool young = !has_met(m, segments_of(m, channel));
    enum dqw_watch_known known = DQW_WATCH_NOT_KNOWN;
    if (!young && within_part(x.sd, KNOWN_BANDS_Q15, band)) known = DQW_WATCH_KNOWN;
    if (!young && within_part(x.sd, part_q15, band)) known = DQW_WATCH_KNOWN_WELL;
    const uint8_t looks = dqw_watch_settle(&m->watch, channel, known, deviation_q5(m, channel));
    if (looks == 0) return;
    const int32_t before = m->healthy.weight_q24[channel <= DQW_WATCH_PSI ? channel : 0];
    dqw_monitor_move_healthy_q15(m, channel, looks);
    // What temperatures count from was no surer than that.
    if (looks > DQW_WATCH_LOOKS_LEAST || m->config->commissioned) return;
    if (channel == DQW_WATCH_R) recount(&m->healthy.cold_R_q24, m->healthy.weight_q24[channel], before);
    if (channel == DQW_WATCH_PSI) recount(&m->healthy.cold_psi_q24, m->healthy.weight_q24[channel], before);
}

// The healthy residual is the largest one that driving made: no faster than by a tenth of its power in a look while few
// operating points were met, and a two-hundredth later, or a fault would be taken in.
static void follow_residual(dqw_monitor_q15 *m)
{
    const dqw_estimator_q15 *e = &m->estimator;
    if (!e->config->follow) return;
    const int64_t healthy = m->healthy.residual_q54;
    const int64_t most = e->segment.segments < NEW_SEGMENTS
                             ? INT64_MAX
                             : healthy + healthy / (e->segment.segments < YOUNG_SEGMENTS ? 10 : 200);
    if (e->recent_q54 > healthy) m->healthy.residual_q54 = e->recent_q54 < most ? e->recent_q54 : most;
}

// What has just begun to show is judged by a segment of its own: a weight that moved along one operating point may be
// any. (E105)
static void hasten(dqw_monitor_q15 *m)
{
    dqw_segment_q15 *s = &m->estimator.segment;
    const bool urgent = dqw_watch_wants_a_segment(&m->watch) && m->config->estimator.follow;
    if (urgent && !s->urgent) {
        dqw_segment_restart_q15(s);
        m->alarmed_segments = s->segments;
    }
    s->urgent = urgent;
}

// Has that segment not ended, or a weight only just been found changed?
static bool is_early(const dqw_monitor_q15 *m)
{
    const dqw_estimator_q15 *e = &m->estimator;
    const bool waits = e->segment.urgent && e->segment.segments == m->alarmed_segments &&
                       (uint64_t)e->segment.blocks * e->window.half * e->config->scale.dt_ns < WAITS_NS;
    return waits ||
           (e->residual.opened > 0 && e->number - e->residual.opened_at < OPENED_SETTLES * DQW_WATCH_TICK_BLOCKS);
}

// `witnessed`: the last block taught ripples as well.
static bool look(dqw_monitor_q15 *m, bool witnessed)
{
    hasten(m);
    const enum dqw_watch_begins begins = dqw_watch_begin(&m->watch);
    if (begins == DQW_WATCH_PAUSES) return false;
    if (begins == DQW_WATCH_ADOPTS) {
        adopt(m);
        return false;
    }
    if (begins == DQW_WATCH_SETTLES) {
        follow_temperature(m);
        follow_residual(m);
        // A ripple that the motion does not teach stands still: looks at it are no more than one. And what weights
        // that do not stand yet leave is none.
        if (m->watch.looks[DQW_WATCH_R] < DQW_WATCH_LOOKS_LEAST) witnessed = false;
        for (int i = 0; i < DQW_WATCH_TEMPERATURE; i++) {
            if (i == DQW_WATCH_OFFSET && !witnessed) i = DQW_WATCH_FRICTION;
            settle(m, i);
        }
    }
    int32_t q5[DQW_WATCH_CHANNELS];
    for (int i = 0; i < DQW_WATCH_CHANNELS; i++) q5[i] = deviation_q5(m, i);
    if (!dqw_watch_look(&m->watch, q5)) return false;
    if (is_early(m)) {
        dqw_watch_later(&m->watch);
        return false;
    }
    const int worst = dqw_watch_worst(&m->watch, q5, above_threshold(m));
    if (worst < 0) return false;
    name(m, worst);
    const bool sure = m->named_fault.confidence_q15 >= SURE_ENOUGH_Q15;
    const enum dqw_watch_follows follows = dqw_watch_named(&m->watch, worst, m->named_fault.name, sure);
    if (follows == DQW_WATCH_LATER) return false;
    if (m->named_fault.confidence_q15 < SURE_LEAST_Q15) m->named_fault.name = DQW_FAULT_UNKNOWN;
    if (follows == DQW_WATCH_APART) {
        if (worst == DQW_WATCH_FRICTION) dqw_monitor_move_healthy_q15(m, worst, 1);
        return true;
    }
    // Temperatures go on counting from where they were: what has broken is not what has heated.
    if (dqw_fault_moves_R(m->named_fault.name))
        recount(&m->healthy.cold_R_q24, value(m, DQW_R), m->healthy.weight_q24[DQW_R]);
    recount(&m->healthy.cold_psi_q24, value(m, DQW_PSI), m->healthy.weight_q24[DQW_PSI]);
    adopt(m);
    dqw_watch_rest(&m->watch);
    return true;
}

static void enter_service(dqw_monitor_q15 *m)
{
    dqw_watch_enter(&m->watch);
    if (m->restored) {
        dqw_monitor_enter_as_stored_q15(m);
        return;
    }
    const bool commissioned = m->config->commissioned;
    dqw_units_q15 u;
    (void)dqw_units_of_q15(m->estimator.config, m->estimator.pole_pairs, &u);
    m->healthy.cold_R_q24 = commissioned ? u.w_q24[DQW_R] : value(m, DQW_R);
    m->healthy.cold_psi_q24 = commissioned ? u.w_q24[DQW_PSI] : value(m, DQW_PSI);
    m->healthy.hottest_q16 = 0;
    // Healthy values settle at once: what begins to grow in a rest would be taken in.
    adopt(m);
}

// L_d shows only where i_d is not 0: without it the other three are watched. A frame that is about to turn (E102) moves
// them all. Where the model did not hold a standstill's residual says nothing: there one segment is waited for.
static bool known(const dqw_monitor_q15 *m)
{
    const bool frame = m->estimator.across == 0;
    const bool holds = m->estimator.stage.times_back == 0 || has_met(m, 1);
    return frame && holds && is_known(m, DQW_R) && is_known(m, DQW_LQ) && is_known(m, DQW_PSI);
}

static void stage(dqw_monitor_q15 *m)
{
    const dqw_stage *s = &m->estimator.stage;
    const enum dqw_stage_name before = s->name;
    if (before == DQW_STAGE_IN_SERVICE) {
        // A residual above the threshold is named first: a sudden fault is one too. Not while an observer may still
        // find its angle.
        const bool above = above_threshold(m);
        const bool finds = m->config->estimator.observed && !has_met(m, FEW_SEGMENTS_OBSERVED);
        if (above && finds) m->watch.back = true;
        if (above && !finds) dqw_watch_alarm_residual(&m->watch);
        if (m->watch.back) dqw_estimator_stage_on_q15(&m->estimator, true);
        m->watch.back = false;
        return;
    }
    if (before == DQW_STAGE_ORDINAL && !above_threshold(m) && !known(m)) return;
    dqw_estimator_stage_on_q15(&m->estimator, true);
    if (s->name == DQW_STAGE_IN_SERVICE) enter_service(m);
}

bool dqw_monitor_background_q15(dqw_monitor_q15 *m)
{
    dqw_estimator_q15 *e = &m->estimator;
    dqw_estimator_q15_block block;
    if (!dqw_estimator_take_q15(e, &block) || e->stage.name == DQW_STAGE_DOMAIN) return false;

    // [MON.1] learn
    const bool judged = e->stage.name != DQW_STAGE_RANDOM;
    const bool learned = dqw_estimator_learn_q15(e, &block);
    if (m->config->J_nkgm2 > 0) watch_friction(m, &block, e->elapsed == 1);
    if (!learned) return false;
    dqw_watch_learned(&m->watch, e->number);

    // [MON.2] the stage; what coarse weights leave is no ripple
    const bool witnessed = judged && dqw_witness_learn_q15(&m->witness, e, &block);
    if (judged) stage(m);
    if (e->stage.name != DQW_STAGE_IN_SERVICE) return false;

    // [MON.3] every so often, a look at every channel
    if (!dqw_watch_block(&m->watch) || !look(m, witnessed)) return false;
    m->has_change = true;
    return true;
}

bool dqw_monitor_event_q15(dqw_monitor_q15 *m, dqw_monitor_change_q15 *change)
{
    if (!m->has_change) return false;
    const uint64_t half = m->estimator.window.half;
    const int channel = m->named_channel;
    change->sample = m->named_at * half;
    change->since = (m->named_at - (uint32_t)m->named_looks * DQW_WATCH_TICK_BLOCKS) * half;
    change->parameter = (enum dqw_monitor_channel)channel;
    change->value_q40 = dqw_monitor_q40_of(channel, m->named_value);
    change->sd_q40 = dqw_monitor_q40_of(channel, m->named_sd);
    change->healthy_q40 = dqw_monitor_q40_of(channel, m->named_healthy);
    change->fault = m->named_fault;
    m->has_change = false;
    return true;
}

enum dqw_why dqw_monitor_why_q15(const dqw_monitor_q15 *m)
{
    const dqw_estimator_q15 *e = &m->estimator;
    const enum dqw_why decided = dqw_watch_why(&m->watch, &e->stage, *(const volatile uint32_t *)&e->halves);
    if (decided != DQW_WHYS) return decided;
    if (e->number == 0) return DQW_WHY_NO_BLOCK;
    // Of the block that was handed over last: one number of 16 bits, whenever it is read.
    if (e->config->noise_on_inputs && e->handed.rows < DQW_NOISE_ROWS) return DQW_WHY_NOISE;
    if (!dqw_watch_excited(e->excess_q10, dqw_estimator_inputs_q15(e))) return DQW_WHY_EXCITATION;
    if (dqw_estimator_seeks_legs_q15(e)) return DQW_WHY_MODULATION;
    const enum dqw_voltage_acts acts = dqw_estimator_voltage_acts_q15(e);
    if (acts != DQW_VOLTAGE_NOT_KNOWN && (acts == DQW_VOLTAGE_NEXT) != e->config->voltage_next) return DQW_WHY_VOLTAGE;
    if (e->stage.name == DQW_STAGE_ORDINAL && above_threshold(m)) return DQW_WHY_RESIDUAL;
    if (!is_known(m, DQW_R)) return DQW_WHY_R;
    if (!is_known(m, DQW_LQ)) return DQW_WHY_LQ;
    return is_known(m, DQW_PSI) ? DQW_WHY_BLOCKS : DQW_WHY_PSI;
}
