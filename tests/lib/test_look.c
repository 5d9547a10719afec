// One look of the monitor, from the state before it, against (E63) in double: which healthy values settle and follow,
// how far each channel is off, what is named, and what comes after. And why nothing is watched.
#include "dqw_estimator_block.h"
#include "dqw_fault.h"
#include "dqw_monitor_channel.h"
#include "dqw_watch.h"
#include "dqw_witness.h"
#include "moving_joint.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

enum { ROWS = 10800 };
static dqw_monitor_config config;
static dqw_monitor learned;
static long row;
static test_random noise = {750};

static dqw_sample sample(void)
{
    dqw_sample s = moving(row, 0.5, 0.01, &noise);
    const double angle = 4 * 70 / (2 * PI * 3) * (1 - cos(2 * PI * 3 * (double)row * DT_S));
    s.cosine = (float)cos(angle), s.sine = (float)sin(angle);
    row++;
    return s;
}

// A monitor that has learned its machine, up to where a block waits that ends a look.
static void learn(void)
{
    const dqw_monitor_config given = {.estimator = {.dt_s = (float)DT_S,
                                                    .v_base_V = 14.0f,
                                                    .i_base_A = 6.0f,
                                                    .w_base_rad_s = 110.0f,
                                                    .R_ohm = 0.5f,
                                                    .Ld_H = 1e-3f,
                                                    .Lq_H = 1.4e-3f,
                                                    .psi_Wb = 0.02f,
                                                    .pole_pairs = 4,
                                                    .dead_time_width_A = 0.05f,
                                                    .threshold_ppm = 4000000,
                                                    .angle = true,
                                                    .encoder_offset = true,
                                                    .noise_on_inputs = true},
                                      .J_kgm2 = 1e-5f};
    config = given;
    if (learned.config != NULL) return;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_monitor_init(&learned, &config));
    for (int k = 0; k < ROWS || !learned.estimator.window.over.pending; k++) {
        const dqw_sample s = sample();
        if (k < ROWS) (void)dqw_monitor_background(&learned);
        (void)dqw_monitor_sample(&learned, &s, false);
    }
    learned.estimator.stage.name = DQW_STAGE_IN_SERVICE;
}

// In service, and nothing shows: healthy values near what is measured, or far from it.
static dqw_monitor watching(test_random *r)
{
    dqw_monitor m = learned;
    dqw_watch_init(&m.watch);
    m.watch.blocks = DQW_WATCH_TICK_BLOCKS - 1;
    m.watch.learned_at = m.estimator.number;
    m.has_change = false;
    for (int i = 0; i < DQW_WATCH_OFFSET; i++) {
        const double now = (double)dqw_estimator_value(&m.estimator, i);
        const double band = (double)dqw_monitor_band_of(&m, i);
        m.healthy.weight[i] = (float)(now + band * random_uniform(r, -1, 1) * (random_bits(r) % 3 == 0 ? 3 : 0.4));
    }
    for (int k = 0; k < DQW_WITNESS_INPUTS; k++) {
        const double band = (double)dqw_monitor_band_of(&m, DQW_WATCH_OFFSET + k);
        m.healthy.re[k] = m.witness.re[k] + (float)(band * random_uniform(r, -2, 2));
        m.healthy.im[k] = m.witness.im[k] + (float)(band * random_uniform(r, -2, 2));
    }
    m.healthy.cold_R_ohm = (float)random_uniform(r, 0.35, 0.55);
    m.healthy.cold_psi_Wb = (float)random_uniform(r, 0.019, 0.022);
    m.healthy.hottest_K = (float)random_uniform(r, 0, 60);
    m.healthy.residual_pu2 = m.estimator.recent_pu2 * (float)random_uniform(r, 0.5, 2);
    m.healthy.friction_Nm = 0.01f;
    m.friction_Nm = 0.012f;
    m.spread_Nm2 = 1e-8f;
    for (int i = 0; i < DQW_WATCH_TEMPERATURE; i++) {
        static const uint8_t looks[] = {0, 1, 18, 19, 20, 21, 100, 253, 254, 255};
        m.watch.looks[i] = looks[random_bits(r) % 10];
        if (random_bits(r) % 4 == 0) m.watch.change[i].sum_q5 = 40;
    }
    m.watch.reversals = (uint8_t)(random_bits(r) % (DQW_WATCH_REVERSALS_MOST + 1));
    m.estimator.segment.segments = (uint16_t)(random_bits(r) % 2 ? 19 : 20);
    for (int i = 0; i < 2; i++)
        m.watch.followed[i] = (uint16_t)((m.estimator.number >> DQW_WATCH_FOLLOW_SHIFT) -
                                         (random_bits(r) % 2 ? 0 : random_bits(r) % 40));
    return m;
}

// Up to the look.
// Whether the block taught ripples as well.
static bool before_the_look(dqw_monitor *m)
{
    dqw_estimator_block b;
    HOLDS(dqw_estimator_take(&m->estimator, &b) && dqw_estimator_learn(&m->estimator, &b));
    dqw_watch_learned(&m->watch, m->estimator.number);
    const bool witnessed = dqw_witness_learn(&m->witness, &m->estimator, &b);
    HOLDS(dqw_watch_block(&m->watch));
    return witnessed;
}

// No map here.
static double value(const dqw_monitor *m, int i)
{
    return dqw_watch_is_map(i) ? 0 : (double)dqw_estimator_value(&m->estimator, i);
}
static double band_of(const dqw_monitor *m, int i) { return (double)dqw_monitor_band_of(m, i); }
static double rise_K(const dqw_monitor *m, double R_ohm)
{
    return (R_ohm / (double)m->healthy.cold_R_ohm - 1) / (double)dqw_monitor_alpha(m);
}

// What heat may have made of it since it was followed last, a third more.
static double heat(const dqw_monitor *m, int channel)
{
    const bool flux = channel == DQW_WATCH_PSI;
    const double a_kelvin = flux ? (double)(dqw_monitor_beta(m) * m->healthy.cold_psi_Wb)
                                 : (double)(dqw_monitor_alpha(m) * m->healthy.cold_R_ohm);
    const double heating_K_s = config.heating_K_s > 0 ? (double)config.heating_K_s : 1;
    const double steps = (uint16_t)((m->estimator.number >> 8) - m->watch.followed[flux]);
    return 1.3 * a_kelvin * heating_K_s * steps * 256 * m->estimator.window.half * DT_S;
}

static void follow(dqw_monitor *m, int channel)
{
    const double most = heat(m, channel);
    const double known = (channel == DQW_WATCH_PSI ? 0.4 : 0.2) * band_of(m, channel);
    if (most <= 0 || (double)dqw_estimator_sd(&m->estimator, channel) >= known) return;
    const double off = value(m, channel) - (double)m->healthy.weight[channel];
    m->healthy.weight[channel] += (float)fmax(-most, fmin(most, off));
    m->watch.followed[channel == DQW_WATCH_PSI] = (uint16_t)(m->estimator.number >> 8);
}

static double off_bands(const dqw_monitor *m, int channel)
{
    if (channel == DQW_WATCH_TEMPERATURE)
        return dqw_monitor_knows_heat(m) ? (rise_K(m, value(m, DQW_R)) - (double)dqw_monitor_band(m, channel)) / 5 + 1
                                         : 0;
    if (channel == DQW_WATCH_RESIDUAL)
        return sqrt((double)(m->estimator.recent_pu2 / m->healthy.residual_pu2)) / (double)dqw_monitor_band(m, channel);
    dqw_monitor_channel_value x;
    dqw_monitor_read_channel(m, channel, &x);
    const double sure = (double)dqw_monitor_surely(m, channel, x.sd);
    if (m->watch.looks[channel] < 20 || sure >= (double)DQW_UNKNOWN) return 0;
    const bool heats = channel == DQW_WATCH_R || channel == DQW_WATCH_PSI;
    return (fabs((double)x.change) - (heats ? heat(m, channel) : 0)) / sure;
}

static int32_t q5(double bands) { return bands > 0 ? (int32_t)(32 * fmin(bands, 100)) : 0; }

static void settle(dqw_monitor *m, int channel)
{
    if (dqw_watch_is_map(channel)) return;
    if (channel == DQW_WATCH_FRICTION) {
        if (m->watch.looks[channel] == 255 || m->watch.change[channel].sum_q5 != 0) return;
        m->watch.looks[channel] = m->watch.reversals < DQW_WATCH_REVERSALS_MOST ? 0 : 255;
        m->healthy.friction_Nm = m->friction_Nm;
        return;
    }
    dqw_monitor_channel_value x;
    dqw_monitor_read_channel(m, channel, &x);
    const double sd = (double)x.sd;
    const double part = channel >= DQW_WATCH_OFFSET ? 0.5 : channel == DQW_WATCH_PSI ? 0.4 : 0.2;
    const bool well = sd < part * band_of(m, channel);
    uint8_t *looks = &m->watch.looks[channel];
    // 63 coarse ones at most; the first that is known well is taken whatever it is, and counts for 64.
    int n = 1;
    if (well && *looks <= 63) {
        *looks = 64;
    } else {
        if (*looks == 255 || m->watch.change[channel].sum_q5 != 0 || q5(off_bands(m, channel)) > 16) return;
        if (well) {
            n = ++*looks - 63;
        } else if (*looks > 63) {
            return;
        } else if (sd < 1.5 * band_of(m, channel)) {
            n = *looks < 63 ? ++*looks : 63;
        } else if (*looks != 0) {
            return;
        }
    }
    const double before = channel <= DQW_WATCH_PSI ? (double)m->healthy.weight[channel] : 0;
    const double take = 1.0 / n;
    if (channel < DQW_WATCH_OFFSET) {
        m->healthy.weight[channel] += (float)(take * (value(m, channel) - (double)m->healthy.weight[channel]));
    } else {
        const int k = channel - DQW_WATCH_OFFSET;
        m->healthy.re[k] += (float)(take * (double)(m->witness.re[k] - m->healthy.re[k]));
        m->healthy.im[k] += (float)(take * (double)(m->witness.im[k] - m->healthy.im[k]));
    }
    if (n > 20 || config.commissioned) return;
    const double by = channel <= DQW_WATCH_PSI ? (double)m->healthy.weight[channel] / before : 1;
    if (channel == DQW_WATCH_R) m->healthy.cold_R_ohm *= (float)by;
    if (channel == DQW_WATCH_PSI) m->healthy.cold_psi_Wb *= (float)by;
}

static void alike(float expected, float value, const char *what)
{
    const double room = 2e-5 * fabs((double)expected) + 5e-9;
    test_between((double)expected - room, (double)value, (double)expected + room, what, __LINE__);
}

static void same_healthy(const dqw_monitor *expected, const dqw_monitor *m)
{
    for (int i = 0; i < DQW_WATCH_OFFSET; i++) alike(expected->healthy.weight[i], m->healthy.weight[i], "weight");
    for (int k = 0; k < DQW_WITNESS_INPUTS; k++) {
        alike(expected->healthy.re[k], m->healthy.re[k], "witness");
        alike(expected->healthy.im[k], m->healthy.im[k], "witness");
    }
    alike(expected->healthy.cold_R_ohm, m->healthy.cold_R_ohm, "cold R");
    alike(expected->healthy.cold_psi_Wb, m->healthy.cold_psi_Wb, "cold flux");
    alike(expected->healthy.hottest_K, m->healthy.hottest_K, "hottest");
    alike(expected->healthy.residual_pu2, m->healthy.residual_pu2, "residual");
    alike(expected->healthy.friction_Nm, m->healthy.friction_Nm, "friction");
    TEST_ASSERT_EQUAL_MEMORY_MESSAGE(expected->watch.looks, m->watch.looks, sizeof m->watch.looks, test_case);
    TEST_ASSERT_EQUAL_MEMORY_MESSAGE(expected->watch.followed, m->watch.followed, sizeof m->watch.followed, test_case);
}

static void test_a_look(void)
{
    learn();
    test_random r = {751};
    for (int k = 0; k < 1500; k++) {
        config.estimator.follow = k % 2 == 1;
        config.commissioned = k % 5 == 0;
        config.heating_K_s = k % 7 == 0 ? 0.3f : 0;
        dqw_monitor m = watching(&r);
        // A block that teaches no ripple: nobody knows its angle.
        if (k % 3 == 1) m.estimator.rise_cosine = m.estimator.rise_sine = 0.0f;
        // Deviations from well within a band to beyond it.
        const double noisier = k % 4 == 3 ? pow(10, (k / 4) % 100 * 0.06) : 1;
        for (int i = 0; i < 2; i++) m.estimator.error_pu2[i] *= (float)noisier;
        dqw_monitor expected = m;
        CASE("look %d", k);
        m.watch.back = k % 3 == 0;
        HOLDS(!dqw_monitor_background(&m));
        // With a residual in its band it stays in service, and the wish is forgotten.
        HOLDS(!m.watch.back && m.estimator.stage.name == DQW_STAGE_IN_SERVICE);
        const bool witnessed = before_the_look(&expected);
        HOLDS(witnessed == (k % 3 != 1));
        dqw_monitor *x = &expected;
        HOLDS(dqw_watch_begin(&x->watch) == DQW_WATCH_SETTLES);
        follow(x, DQW_WATCH_R);
        follow(x, DQW_WATCH_PSI);
        const double hottest_K = fmax(0.99999 * (double)x->healthy.hottest_K, rise_K(x, (double)x->healthy.weight[0]));
        x->healthy.hottest_K = (float)hottest_K;
        const double least = (double)x->healthy.cold_psi_Wb * (1 - 1.3 * (double)dqw_monitor_beta(x) * hottest_K -
                                                               (double)dqw_monitor_band(x, DQW_WATCH_PSI) / 2);
        x->healthy.weight[DQW_PSI] = (float)fmax((double)x->healthy.weight[DQW_PSI], least);
        const double most = (double)x->healthy.residual_pu2 * (x->estimator.segment.segments < 20 ? 1.1 : 1.005);
        if (config.estimator.follow && x->estimator.recent_pu2 > x->healthy.residual_pu2)
            x->healthy.residual_pu2 = (float)fmin((double)x->estimator.recent_pu2, most);
        // What is left while R does not stand is no ripple.
        const bool ripples = witnessed && x->watch.looks[DQW_WATCH_R] >= 20;
        for (int i = 0; i < DQW_WATCH_TEMPERATURE; i++)
            if (ripples || i < DQW_WATCH_OFFSET || i >= DQW_WATCH_FRICTION) settle(x, i);
        same_healthy(x, &m);
        for (int i = 0; i < DQW_WATCH_CHANNELS; i++) {
            const int bounded = q5(off_bands(x, i));
            const int sum = x->watch.change[i].sum_q5 + (bounded < 128 ? bounded : 128) - 32;
            CASE("look %d, channel %d: %d", k, i, sum);
            // Heat counts while the residual is in its band.
            if (i == DQW_WATCH_TEMPERATURE && q5(off_bands(x, DQW_WATCH_RESIDUAL)) >= 32) continue;
            BETWEEN(fmin(160, fmax(0, sum - 1)), m.watch.change[i].sum_q5, fmin(160, fmax(0, sum + 1)));
            if (sum > 0 && sum < 159) HOLDS((m.watch.alarms >> i & 1u) == 0);
            if (sum > 161) HOLDS((m.watch.alarms >> i & 1u) == 1);
        }
    }
}

// (E64): each change over its deviation, of a third of a band at least; parts of the healthy values, of dead time
// volts, of the angle radians.
static dqw_fault_verdict named(const dqw_monitor *m)
{
    float change[DQW_SIGNS];
    float unit[DQW_SIGNS];
    for (int i = 0; i < DQW_WATCH_FRICTION; i++) {
        dqw_monitor_channel_value x;
        dqw_monitor_read_channel(m, i, &x);
        const double least = hypot((double)x.sd, band_of(m, i) / 3);
        const bool known = (double)x.sd < (double)DQW_UNKNOWN && m->watch.looks[i] >= 20;
        if (dqw_watch_is_map(i)) {
            change[i] = 0;
            unit[i] = DQW_UNKNOWN;
        } else if (i < DQW_WATCH_OFFSET) {
            // What the gain has let it follow of a change, two rows a block, since it showed.
            const dqw_estimator *e = &m->estimator;
            const int w = dqw_watch_weight(i);
            const double rows = 2.0 * (double)(e->number - m->named_since);
            const double share = fmin(1, 0.05 + rows * (double)dqw_gain_covariance(&e->gain, w, w) *
                                                    (double)e->alone_pu2[w]);
            const double of = share *
                              (i == DQW_WATCH_DEAD_TIME ? 1 : (double)m->healthy.weight[i == DQW_WATCH_ANGLE ? 3 : i]);
            change[i] = (float)((value(m, i) - (double)m->healthy.weight[i]) / of);
            unit[i] = known ? (float)(least / fabs(of)) : DQW_UNKNOWN;
        } else {
            const int k = i - DQW_WATCH_OFFSET;
            float *at = &change[DQW_SIGN_OFFSET_RE + 2 * k];
            at[0] = m->witness.re[k] - m->healthy.re[k], at[1] = m->witness.im[k] - m->healthy.im[k];
            unit[DQW_SIGN_OFFSET_RE + 2 * k] = unit[DQW_SIGN_OFFSET_RE + 2 * k + 1] = known ? (float)least
                                                                                            : DQW_UNKNOWN;
        }
    }
    // (E177): a phase's ripple as it is at the speed that its input remembers.
    const double w_e = m->witness.power[1] > 0 ? (double)m->witness.across / (double)m->witness.power[1] : 0;
    const float *gain = &change[DQW_SIGN_REACTANCE_RE];
    change[DQW_SIGN_RESISTANCE_RE] -= (float)(w_e * (double)gain[1]);
    change[DQW_SIGN_RESISTANCE_IM] += (float)(w_e * (double)gain[0]);
    const dqw_fault_machine machine = {m->healthy.weight[DQW_R],
                                       (m->healthy.weight[DQW_LD] + m->healthy.weight[DQW_LQ]) / 2, (float)w_e,
                                       m->config->estimator.observed, m->healthy.weight[DQW_DEAD_TIME]};
    return dqw_fault_name_it(change, unit, machine);
}

// What is named: its channel as it is read, since when it has shown, and the fault; then all is healthy as it is now.
static void test_what_is_named(void)
{
    learn();
    test_random r = {752};
    int events = 0;
    int faults[DQW_FAULT_UNKNOWN + 1] = {0};
    for (int k = 0; k < 1000; k++) {
        config.estimator.follow = false;
        config.commissioned = false;
        config.heating_K_s = 0;
        dqw_monitor m = watching(&r);
        const int drawn = (int)(random_bits(&r) % DQW_WATCH_TEMPERATURE);
        const int channel = dqw_watch_is_map(drawn) ? drawn + 2 : drawn;  // no map here
        for (int i = 0; i < DQW_WATCH_TEMPERATURE; i++) {
            // Some have no healthy value yet: they say nothing of its name.
            m.watch.looks[i] = i != channel && (k + i) % 7 == 3 ? 19 : 255;
            m.watch.change[i].above = 7;
        }
        if (channel < DQW_WATCH_OFFSET)
            m.healthy.weight[channel] *= (float)(channel == DQW_WATCH_PSI ? 1.05 : random_uniform(&r, 1.3, 1.6));
        else if (channel < DQW_WATCH_FRICTION)
            m.witness.re[channel - DQW_WATCH_OFFSET] += (float)(6 * band_of(&m, channel));
        else
            m.friction_Nm = m.healthy.friction_Nm + (float)((k % 2 ? 9 : -9) * band_of(&m, channel));
        m.watch.reversals = DQW_WATCH_REVERSALS_MOST;
        // Weights have followed all of a change that showed long ago, a part of one that has only begun; and all together
        // may look like one factor.
        const uint32_t looks = k % 2 ? 100 : (uint32_t)(k / 2 % 30);
        m.watch.change[channel].above = (uint8_t)looks;
        for (int i = 0; i <= DQW_WATCH_DEAD_TIME && k % 3 == 0; i++)
            if (i != channel) m.healthy.weight[i] *= (float)random_uniform(&r, 1.05, 1.15);
        // The last look before it is named, whatever its name: it has waited as often as it may.
        m.watch.alarms = (uint16_t)(1u << channel);
        m.watch.extended = 6;
        m.watch.wait = 1;
        dqw_monitor expected = m;
        CASE("name %d, channel %d", k, channel);
        const bool told = dqw_monitor_background(&m);
        (void)before_the_look(&expected);
        dqw_monitor *x = &expected;
        int worst = -1;
        double most = 1;
        for (int i = 0; i < DQW_WATCH_CHANNELS; i++) {
            // What is as bad by rounding is left alone.
            const bool alarmed = i == channel || x->watch.change[i].sum_q5 + fmin(128, q5(off_bands(x, i))) >= 192;
            if (alarmed && off_bands(x, i) > most) worst = i, most = off_bands(x, i);
        }
        if (worst != channel || most < 1.2) continue;
        HOLDS(told && m.has_change);
        events++;
        dqw_monitor_change c;
        HOLDS(dqw_monitor_event(&m, &c) && !dqw_monitor_event(&m, &c));
        dqw_monitor_channel_value now;
        dqw_monitor_read_channel(x, channel, &now);
        HOLDS((int)c.parameter == channel && c.value == now.now && c.sd == now.sd);
        HOLDS(c.sample == (uint64_t)x->estimator.number * 20 &&
              c.since == (uint64_t)(x->estimator.number - (looks + 1) * 16) * 20);
        const int w = channel - DQW_WATCH_OFFSET;
        const double healthy = channel < DQW_WATCH_OFFSET ? (double)x->healthy.weight[channel]
                               : channel == DQW_WATCH_FRICTION
                                   ? (double)x->healthy.friction_Nm
                                   : hypot((double)x->healthy.re[w], (double)x->healthy.im[w]);
        alike((float)healthy, c.healthy, "healthy");
        faults[c.fault.name]++;
        if (channel != DQW_WATCH_FRICTION) {
            x->named_since = x->estimator.number - (looks + 1) * 16;
            const dqw_fault_verdict v = named(x);
            const bool sure = v.confidence >= 0.65f;
            if (fabsf(v.confidence - 0.65f) > 1e-3f) HOLDS(c.fault.name == (sure ? v.name : DQW_FAULT_UNKNOWN));
            BETWEEN((double)v.confidence - 1e-3, c.fault.confidence, (double)v.confidence + 1e-3);
            if (sure) HOLDS(c.fault.phase == v.phase);
        }
        if (channel == DQW_WATCH_FRICTION) {
            HOLDS(c.fault.name == (now.change > 0 ? DQW_FAULT_BEARING_WEAR : DQW_FAULT_UNKNOWN));
            if (now.change > 0) {
                HOLDS(m.healthy.friction_Nm == m.friction_Nm && m.watch.reversals == 0 && !m.watch.resting);
                continue;
            }
        }
        HOLDS(c.fault.name == DQW_FAULT_UNKNOWN || c.fault.confidence >= 0.65f);
        // A rest begins: what is, is healthy; temperatures count from where they did.
        HOLDS(m.watch.resting && m.watch.wait == 60 && m.watch.alarms == 0 && m.watch.reversals == 0);
        for (int i = 0; i < DQW_WATCH_OFFSET; i++) HOLDS((double)m.healthy.weight[i] == value(&m, i));
        HOLDS(m.healthy.friction_Nm == m.friction_Nm);
        HOLDS(m.healthy.residual_pu2 == fmaxf(m.estimator.recent_pu2, 4e-6f));
        alike((float)((double)x->healthy.cold_psi_Wb * value(x, DQW_PSI) / (double)x->healthy.weight[DQW_PSI]),
              m.healthy.cold_psi_Wb, "cold flux");
    }
    CASE("%d events", events);
    HOLDS(events > 500 && faults[DQW_FAULT_DEMAGNETISATION] > 0 && faults[DQW_FAULT_BEARING_WEAR] > 10);
}

// (E65), block by block: what the torque leaves beside the acceleration, in one direction for 32 blocks; half the
// difference of two on both sides of a reversal, as a mean with its spread.
static void test_friction(void)
{
    learn();
    static dqw_monitor m;
    m = learned;
    m.friction_Nm = m.spread_Nm2 = m.gathered_Nm = m.before_Nm = 0;
    dqw_watch_init(&m.watch);
    const long was = row;
    int reversals = 0;
    int length = 0;
    for (int k = 0; k < 4000; k++) {
        // No inertia is that large: what it makes of a torque is none.
        const bool absurd = k % 500 == 499;
        config.J_kgm2 = absurd ? 1e9f : 1e-5f;
        dqw_monitor x = m;
        dqw_estimator_block b;
        HOLDS(dqw_estimator_take(&x.estimator, &b));
        (void)dqw_estimator_learn(&x.estimator, &b);
        (void)dqw_monitor_background(&m);
        const double w = 0.5 * (double)b.sum[8];
        const double flux = value(&x, DQW_PSI) + (value(&x, DQW_LD) - value(&x, DQW_LQ)) * 0.5 * (double)b.sum[2];
        const double used = 1.5 * 4 * flux * 0.5 * (double)b.sum[3] -
                            (double)config.J_kgm2 * (w - (double)x.w_before_rad_s) / (20 * DT_S);
        const int way = absurd ? 0 : w > 11 ? 1 : w < -11 ? -1 : 0;
        const bool goes_on = way != 0 && x.watch.gathered * way > 0;
        length = way == 0 ? 0 : goes_on ? length + 1 : 1;
        CASE("block %d, %d of a stretch", k, length);
        const double room = 1e-4;
        if (way != 0) {
            const double gathered = goes_on ? (double)x.gathered_Nm + used : used;
            BETWEEN(gathered - room, m.gathered_Nm, gathered + room);
        }
        HOLDS(m.watch.gathered == (length == 32 ? 0 : length * way));
        if (length == 32) {
            length = 0;
            const double mean = (double)m.gathered_Nm / 32;
            BETWEEN(mean - 1e-6, m.before_Nm, mean + 1e-6);
            if (x.watch.before * way < 0) {
                reversals++;
                const double n = fmin(reversals, 32);
                const double off = 0.5 * way * (mean - (double)x.before_Nm) - (double)x.friction_Nm;
                const double friction = (double)x.friction_Nm + off / n;
                const double spread = reversals == 1 ? 0
                                                     : (double)x.spread_Nm2 + (off * off - (double)x.spread_Nm2) / n;
                BETWEEN(friction - 1e-6, m.friction_Nm, friction + 1e-6);
                BETWEEN(spread * 0.999 - 1e-9, m.spread_Nm2, spread * 1.001 + 1e-9);
            }
        }
        HOLDS(m.watch.reversals == (reversals < 32 ? reversals : 32));
        m.watch.alarms = 0;
        do {
            const dqw_sample s = sample();
            (void)dqw_monitor_sample(&m, &s, false);
        } while (!m.estimator.window.over.pending);
    }
    row = was;
    CASE("%d reversals", reversals);
    HOLDS(reversals > 20);
}

// Temperatures count from what is measured on entering service, or from what was commissioned; nothing is hot yet.
static void test_what_service_begins_with(void)
{
    learn();
    for (int commissioned = 0; commissioned < 2; commissioned++) {
        config.commissioned = commissioned == 1;
        dqw_monitor m = learned;
        m.estimator.stage.name = DQW_STAGE_ORDINAL;
        m.estimator.stage.blocks = DQW_STAGE_ORDINAL_BLOCKS;
        m.healthy.hottest_K = 7;
        HOLDS(!dqw_monitor_background(&m) && m.estimator.stage.name == DQW_STAGE_IN_SERVICE);
        CASE("commissioned %d", commissioned);
        const double R = commissioned ? (double)config.estimator.R_ohm : value(&m, DQW_R);
        const double psi = commissioned ? (double)config.estimator.psi_Wb : value(&m, DQW_PSI);
        BETWEEN(-1e-6, (double)m.healthy.cold_R_ohm / 1 / R - 1, 1e-6);
        BETWEEN(-1e-6, (double)m.healthy.cold_psi_Wb / 1 / psi - 1, 1e-6);
        HOLDS(m.healthy.hottest_K == 0);
    }
    config.commissioned = false;
}

// The first that is wanting, in the order of what a block must pass.
static void test_why_it_is_not_in_service(void)
{
    learn();
    static const enum dqw_why order[] = {DQW_WHY_NO_BLOCK, DQW_WHY_NOISE,    DQW_WHY_EXCITATION, DQW_WHY_MODULATION,
                                         DQW_WHY_VOLTAGE,  DQW_WHY_RESIDUAL, DQW_WHY_R,          DQW_WHY_LQ,
                                         DQW_WHY_PSI,      DQW_WHY_BLOCKS};
    enum { REASONS = sizeof order / sizeof order[0] };
    for (int first = 0; first < REASONS; first++)
        for (int also = first; also < REASONS; also++) {
            dqw_monitor m = learned;
            dqw_estimator *e = &m.estimator;
            e->stage.name = DQW_STAGE_ORDINAL;
            e->late_error_pu2 = 0.0f;
            for (int i = 0; i < DQW_PARAMETERS; i++) e->excess_q10[i] = 0;
            e->excess_q10[DQW_LQ] = 1;
            for (int k = 0; k < REASONS; k++) {
                if (k != first && k != also) continue;
                switch (order[k]) {
                case DQW_WHY_NO_BLOCK: e->number = 0; break;
                case DQW_WHY_NOISE: e->noise_rows = DQW_NOISE_ROWS - 1; break;
                case DQW_WHY_EXCITATION: e->excess_q10[DQW_LQ] = 0; break;
                case DQW_WHY_MODULATION: e->trial = 1; break;
                case DQW_WHY_VOLTAGE: e->late_error_pu2 = e->late_pu2; break;
                case DQW_WHY_RESIDUAL: e->stage.threshold_ppm = 1; break;
                case DQW_WHY_R: e->learned &= ~(1u << DQW_R); break;
                case DQW_WHY_LQ: e->learned &= ~(1u << DQW_LQ); break;
                case DQW_WHY_PSI: e->learned &= ~(1u << DQW_PSI); break;
                default: break;
                }
            }
            CASE("%d and %d", first, also);
            TEST_ASSERT_EQUAL_INT_MESSAGE(order[first], dqw_monitor_why(&m), test_case);
        }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_look);
    RUN_TEST(test_what_is_named);
    RUN_TEST(test_friction);
    RUN_TEST(test_what_service_begins_with);
    RUN_TEST(test_why_it_is_not_in_service);
    return UNITY_END();
}
