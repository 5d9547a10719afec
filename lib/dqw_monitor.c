#include "dqw_monitor.h"

#include <math.h>
#include <stddef.h>

#include "dqw_number.h"

// No band is narrower than this many deviations.
#define DEVIATIONS 5.0f
// A healthy value is learned while its deviation is within this part of its band. A wider one does where looks are soon unlike, so that their
// mean is better than each: the witness forgets in 0.3 s, a weight in (deviation over drift) squared, the flux with its narrow band first.
#define KNOWN_PART 0.2f
#define KNOWN_PART_FLUX 0.4f
#define KNOWN_PART_WITNESS 0.5f
// The winding's highest rise is forgotten by half in about twenty minutes of looks every 16 ms.
#define HOTTEST_KEPT 0.99999f
#define ORDINAL_BLOCKS 500u
#define RANDOM_LIMIT 2000u
#define THRESHOLD_PPM 50000u
// A parameter is known well enough to be watched.
#define SERVICE_SD 0.1f
// Residual: a mean over about 64 blocks, that counts as at least 0.2 % of the base.
#define RESIDUAL_PART (1.0f / 64.0f)
#define RESIDUAL_FLOOR_PU2 4e-6f
// Slack on rates and rises of temperature.
#define SLACK 1.3f
// Confidence of what needs no pattern.
#define SURE 0.99f
#define TEMPERATURE_BAND_K 5.0f
// Part of the speed base above which a direction is one.
#define SLOWEST_PU 0.1f

static const float BAND[DQW_WATCH_CHANNELS] = {0.04f, 0.06f, 0.06f, 0.012f, 0.005f, 0.02f, 0.01f, 0.03f, 0.03f, 0.003f, 0.05f, 110.0f, 3.0f};
#define ALPHA_PER_K 0.0039f
#define BETA_PER_K 0.001f
#define HEATING_K_S 1.0f

static float or_else(float configured, float otherwise)
{
    return configured > 0.0f ? configured : otherwise;
}

// The tracker was given the first part of it.
const dqw_monitor_config *dqw_monitor_config_of(const dqw_monitor *m)
{
    return (const dqw_monitor_config *)(const void *)m->tracker.config;
}

static float band(const dqw_monitor *m, int channel)
{
    return or_else(dqw_monitor_config_of(m)->band[channel], BAND[channel]);
}

static float alpha_of(const dqw_monitor *m)
{
    return or_else(dqw_monitor_config_of(m)->alpha_per_K, ALPHA_PER_K);
}

enum dqw_status dqw_monitor_init(dqw_monitor *m, const dqw_monitor_config *config, dqw_monitor_random *lent)
{
    if (m == NULL || config == NULL || (lent != NULL && lent->learn == NULL)) return DQW_ERR_NULL;
    const dqw_monitor_config *c = config;
    const float rest[] = {c->alpha_per_K, c->beta_per_K, c->heating_K_s, c->J_kgm2};
    for (int i = 0; i < DQW_WATCH_CHANNELS + 4; i++)
        if (!dqw_is_zero_or_positive(i < DQW_WATCH_CHANNELS ? c->band[i] : rest[i - DQW_WATCH_CHANNELS])) return DQW_ERR_RANGE;
    dqw_monitor n = {.lent = lent};
    const enum dqw_status status = dqw_tracker_init(&n.tracker, &config->tracker);
    if (status != DQW_OK) return status;
    dqw_witness_init(&n.witness);
    dqw_stage_init(&n.stage, c->threshold_ppm != 0 ? c->threshold_ppm : THRESHOLD_PPM, RANDOM_LIMIT, ORDINAL_BLOCKS);
    dqw_stage_define(&n.stage);
    *m = n;
    return DQW_OK;
}

enum dqw_status dqw_monitor_define(dqw_monitor *m, const dqw_monitor_config *config, dqw_monitor_random *lent)
{
    if (m == NULL) return DQW_ERR_NULL;
    const dqw_stage stage = m->stage;
    dqw_gate gate = m->tracker.gate;
    const uint32_t halves = m->tracker.halves;
    const enum dqw_status status = dqw_monitor_init(m, config, lent);
    if (status != DQW_OK) return status;
    m->stage.back = stage.back;
    m->stage.times_back = stage.times_back;
    m->stage.residual_ppm = stage.residual_ppm;
    gate.stale_limit = config->tracker.stale_limit;
    m->tracker.gate = gate;
    m->tracker.halves = m->tracker.at = halves;
    return DQW_OK;
}

enum dqw_stage_name dqw_monitor_stage(const dqw_monitor *m)
{
    return m->stage.name;
}

uint32_t dqw_monitor_sample(dqw_monitor *m, const dqw_sample *s, bool saturated)
{
    return dqw_tracker_sample(&m->tracker, s, saturated);
}

static float value(const dqw_monitor *m, int weight)
{
    return dqw_tracker_value(&m->tracker, (enum dqw_tracker_weight)weight);
}

static float sd(const dqw_monitor *m, int weight)
{
    return dqw_tracker_sd(&m->tracker, (enum dqw_tracker_weight)weight);
}

static float rise_K(const dqw_monitor *m, float R_ohm)
{
    return (R_ohm / m->cold_R_ohm - 1.0f) / alpha_of(m);
}

static float friction_sd_Nm(const dqw_monitor *m)
{
    const uint8_t n = m->watch.reversals;
    return n >= DQW_WATCH_REVERSALS_LEAST ? sqrtf(2.0f * m->spread_Nm2 / (float)n) : INFINITY;
}

// Half the difference of two stretches' mean torque, one in each direction, is friction: a load is the same on both sides of a reversal, or
// its change has no sign.
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

// The torque that does not accelerate.
static void watch_friction(dqw_monitor *m, bool unbroken)
{
    const dqw_tracker *t = &m->tracker;
    const dqw_tracker_config *c = t->config;
    const dqw_block b = dqw_tracker_block(t);
    const float w = b.w_m_rad_s;
    const float torque = 1.5f * (float)c->pole_pairs * b.i_q_A * (value(m, DQW_TRACK_PSI) + (value(m, DQW_TRACK_LD) - value(m, DQW_TRACK_LQ)) * b.i_d_A);
    const float used = torque - dqw_monitor_config_of(m)->J_kgm2 * (w - m->w_before_rad_s) / (c->dt_s * (float)t->window.half);
    m->w_before_rad_s = w;
    const int way = w > SLOWEST_PU * c->w_base_rad_s ? 1 : w < -SLOWEST_PU * c->w_base_rad_s ? -1 : 0;
    const int gathered = dqw_watch_stretch(&m->watch, fabsf(used) < 1e6f ? way : 0, unbroken);
    m->gathered_Nm = gathered > 1 ? m->gathered_Nm + used : used;
    if (gathered == DQW_WATCH_STRETCH_BLOCKS) reversal(m, way, m->gathered_Nm * (1.0f / (float)DQW_WATCH_STRETCH_BLOCKS));
}

// A channel's band in its own unit.
static float band_of(const dqw_monitor *m, int channel)
{
    const dqw_tracker_config *c = &dqw_monitor_config_of(m)->tracker;
    const float *h = m->healthy;
    const float L3 = (h[DQW_TRACK_LD] + h[DQW_TRACK_LQ]) * (1.0f / 6.0f);
    const float unit[DQW_WATCH_TEMPERATURE] = {
        h[DQW_TRACK_R],
        h[DQW_TRACK_LD],
        h[DQW_TRACK_LQ],
        h[DQW_TRACK_PSI],
        c->v_base_V,
        h[DQW_TRACK_PSI],
        c->i_base_A,
        h[DQW_TRACK_R] * (1.0f / 3.0f),
        L3,
        1.0f / (3.0f * h[DQW_TRACK_R]),
        1.5f * (float)c->pole_pairs * h[DQW_TRACK_PSI] * c->i_base_A,
    };
    return band(m, channel) * unit[channel];
}

// Value, its change from the healthy one, and its deviation, of a channel; of temperature and residual the change is the value.
static void read_channel(const dqw_monitor *m, int channel, float *now, float *change, float *deviation)
{
    if (channel < DQW_TRACK_WEIGHTS) {
        *now = value(m, channel);
        *change = *now - m->healthy[channel];
        *deviation = sd(m, channel);
    } else if (channel < DQW_WATCH_FRICTION) {
        const int k = channel - DQW_WATCH_OFFSET;
        const float re = m->witness.re[k] - m->healthy_re[k];
        const float im = m->witness.im[k] - m->healthy_im[k];
        *now = dqw_witness_size(&m->witness, (enum dqw_witness_input)k);
        *change = sqrtf(re * re + im * im);
        *deviation = dqw_witness_sd(&m->witness, &m->tracker, (enum dqw_witness_input)k);
    } else if (channel == DQW_WATCH_FRICTION) {
        *now = m->friction_Nm;
        *change = *now - m->healthy_friction_Nm;
        *deviation = friction_sd_Nm(m);
    } else {
        const bool hot = channel == DQW_WATCH_TEMPERATURE;
        *now = *change = hot ? rise_K(m, value(m, DQW_TRACK_R)) : sqrtf(m->residual_pu2) * dqw_monitor_config_of(m)->tracker.v_base_V;
        *deviation = hot ? sd(m, DQW_TRACK_R) / (m->cold_R_ohm * alpha_of(m)) : 0.0f;
    }
}

// The healthy value as far from the present one as `keep` says: 0 takes it over.
static void move_healthy(dqw_monitor *m, int channel, float keep)
{
    if (channel < DQW_TRACK_WEIGHTS) {
        m->healthy[channel] = value(m, channel) + keep * (m->healthy[channel] - value(m, channel));
    } else if (channel < DQW_WATCH_FRICTION) {
        const int k = channel - DQW_WATCH_OFFSET;
        m->healthy_re[k] = m->witness.re[k] + keep * (m->healthy_re[k] - m->witness.re[k]);
        m->healthy_im[k] = m->witness.im[k] + keep * (m->healthy_im[k] - m->witness.im[k]);
    } else {
        m->healthy_friction_Nm = m->friction_Nm + keep * (m->healthy_friction_Nm - m->friction_Nm);
    }
}

// A healthy value is the mean over the first looks at which it is known, as long as nothing seems to change.
static void settle(dqw_monitor *m, int channel)
{
    if (channel == DQW_WATCH_FRICTION) {
        if (dqw_watch_friction_settles(&m->watch)) move_healthy(m, channel, 0.0f);
        return;
    }
    if (!dqw_watch_settles(&m->watch, channel)) return;
    float now;
    float change;
    float deviation;
    read_channel(m, channel, &now, &change, &deviation);
    const uint8_t looks = m->watch.looks[channel];
    const float part = channel > DQW_WATCH_ANGLE ? KNOWN_PART_WITNESS : channel == DQW_WATCH_PSI ? KNOWN_PART_FLUX : KNOWN_PART;
    const bool known_now = deviation < part * band_of(m, channel);
    if (known_now) m->watch.looks[channel]++;
    if (known_now || looks == 0) move_healthy(m, channel, 1.0f - 1.0f / (float)(looks + 1));
}

// Healthy values as they are now.
static void adopt(dqw_monitor *m)
{
    for (int i = 0; i < DQW_WATCH_TEMPERATURE; i++) move_healthy(m, i, 0.0f);
    m->healthy_residual_pu2 = m->residual_pu2 > RESIDUAL_FLOOR_PU2 ? m->residual_pu2 : RESIDUAL_FLOOR_PU2;
    dqw_watch_adopt(&m->watch, m->tracker.halves);
}

static void begin_rest(dqw_monitor *m)
{
    adopt(m);
    dqw_watch_rest(&m->watch);
}

// What heat can have made of R or the flux since its healthy value last followed.
static float heat_since(const dqw_monitor *m, int channel)
{
    const dqw_monitor_config *c = dqw_monitor_config_of(m);
    const bool flux = channel == DQW_WATCH_PSI;
    const float rate = flux ? or_else(c->beta_per_K, BETA_PER_K) * m->cold_psi_Wb : alpha_of(m) * m->cold_R_ohm;
    const uint16_t halves = dqw_watch_unfollowed(&m->watch, channel, m->tracker.halves);
    return rate * or_else(c->heating_K_s, HEATING_K_S) * (SLACK * (float)(1u << DQW_WATCH_FOLLOW_SHIFT)) * c->tracker.dt_s *
           (float)(halves * m->tracker.window.half);
}

// Healthy R or flux goes with the measured one, no faster than heat can. Not while the measured one is unsure: it would follow noise.
static void follow(dqw_monitor *m, int channel)
{
    const float bound = heat_since(m, channel);
    const bool flux = channel == DQW_WATCH_PSI;
    if (!(bound > 0.0f) || !(sd(m, channel) < (flux ? KNOWN_PART_FLUX : KNOWN_PART) * band_of(m, channel))) return;
    const float off = value(m, channel) - m->healthy[channel];
    m->healthy[channel] += off > bound ? bound : off < -bound ? -bound : off;
    dqw_watch_follow(&m->watch, channel, m->tracker.halves);
}

// The flux no further than the winding's heat explains, now or a while ago.
static void follow_temperature(dqw_monitor *m)
{
    const float beta = or_else(dqw_monitor_config_of(m)->beta_per_K, BETA_PER_K);
    follow(m, DQW_WATCH_R);
    follow(m, DQW_WATCH_PSI);
    const float rise = rise_K(m, m->healthy[DQW_TRACK_R]);
    m->hottest_K *= HOTTEST_KEPT;
    if (rise > m->hottest_K) m->hottest_K = rise;
    const float coldest = m->cold_psi_Wb * (1.0f - SLACK * beta * m->hottest_K - 0.5f * band(m, DQW_WATCH_PSI));
    if (m->healthy[DQW_TRACK_PSI] < coldest) m->healthy[DQW_TRACK_PSI] = coldest;
}

// Size of a channel's change over its band, Q5; 0 where it is not known.
static int32_t deviation_q5(const dqw_monitor *m, int channel)
{
    float ratio;
    if (channel == DQW_WATCH_TEMPERATURE) {
        if (!(sd(m, DQW_TRACK_R) < band_of(m, DQW_WATCH_R))) return 0;
        ratio = (rise_K(m, value(m, DQW_TRACK_R)) - band(m, DQW_WATCH_TEMPERATURE)) / TEMPERATURE_BAND_K + 1.0f;
    } else if (channel == DQW_WATCH_RESIDUAL) {
        ratio = sqrtf(m->residual_pu2 / m->healthy_residual_pu2) / band(m, DQW_WATCH_RESIDUAL);
    } else {
        float now;
        float change;
        float deviation;
        read_channel(m, channel, &now, &change, &deviation);
        const float width = band_of(m, channel);
        // The healthy value has a deviation too: less, the more looks it is the mean of.
        const int looks = m->watch.looks[channel];
        const float sure = DEVIATIONS * deviation * sqrtf(1.0f + (float)DQW_WATCH_LOOKS_ALIKE / (float)(DQW_WATCH_LOOKS_ALIKE + looks));
        // What heat may have made of it meanwhile is no change.
        const float heat = channel == DQW_WATCH_R || channel == DQW_WATCH_PSI ? heat_since(m, channel) : 0.0f;
        ratio = looks < DQW_WATCH_LOOKS_LEAST ? 0.0f : (fabsf(change) - heat) / (width > sure ? width : sure);
    }
    // NaN and infinity over infinity count as nothing.
    return ratio > 0.0f ? (int32_t)((ratio < 100.0f ? ratio : 100.0f) * (float)DQW_CHANGE_BAND_Q5) : 0;
}

static dqw_fault_verdict name_it(const dqw_monitor *m)
{
    float change[DQW_SIGNS];
    float unit[DQW_SIGNS];
    for (int channel = 0; channel < DQW_WATCH_FRICTION; channel++) {
        float now;
        float off;
        float deviation;
        read_channel(m, channel, &now, &off, &deviation);
        // A change of a third of a band is none; what is not known counts for nothing.
        const float third = band_of(m, channel) * (1.0f / 3.0f);
        const float least = dqw_is_finite(deviation) ? sqrtf(deviation * deviation + third * third) : INFINITY;
        if (channel < DQW_TRACK_WEIGHTS) {
            const float scale = channel == DQW_WATCH_ANGLE ? m->healthy[DQW_TRACK_PSI] : channel == DQW_WATCH_DEAD_TIME ? 1.0f : m->healthy[channel];
            change[channel] = off / scale;
            unit[channel] = least / scale;
        } else {
            const int k = channel - DQW_WATCH_OFFSET;
            const int at = DQW_SIGN_OFFSET_RE + 2 * k;
            change[at] = m->witness.re[k] - m->healthy_re[k];
            change[at + 1] = m->witness.im[k] - m->healthy_im[k];
            unit[at] = unit[at + 1] = least;
        }
    }
    const dqw_fault_machine machine = {m->healthy[DQW_TRACK_R], 0.5f * (m->healthy[DQW_TRACK_LD] + m->healthy[DQW_TRACK_LQ])};
    return dqw_fault_name_it(change, unit, machine);
}

static uint32_t ppm(float ratio)
{
    return ratio < 4000.0f ? (uint32_t)(ratio * 1e6f) : 4000000000u;
}

static void tell(const dqw_monitor *m, int channel, dqw_monitor_event *event)
{
    float change;
    read_channel(m, channel, &event->value, &change, &event->sd);
    event->half = m->tracker.halves;
    event->since = m->tracker.halves - (uint32_t)dqw_watch_since(&m->watch, channel) * DQW_WATCH_TICK_BLOCKS;
    event->parameter = (enum dqw_monitor_channel)channel;
    const enum dqw_fault_name of_channel = dqw_watch_fault_of(channel, change > 0.0f);
    const dqw_fault_verdict sure = {.name = of_channel, .confidence = SURE, .phase = 0};
    event->fault = of_channel != DQW_FAULT_NONE ? sure : name_it(m);
}

static bool look(dqw_monitor *m, dqw_monitor_event *event)
{
    const enum dqw_watch_begins begins = dqw_watch_begin(&m->watch);
    if (begins == DQW_WATCH_PAUSES) return false;
    if (begins == DQW_WATCH_ADOPTS) {
        adopt(m);
        return false;
    }
    if (begins == DQW_WATCH_SETTLES) {
        follow_temperature(m);
        for (int i = 0; i < DQW_WATCH_TEMPERATURE; i++) settle(m, i);
    }
    int32_t q5[DQW_WATCH_CHANNELS];
    for (int i = 0; i < DQW_WATCH_CHANNELS; i++) q5[i] = deviation_q5(m, i);
    if (!dqw_watch_look(&m->watch, q5)) return false;
    const int worst = dqw_watch_worst(&m->watch, q5, ppm(sqrtf(m->residual_pu2)) > m->stage.threshold_ppm);
    if (worst < 0) return false;
    tell(m, worst, event);
    const enum dqw_watch_follows follows = dqw_watch_named(&m->watch, worst, event->fault.name);
    if (follows == DQW_WATCH_LATER) return false;
    if (follows == DQW_WATCH_APART) {
        if (worst == DQW_WATCH_FRICTION) move_healthy(m, worst, 0.0f);
        return true;
    }
    // Temperatures go on counting from where they were: what has broken is not what has heated.
    const enum dqw_fault_name name = event->fault.name;
    if (name == DQW_FAULT_PHASE_CONNECTION || name == DQW_FAULT_CURRENT_GAIN) m->cold_R_ohm *= value(m, DQW_TRACK_R) / m->healthy[DQW_TRACK_R];
    m->cold_psi_Wb *= value(m, DQW_TRACK_PSI) / m->healthy[DQW_TRACK_PSI];
    begin_rest(m);
    return true;
}

static void enter_service(dqw_monitor *m)
{
    const dqw_tracker_config *c = &dqw_monitor_config_of(m)->tracker;
    m->cold_R_ohm = dqw_monitor_config_of(m)->commissioned ? c->R_ohm : value(m, DQW_TRACK_R);
    m->cold_psi_Wb = dqw_monitor_config_of(m)->commissioned ? c->psi_Wb : value(m, DQW_TRACK_PSI);
    m->hottest_K = 0.0f;
    begin_rest(m);
}

static bool known(const dqw_monitor *m)
{
    // L_d shows only where i_d is not 0: without it the other three are watched.
    for (int i = 0; i <= DQW_TRACK_PSI; i++)
        if (i != DQW_TRACK_LD && !(sd(m, i) < SERVICE_SD * value(m, i))) return false;
    return true;
}

// Fig. 1: which stage, after a block.
static void stage(dqw_monitor *m)
{
    const bool random = m->lent != NULL && m->stage.name == DQW_STAGE_RANDOM;
    const bool converged = !random || m->lent->learn(m->lent, &m->tracker);
    const dqw_stage_input in = {
        .random_converged = converged,
        .residual_ppm = ppm(dqw_tracker_residual_pu(&m->tracker)),
        .residual_recent_ppm = ppm(sqrtf(m->residual_pu2)),
    };
    if (m->stage.name == DQW_STAGE_IN_SERVICE) {
        // A residual above the threshold is named first: a sudden fault is one too.
        if (in.residual_recent_ppm > m->stage.threshold_ppm) dqw_watch_alarm_residual(&m->watch);
        if (m->watch.back) (void)dqw_stage_step(&m->stage, in);
        m->watch.back = false;
        return;
    }
    if (m->stage.name == DQW_STAGE_ORDINAL && in.residual_ppm <= m->stage.threshold_ppm && !known(m)) return;
    if (dqw_stage_step(&m->stage, in) && m->stage.name == DQW_STAGE_IN_SERVICE) enter_service(m);
}

static bool background(dqw_monitor *m, dqw_monitor_event *event)
{
    // [MON.1] learn
    const bool unbroken = m->tracker.halves - m->tracker.at == 1;
    const bool learned = dqw_tracker_learn_held(&m->tracker);
    if (dqw_monitor_config_of(m)->J_kgm2 > 0.0f) watch_friction(m, unbroken);
    if (!learned) return false;
    dqw_watch_learned(&m->watch, m->tracker.at);
    const float *e = m->tracker.e_pu;
    m->residual_pu2 += (e[0] * e[0] + e[1] * e[1] - m->residual_pu2) * RESIDUAL_PART;
    (void)dqw_witness_learn(&m->witness, &m->tracker);

    // [MON.2] the stage
    stage(m);
    if (m->stage.name != DQW_STAGE_IN_SERVICE) return false;

    // [MON.3] every so often, a look at every channel
    return dqw_watch_block(&m->watch) && look(m, event);
}

bool dqw_monitor_background(dqw_monitor *m, dqw_monitor_event *event)
{
    if (!dqw_tracker_waits(&m->tracker) || m->stage.name == DQW_STAGE_DOMAIN) return false;
    // The block is read to the end of it all: only then may the interrupt write the next one.
    const bool told = background(m, event);
    dqw_tracker_release(&m->tracker);
    return told;
}
