#include "dqw_monitor.h"

#include <math.h>
#include <stddef.h>

#include "dqw_estimator_block.h"
#include "dqw_fault.h"
#include "dqw_fault_kind.h"
#include "dqw_monitor_channel.h"
#include "dqw_number.h"
#include "dqw_segment.h"

// A healthy value is learned while its deviation is within this part of its band. A wider one does where looks are soon
// unlike, so that their mean is better than each: the witness forgets in 0.3 s, a weight as heat
// is followed (E105), the flux with its narrow band first.
#define KNOWN_PART 0.2f
#define KNOWN_PART_FLUX 0.4f
#define KNOWN_PART_WITNESS 0.5f
// Known to so many bands it shows what any fault may make of it: five deviations, with the healthy value's, are ten.
#define KNOWN_BANDS 1.5f
// The winding's highest rise is forgotten by half in about twenty minutes of looks every 16 ms.
#define HOTTEST_KEPT 0.99999f
// A parameter is known well enough for service, so many deviations from nought; beside an observer's angle, whose lean
// its deviation holds whole (E106).
#define SERVICE_PARTS 10.0f
#define SERVICE_PARTS_OBSERVED 5.0f
// A residual counts as at least 0.2 % of the base.
#define RESIDUAL_FLOOR_PU2 4e-6f
// Confidence of what needs no pattern.
#define SURE 0.99f
// A pattern of less confidence is no name while the residual is above the threshold, and is waited for elsewhere.
#define SURE_ENOUGH 0.8f
// And one of less than that is none at all: about two to one.
#define SURE_LEAST 0.65f
#define TEMPERATURE_BAND_K 5.0f
// Of a change a weight shows so much at least: its share is a divisor.
#define SHARE_LEAST 0.05f
// Part of the speed base above which a direction is one.
#define SLOWEST_PU 0.1f
// A change is named within so many looks of being found.
#define OPENED_LOOKS 64u
// What shows waits so long for a segment of its own, and a weight that was found changed settles for so many looks.
#define WAITS_S 5.0f
#define OPENED_SETTLES 16u
// By how much the healthy residual's power may rise in a look: while few operating points were met, and later. While
// hardly any were, a speed that steps for the first time makes any.
#define NEW_SEGMENTS 3u
// Until healthy values stand.
#define FEW_SEGMENTS_OBSERVED 5u
#define YOUNG_SEGMENTS 20u
#define RESIDUAL_RISE_NEW 1e4f
#define RESIDUAL_RISE_YOUNG 1.1f
#define RESIDUAL_RISE 1.005f

dqw_monitor_config dqw_monitor_config_default(const dqw_nameplate *plate)
{
    dqw_monitor_config c = {.J_kgm2 = 0.0f};
    c.estimator = dqw_estimator_config_default(plate);
    return c;
}

static enum dqw_status check(const dqw_monitor *m, const dqw_monitor_config *c)
{
    if (m == NULL || c == NULL) return DQW_ERR_NULL;
    const float field[] = {c->alpha_per_K, c->beta_per_K, c->heating_K_s, c->J_kgm2};
    static const int8_t status[] = {DQW_ERR_ALPHA, DQW_ERR_BETA, DQW_ERR_HEATING, DQW_ERR_J};
    for (int i = 0; i < DQW_WATCH_CHANNELS; i++)
        if (!dqw_is_zero_or_positive(c->band[i])) return DQW_ERR_BAND;
    for (unsigned i = 0; i < sizeof field / sizeof field[0]; i++)
        if (!dqw_is_zero_or_positive(field[i])) return (enum dqw_status)status[i];
    if (c->estimator.pole_pairs == 0) return DQW_ERR_POLE_PAIRS;
    if (c->commissioned && !(c->estimator.R_ohm > 0.0f)) return DQW_ERR_R;
    return c->commissioned && !(c->estimator.psi_Wb > 0.0f) ? DQW_ERR_PSI : DQW_OK;
}

// Once nothing can be refused any more: all that stands before the estimator begins anew, in place, for a small core's
// stack has no room for another.
static void begin(dqw_monitor *m, const dqw_monitor_config *config)
{
    unsigned char *bytes = (unsigned char *)(void *)m;
    for (size_t i = 0; i < offsetof(dqw_monitor, estimator); i++) bytes[i] = 0;
    m->config = config;
}

enum dqw_status dqw_monitor_init(dqw_monitor *m, const dqw_monitor_config *config)
{
    enum dqw_status status = check(m, config);
    if (status == DQW_OK) status = dqw_estimator_init(&m->estimator, &config->estimator);
    if (status == DQW_OK) begin(m, config);
    return status;
}

enum dqw_status dqw_monitor_define(dqw_monitor *m, const dqw_monitor_config *config)
{
    enum dqw_status status = check(m, config);
    if (status == DQW_OK) status = dqw_estimator_define(&m->estimator, &config->estimator);
    if (status == DQW_OK) begin(m, config);
    return status;
}

enum dqw_stage_name dqw_monitor_stage(const dqw_monitor *m)
{
    return m->estimator.stage.name;
}

uint32_t dqw_monitor_sample(dqw_monitor *m, const dqw_sample *s, bool saturated)
{
    return dqw_estimator_sample(&m->estimator, s, saturated);
}

void dqw_monitor_missing(dqw_monitor *m, uint32_t periods)
{
    dqw_estimator_missing(&m->estimator, periods);
}

static float value(const dqw_monitor *m, int weight)
{
    return dqw_estimator_value(&m->estimator, weight);
}

static float sd(const dqw_monitor *m, int weight)
{
    return dqw_estimator_sd(&m->estimator, weight);
}

// Half the difference of two stretches' mean torque, one in each direction, is friction: a load is the same on both
// sides of a reversal, or its change has no sign.
static void reversal(dqw_monitor *m, int way, float torque_Nm)
{
    if (dqw_watch_reversal(&m->watch, way)) {
        const float off = 0.5f * (float)way * (torque_Nm - m->before_Nm) - m->friction_Nm;
        const float part = 1.0f / (float)m->watch.reversals;
        m->friction_Nm += off * part;
        // The first is no spread: nothing was known.
        if (m->watch.reversals > 1) m->spread_Nm2 += (off * off - m->spread_Nm2) * part;
    }
    m->before_Nm = torque_Nm;
}

static void watch_friction(dqw_monitor *m, const dqw_estimator_block *block, bool unbroken)
{
    const dqw_estimator *e = &m->estimator;
    const dqw_estimator_config *c = e->config;
    const dqw_block b = dqw_estimator_means(e, block);
    const float w = b.w_m_rad_s;
    const float torque = 1.5f * (float)c->pole_pairs * b.i_q_A *
                         (value(m, DQW_PSI) + (value(m, DQW_LD) - value(m, DQW_LQ)) * b.i_d_A);
    const float used = torque - m->config->J_kgm2 * (w - m->w_before_rad_s) / (c->dt_s * (float)e->window.half);
    m->w_before_rad_s = w;
    const int way = w > SLOWEST_PU * c->w_base_rad_s ? 1 : w < -SLOWEST_PU * c->w_base_rad_s ? -1 : 0;
    const int gathered = dqw_watch_stretch(&m->watch, dqw_within(used, 1e6f) ? way : 0, unbroken);
    m->gathered_Nm = gathered > 1 ? m->gathered_Nm + used : used;
    if (gathered == DQW_WATCH_STRETCH_BLOCKS)
        reversal(m, way, m->gathered_Nm * (1.0f / (float)DQW_WATCH_STRETCH_BLOCKS));
}

static void adopt(dqw_monitor *m)
{
    for (int i = 0; i < DQW_WATCH_TEMPERATURE; i++) dqw_monitor_move_healthy(m, i, 0.0f);
    m->healthy.residual_pu2 = m->estimator.recent_pu2 > RESIDUAL_FLOOR_PU2 ? m->estimator.recent_pu2
                                                                           : RESIDUAL_FLOOR_PU2;
    dqw_watch_adopt(&m->watch, m->estimator.number);
}

// R or flux as measured, as far as heat can have made it since its healthy value last followed, and `more`.
static float heated(const dqw_monitor *m, int channel, float more)
{
    const float bound = dqw_monitor_heat_since(m, channel) + more;
    const float from = m->healthy.weight[channel];
    const float off = value(m, channel) - from;
    return from + (off > bound ? bound : off < -bound ? -bound : off);
}

// Of its band, a channel's deviation that is known well.
static float known_part(int channel)
{
    return channel >= DQW_WATCH_OFFSET ? KNOWN_PART_WITNESS : channel == DQW_WATCH_PSI ? KNOWN_PART_FLUX : KNOWN_PART;
}

// Healthy R or flux goes with the measured one, no faster than heat can. Not while the measured one is unsure: it would
// follow noise.
static void follow(dqw_monitor *m, int channel)
{
    if (!(sd(m, channel) < known_part(channel) * dqw_monitor_band_of(m, channel))) return;
    m->healthy.weight[channel] = heated(m, channel, 0.0f);
    dqw_watch_follow(&m->watch, channel, m->estimator.number);
}

// The flux no further than the winding's heat explains, now or a while ago.
static void follow_temperature(dqw_monitor *m)
{
    const float beta = dqw_monitor_beta(m);
    follow(m, DQW_WATCH_R);
    follow(m, DQW_WATCH_PSI);
    const float rise = dqw_monitor_rise_K(m, m->healthy.weight[DQW_R]);
    m->healthy.hottest_K *= HOTTEST_KEPT;
    if (rise > m->healthy.hottest_K) m->healthy.hottest_K = rise;
    const float coldest = m->healthy.cold_psi_Wb * (1.0f - DQW_MONITOR_SLACK * beta * m->healthy.hottest_K -
                                                    0.5f * dqw_monitor_band(m, DQW_WATCH_PSI));
    if (m->healthy.weight[DQW_PSI] < coldest) m->healthy.weight[DQW_PSI] = coldest;
}

// Size of a channel's change over its band, Q5; 0 where it is not known.
static int32_t deviation_q5(const dqw_monitor *m, int channel)
{
    float ratio;
    if (channel == DQW_WATCH_TEMPERATURE) {
        if (!dqw_monitor_knows_heat(m)) return 0;
        // What is more than a band of R beyond that is R's own change.
        const float R_ohm = heated(m, DQW_WATCH_R, dqw_monitor_band_of(m, DQW_WATCH_R));
        ratio = (dqw_monitor_rise_K(m, R_ohm) - dqw_monitor_band(m, DQW_WATCH_TEMPERATURE)) / TEMPERATURE_BAND_K + 1.0f;
    } else if (channel == DQW_WATCH_RESIDUAL) {
        ratio = sqrtf(m->estimator.recent_pu2 / m->healthy.residual_pu2) / dqw_monitor_band(m, DQW_WATCH_RESIDUAL);
    } else {
        dqw_monitor_channel_value x;
        dqw_monitor_read_channel(m, channel, &x);
        // What heat may have made of it meanwhile is no change.
        const bool heats = channel == DQW_WATCH_R || channel == DQW_WATCH_PSI;
        const float sure = dqw_monitor_surely(m, channel, x.sd);
        ratio = m->watch.looks[channel] < DQW_WATCH_LOOKS_LEAST || !(sure < DQW_UNKNOWN)
                    ? 0.0f
                    : fabsf(heats ? x.now - heated(m, channel, 0.0f) : x.change) / sure;
    }
    // What is no number counts as nothing.
    return dqw_is_positive(ratio) ? (int32_t)((ratio < 100.0f ? ratio : 100.0f) * (float)DQW_CHANGE_BAND_Q5) : 0;
}

// A map's weight where there is no map.
static bool is_apart(const dqw_monitor *m, int channel)
{
    return dqw_estimator_is_apart(&m->estimator, dqw_watch_weight(channel));
}

static bool is_known(const dqw_monitor *m, int weight)
{
    const float parts = m->config->estimator.observed ? SERVICE_PARTS_OBSERVED : SERVICE_PARTS;
    return sd(m, weight) * parts < value(m, weight);
}

// Have so many segments ended? Before the first a drive has been seen at one operating point.
static bool has_met(const dqw_monitor *m, unsigned segments)
{
    return !dqw_estimator_forgets(&m->estimator) || m->estimator.segment.segments >= segments;
}

// Before its healthy value stands. An observer leans at each operating point as it does there; of few and short segments
// a dead time may stand for a resistance.
static unsigned segments_of(const dqw_monitor *m, int channel)
{
    if (m->config->estimator.observed) return FEW_SEGMENTS_OBSERVED;
    return channel == DQW_WATCH_DEAD_TIME ? NEW_SEGMENTS : 1u;
}

// A healthy value is the mean over the first looks at which it is known, as long as nothing seems to change.
static void settle(dqw_monitor *m, int channel)
{
    if (channel == DQW_WATCH_FRICTION) {
        if (dqw_watch_friction_settles(&m->watch)) dqw_monitor_move_healthy(m, channel, 0.0f);
        return;
    }
    dqw_monitor_channel_value x;
    dqw_monitor_read_channel(m, channel, &x);
    const float band = dqw_monitor_band_of(m, channel);
    // Known less well it is watched with a band of five deviations, and its healthy value goes on being learned. Nothing
    // is known within the first segment, at whose operating point weights may stand for one another.
    const enum dqw_watch_known known = !has_met(m, segments_of(m, channel)) || !(x.sd < KNOWN_BANDS * band)
                                           ? DQW_WATCH_NOT_KNOWN
                                       : x.sd < known_part(channel) * band ? DQW_WATCH_KNOWN_WELL
                                                                           : DQW_WATCH_KNOWN;
    const uint8_t looks = dqw_watch_settle(&m->watch, channel, known, deviation_q5(m, channel));
    if (looks == 0) return;
    const float before = m->healthy.weight[channel <= DQW_WATCH_PSI ? channel : 0];
    dqw_monitor_move_healthy(m, channel, 1.0f - 1.0f / (float)looks);
    // What temperatures count from was no surer than that.
    if (looks > DQW_WATCH_LOOKS_LEAST || m->config->commissioned) return;
    if (channel == DQW_WATCH_R) m->healthy.cold_R_ohm *= m->healthy.weight[channel] / before;
    if (channel == DQW_WATCH_PSI) m->healthy.cold_psi_Wb *= m->healthy.weight[channel] / before;
}

static dqw_fault_verdict name_it(const dqw_monitor *m)
{
    float change[DQW_SIGNS];
    float unit[DQW_SIGNS];
    const dqw_estimator *e = &m->estimator;
    const float rows = (float)(2u * (e->number - m->named_since));
    for (int channel = 0; channel < DQW_WATCH_FRICTION; channel++) {
        dqw_monitor_channel_value x;
        dqw_monitor_read_channel(m, channel, &x);
        // A change of a third of a band is none; what is not known, or was not, counts for nothing.
        const float third = dqw_monitor_band_of(m, channel) * (1.0f / 3.0f);
        const bool sure = x.sd < DQW_UNKNOWN && m->watch.looks[channel] >= DQW_WATCH_LOOKS_LEAST;
        const float least = sure ? sqrtf(x.sd * x.sd + third * third) : DQW_UNKNOWN;
        if (channel < DQW_WATCH_OFFSET) {
            float scale = channel == DQW_WATCH_ANGLE       ? m->healthy.weight[DQW_PSI]
                          : channel == DQW_WATCH_DEAD_TIME ? 1.0f
                                                           : m->healthy.weight[channel];
            // Of a change a weight shows what its gain has let it follow since. (E64)
            const int weight = dqw_watch_weight(channel);
            const float share = SHARE_LEAST +
                                rows * dqw_gain_covariance(&e->gain, weight, weight) * e->alone_pu2[weight];
            if (share < 1.0f) scale *= share;
            change[channel] = is_apart(m, channel) ? 0.0f : x.change / scale;
            unit[channel] = least / fabsf(scale);
        } else {
            const int k = channel - DQW_WATCH_OFFSET;
            const int at = DQW_SIGN_OFFSET_RE + 2 * k;
            change[at] = m->witness.re[k] - m->healthy.re[k];
            change[at + 1] = m->witness.im[k] - m->healthy.im[k];
            unit[at] = unit[at + 1] = least;
        }
    }
    // A resistance and a gain share a ripple: at the mean speed it is known whatever their shares. (E177)
    const float w_e = dqw_witness_speed(&m->witness);
    change[DQW_SIGN_RESISTANCE_RE] -= w_e * change[DQW_SIGN_REACTANCE_IM];
    change[DQW_SIGN_RESISTANCE_IM] += w_e * change[DQW_SIGN_REACTANCE_RE];
    const dqw_fault_machine machine = {m->healthy.weight[DQW_R],
                                       0.5f * (m->healthy.weight[DQW_LD] + m->healthy.weight[DQW_LQ]), w_e,
                                       m->config->estimator.observed, m->healthy.weight[DQW_DEAD_TIME]};
    return dqw_fault_name_it(change, unit, machine);
}

static bool above_threshold(const dqw_monitor *m)
{
    return dqw_estimator_recent_pu(&m->estimator) * 1e6f > (float)m->estimator.stage.threshold_ppm;
}

// What the healthy value of a channel is; of temperature and residual the limit.
static float healthy_of(const dqw_monitor *m, int channel)
{
    if (channel < DQW_WATCH_OFFSET) return m->healthy.weight[channel];
    if (channel == DQW_WATCH_FRICTION) return m->healthy.friction_Nm;
    if (channel == DQW_WATCH_TEMPERATURE) return dqw_monitor_band(m, channel);
    if (channel == DQW_WATCH_RESIDUAL)
        return dqw_monitor_band(m, channel) * sqrtf(m->healthy.residual_pu2) * m->config->estimator.v_base_V;
    return dqw_monitor_ripple(m->healthy.re, m->healthy.im, channel);
}

static void name(dqw_monitor *m, int channel)
{
    dqw_monitor_channel_value x;
    dqw_monitor_read_channel(m, channel, &x);
    m->named_value = x.now;
    m->named_sd = x.sd;
    m->named_at = m->estimator.number;
    m->named_since = m->estimator.number - (uint32_t)dqw_watch_since(&m->watch, channel) * DQW_WATCH_TICK_BLOCKS;
    // A weight that was found changed began to be so in a segment that had passed by then.
    const dqw_estimator *e = &m->estimator;
    const uint32_t ago = e->number - e->opened_at;
    if (e->opened > 0 && ago < OPENED_LOOKS * DQW_WATCH_TICK_BLOCKS &&
        e->number - e->opened_since > e->number - m->named_since)
        m->named_since = e->opened_since;
    m->named_channel = (uint8_t)channel;
    m->named_healthy = healthy_of(m, channel);
    const enum dqw_fault_name of_channel = dqw_watch_fault_of(channel, x.change > 0.0f);
    const dqw_fault_verdict sure = {.name = of_channel, .confidence = SURE, .phase = 0};
    m->named_fault = of_channel != DQW_FAULT_NONE ? sure : name_it(m);
    // Where the model does not hold at all, a pattern is none that explains no more of what moved, or where the residual
    // has moved by more of its band than any weight.
    if (above_threshold(m) && (channel == DQW_WATCH_RESIDUAL || m->named_fault.confidence < SURE_ENOUGH))
        m->named_fault.name = DQW_FAULT_UNKNOWN;
}

// The healthy residual is the largest one that driving made: no faster than so, or a fault would be taken in.
static void follow_residual(dqw_monitor *m)
{
    const dqw_estimator *e = &m->estimator;
    if (!e->config->follow) return;
    const float most = m->healthy.residual_pu2 * (e->segment.segments < NEW_SEGMENTS     ? RESIDUAL_RISE_NEW
                                                  : e->segment.segments < YOUNG_SEGMENTS ? RESIDUAL_RISE_YOUNG
                                                                                         : RESIDUAL_RISE);
    if (e->recent_pu2 > m->healthy.residual_pu2) m->healthy.residual_pu2 = e->recent_pu2 < most ? e->recent_pu2 : most;
}

// What has just begun to show is judged by a segment of its own: a weight that moved along one operating point may be
// any. (E105)
static void hasten(dqw_monitor *m)
{
    dqw_segment *s = &m->estimator.segment;
    const bool urgent = dqw_watch_wants_a_segment(&m->watch) && m->config->estimator.follow;
    if (urgent && !s->urgent) {
        dqw_segment_restart(s);
        m->alarmed_segments = s->segments;
    }
    s->urgent = urgent;
}

// Has that segment not ended, or a weight only just been found changed?
static bool is_early(const dqw_monitor *m)
{
    const dqw_estimator *e = &m->estimator;
    const bool waits = e->segment.urgent && e->segment.segments == m->alarmed_segments &&
                       e->segment.blocks < (uint32_t)(WAITS_S / (e->config->dt_s * (float)e->window.half));
    return waits || (e->opened > 0 && e->number - e->opened_at < OPENED_SETTLES * DQW_WATCH_TICK_BLOCKS);
}

// `witnessed`: the last block taught ripples as well.
static bool look(dqw_monitor *m, bool witnessed)
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
    const bool sure = m->named_fault.confidence >= SURE_ENOUGH;
    const enum dqw_watch_follows follows = dqw_watch_named(&m->watch, worst, m->named_fault.name, sure);
    if (follows == DQW_WATCH_LATER) return false;
    if (m->named_fault.confidence < SURE_LEAST) m->named_fault.name = DQW_FAULT_UNKNOWN;
    if (follows == DQW_WATCH_APART) {
        if (worst == DQW_WATCH_FRICTION) dqw_monitor_move_healthy(m, worst, 0.0f);
        return true;
    }
    // Temperatures go on counting from where they were: what has broken is not what has heated.
    if (dqw_fault_moves_R(m->named_fault.name)) m->healthy.cold_R_ohm *= value(m, DQW_R) / m->healthy.weight[DQW_R];
    m->healthy.cold_psi_Wb *= value(m, DQW_PSI) / m->healthy.weight[DQW_PSI];
    adopt(m);
    dqw_watch_rest(&m->watch);
    return true;
}

static void enter_service(dqw_monitor *m)
{
    dqw_watch_enter(&m->watch);
    if (m->enter_as_stored != NULL) {
        m->enter_as_stored(m);
        m->enter_as_stored = NULL;
        return;
    }
    const dqw_estimator_config *c = &m->config->estimator;
    m->healthy.cold_R_ohm = m->config->commissioned ? c->R_ohm : value(m, DQW_R);
    m->healthy.cold_psi_Wb = m->config->commissioned ? c->psi_Wb : value(m, DQW_PSI);
    m->healthy.hottest_K = 0.0f;
    // Healthy values settle at once: what begins to grow in a rest would be taken in.
    adopt(m);
}

// L_d shows only where i_d is not 0: without it the other three are watched. A frame that is about to turn (E102) moves
// them all. Where the model did not hold a standstill's residual says nothing: there one segment is waited for.
static bool known(const dqw_monitor *m)
{
    const bool frame = m->estimator.across == 0;
    const bool holds = m->estimator.stage.times_back == 0 || has_met(m, 1);
    return frame && holds && is_known(m, DQW_R) && is_known(m, DQW_LQ) && is_known(m, DQW_PSI);
}

static void stage(dqw_monitor *m)
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
        if (m->watch.back) dqw_estimator_stage_on(&m->estimator, true);
        m->watch.back = false;
        return;
    }
    if (before == DQW_STAGE_ORDINAL && !above_threshold(m) && !known(m)) return;
    dqw_estimator_stage_on(&m->estimator, true);
    if (s->name == DQW_STAGE_IN_SERVICE) enter_service(m);
}

bool dqw_monitor_background(dqw_monitor *m)
{
    dqw_estimator *e = &m->estimator;
    dqw_estimator_block block;
    if (!dqw_estimator_take(e, &block) || e->stage.name == DQW_STAGE_DOMAIN) return false;

    // [MON.1] learn
    const bool judged = e->stage.name != DQW_STAGE_RANDOM;
    const bool learned = dqw_estimator_learn(e, &block);
    if (m->config->J_kgm2 > 0.0f) watch_friction(m, &block, e->elapsed == 1);
    if (!learned) return false;
    dqw_watch_learned(&m->watch, e->number);

    // [MON.2] the stage; what coarse weights leave is no ripple
    const bool witnessed = judged && dqw_witness_learn(&m->witness, e, &block);
    if (judged) stage(m);
    if (e->stage.name != DQW_STAGE_IN_SERVICE) return false;

    // [MON.3] every so often, a look at every channel
    if (!dqw_watch_block(&m->watch) || !look(m, witnessed)) return false;
    m->has_change = true;
    return true;
}

bool dqw_monitor_event(dqw_monitor *m, dqw_monitor_change *change)
{
    if (!m->has_change) return false;
    const uint64_t half = m->estimator.window.half;
    change->sample = m->named_at * half;
    change->since = m->named_since * half;
    change->parameter = (enum dqw_monitor_channel)m->named_channel;
    change->value = m->named_value;
    change->sd = m->named_sd;
    change->healthy = m->named_healthy;
    change->fault = m->named_fault;
    m->has_change = false;
    return true;
}

enum dqw_why dqw_monitor_why(const dqw_monitor *m)
{
    const dqw_estimator *e = &m->estimator;
    const enum dqw_why decided = dqw_watch_why(&m->watch, &e->stage, *(const volatile uint32_t *)&e->halves);
    if (decided != DQW_WHYS) return decided;
    if (e->number == 0) return DQW_WHY_NO_BLOCK;
    if (e->config->noise_on_inputs && e->noise_rows < DQW_NOISE_ROWS) return DQW_WHY_NOISE;
    if (!dqw_watch_excited(e->excess_q10, e->inputs)) return DQW_WHY_EXCITATION;
    if (dqw_estimator_seeks_legs(e)) return DQW_WHY_MODULATION;
    const enum dqw_voltage_acts acts = dqw_estimator_voltage_acts(e);
    if (acts != DQW_VOLTAGE_NOT_KNOWN && (acts == DQW_VOLTAGE_NEXT) != e->config->voltage_next) return DQW_WHY_VOLTAGE;
    if (e->stage.name == DQW_STAGE_ORDINAL && above_threshold(m)) return DQW_WHY_RESIDUAL;
    if (!is_known(m, DQW_R)) return DQW_WHY_R;
    if (!is_known(m, DQW_LQ)) return DQW_WHY_LQ;
    return is_known(m, DQW_PSI) ? DQW_WHY_BLOCKS : DQW_WHY_PSI;
}
