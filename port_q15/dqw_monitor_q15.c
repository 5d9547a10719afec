#include "dqw_monitor_q15.h"

#include <stddef.h>

#include "dqw_q15.h"
#include "dqw_estimator_block_q15.h"

// No band is narrower than this many deviations.
#define DEVIATIONS 5
// A healthy value is learned while its deviation is within this part of its band, as in dqw_monitor.c: 0.2, flux 0.4, witness 0.5.
#define KNOWN_PART_Q15 6554
#define KNOWN_PART_FLUX_Q15 13107
#define KNOWN_PART_WITNESS_Q15 16384
// The winding's highest rise is forgotten by half in about twenty minutes of looks every 16 ms: a part of 1e-5.
#define HOTTEST_FORGETS 100000
// A parameter is known well enough to be watched: deviation within a tenth.
#define SERVICE_PARTS 10
// Slack on rates and rises of temperature, in tenths.
#define SLACK_TENTHS 13
// Confidence of what needs no pattern: 0.99.
#define SURE_Q15 32440
#define TEMPERATURE_BAND_K 5
// Part of the full speed above which a direction is one: a fifteenth, a full scale being half as much again as a rated value.
#define SLOWEST_Q28 17895697
#define PARTS_MOST 1000000u
#define ONE_Q16 65536
#define ONE_Q24 16777216
#define MILLION 1000000

static const uint32_t BAND_PPM[DQW_WATCH_CHANNELS] = {40000, 60000, 60000, 12000, 5000, 20000, 10000, 30000, 30000, 3000, 50000, 110000000, 3000000};
#define ALPHA_PPM_PER_K 3900u
#define BETA_PPM_PER_K 1000u
#define HEATING_MK_S 1000u
#define FLOOR_PPM 2000u

// The estimator was given the first part of it.
const dqw_monitor_q15_config *dqw_monitor_config_of_q15(const dqw_monitor_q15 *m)
{
    return (const dqw_monitor_q15_config *)(const void *)m->estimator.config;
}

static int64_t or_else(uint32_t configured, uint32_t otherwise)
{
    return configured != 0 ? configured : otherwise;
}

static int64_t band_q24(const dqw_monitor_q15 *m, int channel)
{
    return dqw_q_quotient64(or_else(dqw_monitor_config_of_q15(m)->band_ppm[channel], BAND_PPM[channel]), MILLION, 24);
}

static int64_t alpha_ppm(const dqw_monitor_q15 *m)
{
    return or_else(dqw_monitor_config_of_q15(m)->alpha_ppm_per_K, ALPHA_PPM_PER_K);
}

static int64_t beta_ppm(const dqw_monitor_q15 *m)
{
    return or_else(dqw_monitor_config_of_q15(m)->beta_ppm_per_K, BETA_PPM_PER_K);
}

static enum dqw_status check(const dqw_monitor_q15 *m, const dqw_monitor_q15_config *config)
{
    if (m == NULL || config == NULL) return DQW_ERR_NULL;
    if (config->alpha_ppm_per_K > PARTS_MOST) return DQW_ERR_ALPHA;
    if (config->beta_ppm_per_K > PARTS_MOST) return DQW_ERR_BETA;
    if (config->heating_mK_s > PARTS_MOST) return DQW_ERR_HEATING;
    if (config->residual_floor_ppm > PARTS_MOST) return DQW_ERR_RESIDUAL_FLOOR;
    return config->estimator.scale.pole_pairs != 0 ? DQW_OK : DQW_ERR_POLE_PAIRS;
}

static void begin(dqw_monitor_q15 *m)
{
    const dqw_monitor_measures_q15 nothing = {.friction_q24 = 0};
    m->is = nothing;
    dqw_witness_init_q15(&m->witness);
    dqw_watch_init(&m->watch);
}

// In place, once nothing can be refused any more: a small core's stack has no room for a second one.
enum dqw_status dqw_monitor_init_q15(dqw_monitor_q15 *m, const dqw_monitor_q15_config *config)
{
    enum dqw_status status = check(m, config);
    if (status == DQW_OK) status = dqw_estimator_init_q15(&m->estimator, &config->estimator);
    if (status == DQW_OK) begin(m);
    return status;
}

enum dqw_status dqw_monitor_define_q15(dqw_monitor_q15 *m, const dqw_monitor_q15_config *config)
{
    enum dqw_status status = check(m, config);
    if (status == DQW_OK) status = dqw_estimator_define_q15(&m->estimator, &config->estimator);
    if (status == DQW_OK) begin(m);
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

static int32_t value(const dqw_monitor_q15 *m, int weight)
{
    return m->estimator.w_q24[weight];
}

static int32_t sd(const dqw_monitor_q15 *m, int weight)
{
    return dqw_estimator_sd_q24(&m->estimator, weight);
}

// (R / cold - 1) / alpha, K
static int32_t rise_q16(const dqw_monitor_q15 *m, int32_t R_q24)
{
    return dqw_q31_sat(dqw_q_quotient64(((int64_t)R_q24 - m->is.cold_R_q24) * MILLION, m->is.cold_R_q24 * alpha_ppm(m), 16));
}

static int32_t friction_sd(const dqw_monitor_q15 *m)
{
    const uint8_t n = m->watch.reversals;
    return n >= DQW_WATCH_REVERSALS_LEAST ? dqw_q31_sat(dqw_q_root64((uint64_t)dqw_q_quotient64(m->is.spread_q48, n, 1))) : INT32_MAX;
}

// Half the difference of two stretches' mean torque, one in each direction, is friction: a load is the same on both sides of a reversal, or
// its change has no sign.
static void reversal(dqw_monitor_q15 *m, int way, int32_t torque_q24)
{
    if (dqw_watch_reversal(&m->watch, way)) {
        const int64_t half = dqw_q_round64(way * ((int64_t)torque_q24 - m->is.before_q24), 1);
        const int32_t off = dqw_q31_sat(half - m->is.friction_q24);
        const int n = m->watch.reversals;
        m->is.friction_q24 = dqw_q31_sat((int64_t)m->is.friction_q24 + off / n);
        // The first is no spread: nothing was known.
        if (n > 1) m->is.spread_q48 += dqw_q_quotient64((int64_t)off * off - m->is.spread_q48, n, 0);
    }
    m->is.before_q24 = torque_q24;
}

// What the full speed, gained in half a window, takes: of the torque at nominal flux and full current. J w / (1.5 p psi i dt half), Q24
static int64_t accelerating_q24(const dqw_estimator_q15_config *c, const dqw_units_q15 *u, uint32_t J_nkgm2, int half)
{
    const dqw_scale *s = &c->scale;
    // 1e-12 over 1e-12, in seconds; then over 1.5e-9. Up to 2^56 each, and 2^56; each stops at 2^62, and no drive comes near
    const int64_t part_q30 = dqw_q_quotient64((int64_t)J_nkgm2 * s->w_full_mrad_s, (int64_t)u->si[DQW_PSI] * s->i_full_mA, 30);
    const int64_t per_ns_q54 = dqw_q_quotient64(part_q30, (int64_t)s->dt_ns * half * 3 * s->pole_pairs, 24);
    return dqw_q_quotient64(dqw_q_times64(per_ns_q54, 2000000000, -30), c->speed_electrical ? s->pole_pairs : 1, 0);
}

// The torque that does not accelerate.
static void watch_friction(dqw_monitor_q15 *m, const dqw_estimator_q15_block *block)
{
    const bool unbroken = m->estimator.elapsed == 1;
    const dqw_estimator_q15 *t = &m->estimator;
    const uint32_t J_nkgm2 = dqw_monitor_config_of_q15(m)->J_nkgm2;
    const dqw_block_q15 b = dqw_estimator_means_q15(block);
    dqw_units_q15 n;
    (void)dqw_units_of_q15(t->config, t->pole_pairs, &n);
    const int64_t Ld = dqw_q_times64(dqw_q_quotient64(n.X_q40[0], n.psi_q40, 24), value(m, DQW_LD), -24);
    const int64_t Lq = dqw_q_times64(dqw_q_quotient64(n.X_q40[1], n.psi_q40, 24), value(m, DQW_LQ), -24);
    const int64_t flux_q24 = value(m, DQW_PSI) + dqw_q_times64(Ld - Lq, b.i_d, -28);
    const int64_t faster_q24 = dqw_q_product64(accelerating_q24(t->config, &n, J_nkgm2, t->window.half), (int64_t)b.w_m - m->is.w_before_q28, -28);
    const int32_t used_q24 = dqw_q31_sat(dqw_q_times64(flux_q24, b.i_q, -28) - faster_q24);
    m->is.w_before_q28 = b.w_m;
    const int way = b.w_m > SLOWEST_Q28 ? 1 : b.w_m < -SLOWEST_Q28 ? -1 : 0;
    // A torque of 128 times the nominal one is none.
    const bool fits = used_q24 < INT32_MAX && used_q24 > -INT32_MAX;
    const int gathered = dqw_watch_stretch(&m->watch, fits ? way : 0, unbroken);
    const int32_t part_q24 = used_q24 / DQW_WATCH_STRETCH_BLOCKS;
    m->is.gathered_q24 = gathered > 1 ? m->is.gathered_q24 + part_q24 : part_q24;
    if (gathered == DQW_WATCH_STRETCH_BLOCKS) reversal(m, way, m->is.gathered_q24);
}

// A channel's band, in the format of its reading: Q24.
static int32_t band_of(const dqw_monitor_q15 *m, int channel)
{
    const dqw_estimator_q15_config *c = &dqw_monitor_config_of_q15(m)->estimator;
    const int32_t *h = m->is.healthy_q24;
    const int64_t band = band_q24(m, channel);
    int64_t wide;
    switch (channel) {
    case DQW_WATCH_DEAD_TIME: wide = band * DQW_DEAD_TIME_Q15_PARTS; break;
    case DQW_WATCH_OFFSET: wide = band; break;
    case DQW_WATCH_RESISTANCE: wide = dqw_q_quotient64(dqw_q_times64(band, h[DQW_R], -24), 3, 0); break;
    case DQW_WATCH_REACTANCE: wide = dqw_q_quotient64(dqw_q_product64(band, dqw_witness_mean_L_q24(c, h[DQW_LD], h[DQW_LQ]), -24), 3, 0); break;
    case DQW_WATCH_SHORT: wide = dqw_q_quotient64(band, 3 * dqw_q_times64(dqw_witness_short_q40(c), h[DQW_R], -24), 40); break;
    case DQW_WATCH_ANGLE:
    case DQW_WATCH_FRICTION: wide = dqw_q_product64(band, h[DQW_PSI], -24); break;
    default: wide = dqw_q_product64(band, h[channel], -24); break;
    }
    return dqw_q31_sat(wide);
}

typedef struct {
    int32_t now, change, sd;  // in the format of the event
} reading;

static int32_t q24_of(int32_t x_q28)
{
    return x_q28 == INT32_MAX ? INT32_MAX : dqw_q_floor32(x_q28, 4);
}

static int32_t difference(int32_t a, int32_t b)
{
    return dqw_q31_sat((int64_t)a - b);
}

static uint32_t residual_q27(const dqw_monitor_q15 *m)
{
    return dqw_q_root64((uint64_t)m->estimator.recent_q54);
}

// Value, its change from the healthy one, and its deviation, of a channel; of temperature and residual the change is the value.
static reading read_channel(const dqw_monitor_q15 *m, int channel)
{
    reading r;
    if (channel < DQW_PARAMETERS) {
        r.now = value(m, channel);
        r.change = difference(r.now, m->is.healthy_q24[channel]);
        r.sd = sd(m, channel);
    } else if (channel < DQW_WATCH_FRICTION) {
        const int k = channel - DQW_WATCH_OFFSET;
        const int32_t re = difference(m->witness.re_q28[k], m->is.healthy_re_q28[k]);
        const int32_t im = difference(m->witness.im_q28[k], m->is.healthy_im_q28[k]);
        r.now = q24_of(dqw_witness_size_q28(&m->witness, (enum dqw_witness_input_q15)k));
        r.change = q24_of(dqw_q_length32(re, im));
        r.sd = q24_of(dqw_witness_sd_q28(&m->witness, &m->estimator, (enum dqw_witness_input_q15)k));
    } else if (channel == DQW_WATCH_FRICTION) {
        r.now = m->is.friction_q24;
        r.change = difference(r.now, m->is.healthy_friction_q24);
        r.sd = friction_sd(m);
    } else if (channel == DQW_WATCH_TEMPERATURE) {
        const int32_t sd_R = sd(m, DQW_R);
        r.now = r.change = rise_q16(m, value(m, DQW_R));
        r.sd = sd_R == INT32_MAX ? INT32_MAX : dqw_q31_sat(dqw_q_quotient64((int64_t)sd_R * MILLION, m->is.cold_R_q24 * alpha_ppm(m), 16));
    } else {
        r.now = r.change = (int32_t)(residual_q27(m) >> 3);
        r.sd = 0;
    }
    return r;
}

// The healthy value moves to the present one by one part in n.
static void nearer(int32_t *healthy, int32_t now, int n)
{
    *healthy = dqw_q31_sat(*healthy + dqw_q_quotient64((int64_t)now - *healthy, n, 0));
}

static void move_healthy(dqw_monitor_q15 *m, int channel, int n)
{
    if (channel < DQW_PARAMETERS) {
        nearer(&m->is.healthy_q24[channel], value(m, channel), n);
    } else if (channel < DQW_WATCH_FRICTION) {
        const int k = channel - DQW_WATCH_OFFSET;
        nearer(&m->is.healthy_re_q28[k], m->witness.re_q28[k], n);
        nearer(&m->is.healthy_im_q28[k], m->witness.im_q28[k], n);
    } else {
        nearer(&m->is.healthy_friction_q24, m->is.friction_q24, n);
    }
}

static bool within_part(int32_t deviation, int32_t part_q15, int32_t band)
{
    return deviation != INT32_MAX && (int64_t)deviation * 32768 < (int64_t)part_q15 * band;
}

// A healthy value is the mean over the first looks at which it is known, as long as nothing seems to change.
static void settle(dqw_monitor_q15 *m, int channel)
{
    if (channel == DQW_WATCH_FRICTION) {
        if (dqw_watch_friction_settles(&m->watch)) move_healthy(m, channel, 1);
        return;
    }
    if (!dqw_watch_settles(&m->watch, channel)) return;
    const uint8_t looks = m->watch.looks[channel];
    const int32_t part_q15 = channel > DQW_WATCH_ANGLE ? KNOWN_PART_WITNESS_Q15 : channel == DQW_WATCH_PSI ? KNOWN_PART_FLUX_Q15 : KNOWN_PART_Q15;
    const bool known_now = within_part(read_channel(m, channel).sd, part_q15, band_of(m, channel));
    if (known_now) m->watch.looks[channel]++;
    if (known_now || looks == 0) move_healthy(m, channel, looks + 1);
}

// Healthy values as they are now.
static void adopt(dqw_monitor_q15 *m)
{
    for (int i = 0; i < DQW_WATCH_TEMPERATURE; i++) move_healthy(m, i, 1);
    const int64_t floor_q27 = dqw_q_quotient64(or_else(dqw_monitor_config_of_q15(m)->residual_floor_ppm, FLOOR_PPM), MILLION, 27);
    const int64_t floor_q54 = floor_q27 * floor_q27;  // up to 2^54
    m->is.healthy_residual_q54 = m->estimator.recent_q54 > floor_q54 ? m->estimator.recent_q54 : floor_q54;
    dqw_watch_adopt(&m->watch, m->estimator.number);
}

static void begin_rest(dqw_monitor_q15 *m)
{
    adopt(m);
    dqw_watch_rest(&m->watch);
}

// What heat can have made of R or the flux since its healthy value last followed, Q24.
static int32_t heat_since(const dqw_monitor_q15 *m, int channel)
{
    const dqw_monitor_q15_config *c = dqw_monitor_config_of_q15(m);
    const bool flux = channel == DQW_WATCH_PSI;
    const int64_t halves = dqw_watch_unfollowed(&m->watch, channel, m->estimator.number);
    // Millionths by mK up to 2^40, by 13 over 10^10; ns up to 2^30 by 2^31
    const int64_t rate_q40 = dqw_q_quotient64((flux ? beta_ppm(m) : alpha_ppm(m)) * or_else(c->heating_mK_s, HEATING_MK_S) * SLACK_TENTHS, 10000000000, 40);
    const int64_t time_q20 = dqw_q_quotient64((int64_t)c->estimator.scale.dt_ns * ((halves << DQW_WATCH_FOLLOW_SHIFT) * m->estimator.window.half), 1000000000,
                                              20);
    return dqw_q31_sat(dqw_q_product64(dqw_q_product64(rate_q40, flux ? m->is.cold_psi_q24 : m->is.cold_R_q24, -40), time_q20, -20));
}

// Healthy R or flux goes with the measured one, no faster than heat can. Not while the measured one is unsure: it would follow noise.
static void follow(dqw_monitor_q15 *m, int channel)
{
    const int32_t bound = heat_since(m, channel);
    const bool flux = channel == DQW_WATCH_PSI;
    if (bound <= 0 || !within_part(sd(m, channel), flux ? KNOWN_PART_FLUX_Q15 : KNOWN_PART_Q15, band_of(m, channel))) return;
    const int32_t off = difference(value(m, channel), m->is.healthy_q24[channel]);
    m->is.healthy_q24[channel] += off > bound ? bound : off < -bound ? -bound : off;
    dqw_watch_follow(&m->watch, channel, m->estimator.number);
}

// The flux no further than the winding's heat explains, now or a while ago.
static void follow_temperature(dqw_monitor_q15 *m)
{
    follow(m, DQW_WATCH_R);
    follow(m, DQW_WATCH_PSI);
    const int32_t rise = rise_q16(m, m->is.healthy_q24[DQW_R]);
    m->is.hottest_q16 -= m->is.hottest_q16 / HOTTEST_FORGETS;
    if (rise > m->is.hottest_q16) m->is.hottest_q16 = rise;
    // 2^20 by 2^31 by 2^4
    const int64_t lost_q24 = dqw_q_quotient64(beta_ppm(m) * m->is.hottest_q16 * SLACK_TENTHS, (int64_t)10 * MILLION, 8) +
                             dqw_q_round64(band_q24(m, DQW_WATCH_PSI), 1);
    const int32_t coldest = dqw_q31_sat(dqw_q_product64(ONE_Q24 - lost_q24, m->is.cold_psi_q24, -24));
    if (m->is.healthy_q24[DQW_PSI] < coldest) m->is.healthy_q24[DQW_PSI] = coldest;
}

// Size of a channel's change over its band, Q5; 0 where it is not known.
static int32_t deviation_q5(const dqw_monitor_q15 *m, int channel)
{
    const int64_t most = (int64_t)100 * DQW_CHANGE_BAND_Q5;
    int64_t q5;
    if (channel == DQW_WATCH_TEMPERATURE) {
        if (sd(m, DQW_R) >= band_of(m, DQW_WATCH_R)) return 0;
        const int64_t above_q16 = rise_q16(m, value(m, DQW_R)) - dqw_q_round64(band_q24(m, channel), 8);
        q5 = dqw_q_quotient64(above_q16 + (int64_t)TEMPERATURE_BAND_K * ONE_Q16, TEMPERATURE_BAND_K, -11);
    } else if (channel == DQW_WATCH_RESIDUAL) {
        const int64_t ratio_q10 = dqw_q_root64((uint64_t)dqw_q_quotient64(m->estimator.recent_q54, m->is.healthy_residual_q54, 20));
        q5 = dqw_q_quotient64(ratio_q10, band_q24(m, channel), 19);
    } else {
        const reading r = read_channel(m, channel);
        const int looks = m->watch.looks[channel];
        if (looks < DQW_WATCH_LOOKS_LEAST || r.sd == INT32_MAX) return 0;
        const int64_t width = band_of(m, channel);
        // The healthy value has a deviation too: less, the more looks it is the mean of.
        const int32_t one_q30 = 1 << 30;
        const uint32_t wider_q15 = dqw_q_root64((uint64_t)one_q30 + (uint64_t)(one_q30 / (DQW_WATCH_LOOKS_ALIKE + looks) * DQW_WATCH_LOOKS_ALIKE));
        const int64_t sure = dqw_q_round64((int64_t)r.sd * DEVIATIONS * wider_q15, 15);
        // What heat may have made of it meanwhile is no change.
        const int64_t heat = channel == DQW_WATCH_R || channel == DQW_WATCH_PSI ? heat_since(m, channel) : 0;
        const int64_t size = r.change < 0 ? -(int64_t)r.change : r.change;
        q5 = dqw_q_quotient64(size - heat, width > sure ? width : sure, 5);
    }
    return (int32_t)(q5 < 0 ? 0 : q5 < most ? q5 : most);
}

// A change of a third of a band is none.
static int32_t least_of(int32_t deviation, int32_t band)
{
    return deviation == INT32_MAX ? INT32_MAX : dqw_q_length32(deviation, band / 3);
}

static int32_t over(int32_t a, int32_t b_q24)
{
    return a == INT32_MAX ? INT32_MAX : dqw_q31_sat(dqw_q_quotient64(a, b_q24, 24));
}

static dqw_fault_verdict_q15 name_it(const dqw_monitor_q15 *m)
{
    int32_t change_q24[DQW_SIGNS];
    int32_t unit_q24[DQW_SIGNS];
    for (int channel = 0; channel < DQW_WATCH_FRICTION; channel++) {
        const reading r = read_channel(m, channel);
        const int32_t least = least_of(r.sd, band_of(m, channel));
        if (channel < DQW_PARAMETERS) {
            const int32_t *h = m->is.healthy_q24;
            const int32_t scale = channel == DQW_WATCH_ANGLE ? h[DQW_PSI] : channel == DQW_WATCH_DEAD_TIME ? ONE_Q24 : h[channel];
            change_q24[channel] = over(r.change, scale);
            unit_q24[channel] = over(least, scale);
        } else {
            const int k = channel - DQW_WATCH_OFFSET;
            const int at = DQW_SIGN_OFFSET_RE + 2 * k;
            change_q24[at] = dqw_q_floor32(difference(m->witness.re_q28[k], m->is.healthy_re_q28[k]), 4);
            change_q24[at + 1] = dqw_q_floor32(difference(m->witness.im_q28[k], m->is.healthy_im_q28[k]), 4);
            unit_q24[at] = unit_q24[at + 1] = least;
        }
    }
    const dqw_estimator_q15_config *c = m->estimator.config;
    const dqw_fault_machine_q15 machine = {m->is.healthy_q24[DQW_R], dqw_witness_mean_L_q24(c, m->is.healthy_q24[DQW_LD], m->is.healthy_q24[DQW_LQ]),
                                           dqw_witness_short_q40(c)};
    return dqw_fault_name_it_q15(change_q24, unit_q24, machine);
}

static uint32_t ppm(uint32_t ratio_q27)
{
    return (uint32_t)(((uint64_t)ratio_q27 * MILLION) >> 27);  // up to 32 millions
}

static void tell(const dqw_monitor_q15 *m, int channel, dqw_monitor_event_q15 *event)
{
    const reading r = read_channel(m, channel);
    event->value = r.now;
    event->sd = r.sd;
    event->half = m->estimator.number;
    event->since = m->estimator.number - (uint32_t)dqw_watch_since(&m->watch, channel) * DQW_WATCH_TICK_BLOCKS;
    event->parameter = (enum dqw_monitor_channel)channel;
    const enum dqw_fault_name of_channel = dqw_watch_fault_of(channel, r.change > 0);
    const dqw_fault_verdict_q15 sure = {.name = of_channel, .confidence_q15 = SURE_Q15, .phase = 0};
    event->fault = of_channel != DQW_FAULT_NONE ? sure : name_it(m);
}

// Where a temperature counts from, after what has broken.
static void recount(int32_t *cold, int32_t now, int32_t healthy)
{
    *cold = dqw_q31_sat(dqw_q_product64(dqw_q_quotient64(now, healthy, 24), *cold, -24));
}

static bool look(dqw_monitor_q15 *m, dqw_monitor_event_q15 *event)
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
    const int worst = dqw_watch_worst(&m->watch, q5, ppm(residual_q27(m)) > m->estimator.stage.threshold_ppm);
    if (worst < 0) return false;
    tell(m, worst, event);
    const enum dqw_watch_follows follows = dqw_watch_named(&m->watch, worst, event->fault.name);
    if (follows == DQW_WATCH_LATER) return false;
    if (follows == DQW_WATCH_APART) {
        if (worst == DQW_WATCH_FRICTION) move_healthy(m, worst, 1);
        return true;
    }
    // Temperatures go on counting from where they were: what has broken is not what has heated.
    const enum dqw_fault_name name = event->fault.name;
    if (name == DQW_FAULT_PHASE_CONNECTION || name == DQW_FAULT_CURRENT_GAIN) recount(&m->is.cold_R_q24, value(m, DQW_R), m->is.healthy_q24[DQW_R]);
    recount(&m->is.cold_psi_q24, value(m, DQW_PSI), m->is.healthy_q24[DQW_PSI]);
    begin_rest(m);
    return true;
}

static void enter_service(dqw_monitor_q15 *m)
{
    const bool commissioned = dqw_monitor_config_of_q15(m)->commissioned;
    dqw_units_q15 u;
    (void)dqw_units_of_q15(m->estimator.config, m->estimator.pole_pairs, &u);
    m->is.cold_R_q24 = commissioned ? u.w_q24[DQW_R] : value(m, DQW_R);
    m->is.cold_psi_q24 = commissioned ? u.w_q24[DQW_PSI] : value(m, DQW_PSI);
    m->is.hottest_q16 = 0;
    begin_rest(m);
}

static bool known(const dqw_monitor_q15 *m)
{
    // L_d shows only where i_d is not 0: without it the other three are watched.
    for (int i = 0; i <= DQW_PSI; i++)
        if (i != DQW_LD && (int64_t)sd(m, i) * SERVICE_PARTS >= value(m, i)) return false;
    return true;
}

// Fig. 1: which stage, after a block.
static void stage(dqw_monitor_q15 *m)
{
    const dqw_stage *now = &m->estimator.stage;
    const uint32_t recent_ppm = ppm(residual_q27(m));
    if (now->name == DQW_STAGE_IN_SERVICE) {
        // A residual above the threshold is named first: a sudden fault is one too.
        if (recent_ppm > now->threshold_ppm) dqw_watch_alarm_residual(&m->watch);
        if (m->watch.back) dqw_estimator_stage_on_q15(&m->estimator, true);
        m->watch.back = false;
        return;
    }
    if (now->name == DQW_STAGE_ORDINAL && recent_ppm <= now->threshold_ppm && !known(m)) return;
    dqw_estimator_stage_on_q15(&m->estimator, true);
    if (now->name == DQW_STAGE_IN_SERVICE) enter_service(m);
}

bool dqw_monitor_background_q15(dqw_monitor_q15 *m, dqw_monitor_event_q15 *event)
{
    dqw_estimator_q15_block b;
    const enum dqw_stage_name before = m->estimator.stage.name;
    if (!dqw_estimator_take_q15(&m->estimator, &b) || before == DQW_STAGE_DOMAIN) return false;

    // [MON.1] learn
    const bool learned = dqw_estimator_learn_q15(&m->estimator, &b);
    if (dqw_monitor_config_of_q15(m)->J_nkgm2 > 0) watch_friction(m, &b);
    if (!learned) return false;
    dqw_watch_learned(&m->watch, m->estimator.number);
    (void)dqw_witness_learn_q15(&m->witness, &m->estimator, &b);

    // [MON.2] the stage
    if (before != DQW_STAGE_RANDOM) stage(m);
    if (m->estimator.stage.name != DQW_STAGE_IN_SERVICE) return false;

    // [MON.3] every so often, a look at every channel
    return dqw_watch_block(&m->watch) && look(m, event);
}
