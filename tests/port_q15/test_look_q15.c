// One look of the monitor in whole numbers, from the state before it, against (E63) in double: which healthy values
// settle and follow, how far each channel is off, what is named, and what comes after. And why nothing is watched.
#include "dqw_estimator_block_q15.h"
#include "dqw_fault_q15.h"
#include "dqw_monitor_channel_q15.h"
#include "dqw_watch.h"
#include "dqw_witness_q15.h"
#include "moving_joint.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

enum { ROWS = 10800 };
#define V_FULL 21.0
#define I_FULL 9.0
#define W_FULL 165.0
#define Q16 65536.0
#define Q24 16777216.0
#define Q28 268435456.0
#define Q48 281474976710656.0
#define Q54 18014398509481984.0
static dqw_monitor_q15_config config;
static dqw_monitor_q15 learned;
static long row;
static test_random noise = {750};

static int32_t rounded(double x) { return (int32_t)lrint(x); }
static int16_t q15(double x, double full) { return (int16_t)lrint(32768 * x / full); }

static dqw_sample_q15 sample(void)
{
    const dqw_sample s = moving(row, 0.5, 0.01, &noise);
    const double angle = 4 * 70 / (2 * PI * 3) * (1 - cos(2 * PI * 3 * (double)row * DT_S));
    row++;
    return dqw_sample_from_dq_q15(q15((double)s.v_d_V, V_FULL), q15((double)s.v_q_V, V_FULL),
                                  q15((double)s.i_d_A, I_FULL), q15((double)s.i_q_A, I_FULL),
                                  q15((double)s.w_m_rad_s, W_FULL),
                                  (uint16_t)(llrint(angle / (2 * PI) * 65536) & 65535));
}

// A monitor that has learned its machine, up to where a block waits that ends a look.
static void learn(void)
{
    const dqw_monitor_q15_config given = {.estimator = {.scale = {(uint32_t)(1000 * V_FULL), (uint32_t)(1000 * I_FULL),
                                                                  (uint32_t)(1000 * W_FULL), 50000, 4},
                                                        .R_uohm = 500000,
                                                        .Ld_nH = 1000000,
                                                        .Lq_nH = 1400000,
                                                        .psi_nWb = 20000000,
                                                        .dead_time_width_mA = 50,
                                                        .threshold_ppm = 4000000,
                                                        .solve_blocks = 1,
                                                        .angle = true,
                                                        .encoder_offset = true,
                                                        .noise_on_inputs = true},
                                          .J_nkgm2 = 10000};
    config = given;
    if (learned.config != NULL) return;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_monitor_init_q15(&learned, &config));
    for (int k = 0; k < ROWS || !learned.estimator.window.over.pending; k++) {
        const dqw_sample_q15 s = sample();
        if (k < ROWS) (void)dqw_monitor_background_q15(&learned);
        (void)dqw_monitor_sample_q15(&learned, &s, false);
    }
    learned.estimator.stage.name = DQW_STAGE_IN_SERVICE;
}

static double band_of(const dqw_monitor_q15 *m, int i) { return dqw_monitor_band_of_q15(m, i) / Q24; }
// No map here.
static int32_t value_q24(const dqw_monitor_q15 *m, int i)
{
    return dqw_watch_is_map(i) ? 0 : dqw_estimator_value_q24(&m->estimator, i);
}

static double value(const dqw_monitor_q15 *m, int i) { return value_q24(m, i) / Q24; }

// In service, and nothing shows: healthy values near what is measured, or far from it.
static dqw_monitor_q15 watching(test_random *r)
{
    dqw_monitor_q15 m = learned;
    dqw_watch_init(&m.watch);
    m.watch.blocks = DQW_WATCH_TICK_BLOCKS - 1;
    m.watch.learned_at = m.estimator.number;
    m.has_change = false;
    for (int i = 0; i < DQW_WATCH_OFFSET; i++) m.healthy.weight_q24[i] = value_q24(&m, i);
    for (int i = 0; i < DQW_WATCH_OFFSET; i++)
        m.healthy.weight_q24[i] += rounded(Q24 * band_of(&learned, i == 5 ? 3 : i) * random_uniform(r, -1, 1) *
                                           (random_bits(r) % 3 == 0 ? 3 : 0.4));
    for (int k = 0; k < DQW_WITNESS_INPUTS; k++) {
        const double band = band_of(&m, DQW_WATCH_OFFSET + k);
        m.healthy.re_q28[k] = m.witness.re_q28[k] + rounded(Q28 * band * random_uniform(r, -2, 2));
        m.healthy.im_q28[k] = m.witness.im_q28[k] + rounded(Q28 * band * random_uniform(r, -2, 2));
    }
    m.healthy.cold_R_q24 = rounded(random_uniform(r, 0.7, 1.1) * Q24);
    m.healthy.cold_psi_q24 = rounded(random_uniform(r, 0.95, 1.1) * Q24);
    m.healthy.hottest_q16 = rounded(random_uniform(r, 0, 60) * Q16);
    m.healthy.residual_q54 = llrint((double)m.estimator.recent_q54 * random_uniform(r, 0.5, 2));
    m.healthy.friction_q24 = rounded(0.01 * Q24);
    m.friction_q24 = rounded(0.012 * Q24);
    m.spread_q48 = llrint(1e-8 * Q48);
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
static bool before_the_look(dqw_monitor_q15 *m)
{
    dqw_estimator_q15_block b;
    HOLDS(dqw_estimator_take_q15(&m->estimator, &b) && dqw_estimator_learn_q15(&m->estimator, &b));
    dqw_watch_learned(&m->watch, m->estimator.number);
    const bool witnessed = dqw_witness_learn_q15(&m->witness, &m->estimator, &b);
    HOLDS(dqw_watch_block(&m->watch));
    return witnessed;
}

static double sd_of(const dqw_monitor_q15 *m, int i)
{
    const int32_t sd = dqw_estimator_sd_q24(&m->estimator, i);
    return sd == INT32_MAX ? INFINITY : sd / Q24;
}

static double rise_K(const dqw_monitor_q15 *m, double R)
{
    return (R / (m->healthy.cold_R_q24 / Q24) - 1) / (1e-6 * (double)dqw_monitor_alpha_ppm(m));
}

// What heat may have made of it since it was followed last, a third more.
static double heat(const dqw_monitor_q15 *m, int channel)
{
    const bool flux = channel == DQW_WATCH_PSI;
    const double a_kelvin = flux ? 1e-6 * (double)dqw_monitor_beta_ppm(m) * m->healthy.cold_psi_q24 / Q24
                                 : 1e-6 * (double)dqw_monitor_alpha_ppm(m) * m->healthy.cold_R_q24 / Q24;
    const double heating_K_s = config.heating_mK_s > 0 ? config.heating_mK_s / 1000.0 : 1;
    const double steps = (uint16_t)((m->estimator.number >> 8) - m->watch.followed[flux]);
    return 1.3 * a_kelvin * heating_K_s * steps * 256 * m->estimator.window.half * DT_S;
}

static void follow(dqw_monitor_q15 *m, int channel)
{
    const double most = heat(m, channel);
    const double known = (channel == DQW_WATCH_PSI ? 0.4 : 0.2) * band_of(m, channel);
    if (most <= 0 || sd_of(m, channel) >= known) return;
    const double off = value(m, channel) - m->healthy.weight_q24[channel] / Q24;
    m->healthy.weight_q24[channel] += rounded(Q24 * fmax(-most, fmin(most, off)));
    m->watch.followed[channel == DQW_WATCH_PSI] = (uint16_t)(m->estimator.number >> 8);
}

static double off_bands(const dqw_monitor_q15 *m, int channel)
{
    if (channel == DQW_WATCH_TEMPERATURE)
        return dqw_monitor_knows_heat_q15(m)
                   ? (rise_K(m, value(m, DQW_R)) - (double)dqw_monitor_band_q24(m, channel) / Q24) / 5 + 1
                   : 0;
    if (channel == DQW_WATCH_RESIDUAL)
        return sqrt((double)m->estimator.recent_q54 / (double)m->healthy.residual_q54) /
               (double)dqw_monitor_band_q24(m, channel) / Q24;
    dqw_monitor_channel_q15 x;
    dqw_monitor_read_channel_q15(m, channel, &x);
    const double sure = (double)dqw_monitor_surely_q15(m, channel, x.sd) / Q24;
    if (m->watch.looks[channel] < 20 || x.sd == INT32_MAX) return 0;
    const bool heats = channel == DQW_WATCH_R || channel == DQW_WATCH_PSI;
    return (fabs(x.change / Q24) - (heats ? heat(m, channel) : 0)) / sure;
}

static int32_t q5(double bands) { return bands > 0 ? (int32_t)lrint(32 * fmin(bands, 100)) : 0; }

static void settle(dqw_monitor_q15 *m, int channel)
{
    if (dqw_watch_is_map(channel)) return;
    if (channel == DQW_WATCH_FRICTION) {
        if (m->watch.looks[channel] == 255 || m->watch.change[channel].sum_q5 != 0) return;
        m->watch.looks[channel] = m->watch.reversals < DQW_WATCH_REVERSALS_MOST ? 0 : 255;
        m->healthy.friction_q24 = m->friction_q24;
        return;
    }
    dqw_monitor_channel_q15 x;
    dqw_monitor_read_channel_q15(m, channel, &x);
    const double sd = (x.sd != INT32_MAX ? x.sd / Q24 : INFINITY);
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
    const double before = channel <= DQW_WATCH_PSI ? m->healthy.weight_q24[channel] / Q24 : 0;
    const double take = 1.0 / n;
    if (channel < DQW_WATCH_OFFSET) {
        m->healthy.weight_q24[channel] += rounded(Q24 * take *
                                                  (value(m, channel) - m->healthy.weight_q24[channel] / Q24));
    } else {
        const int k = channel - DQW_WATCH_OFFSET;
        m->healthy.re_q28[k] += rounded(take * (m->witness.re_q28[k] - m->healthy.re_q28[k]));
        m->healthy.im_q28[k] += rounded(take * (m->witness.im_q28[k] - m->healthy.im_q28[k]));
    }
    if (n > 20 || config.commissioned) return;
    const double by = channel <= DQW_WATCH_PSI ? m->healthy.weight_q24[channel] / Q24 / before : 1;
    if (channel == DQW_WATCH_R) m->healthy.cold_R_q24 = rounded(by * m->healthy.cold_R_q24);
    if (channel == DQW_WATCH_PSI) m->healthy.cold_psi_q24 = rounded(by * m->healthy.cold_psi_q24);
}

static void alike(int64_t expected, int64_t value, const char *what)
{
    const double room = 3e-6 * fabs((double)expected) + 8;
    test_between((double)expected - room, (double)value, (double)expected + room, what, __LINE__);
}

static void same_healthy(const dqw_monitor_q15 *expected, const dqw_monitor_q15 *m)
{
    for (int i = 0; i < DQW_WATCH_OFFSET; i++)
        alike(expected->healthy.weight_q24[i], m->healthy.weight_q24[i], "weight");
    for (int k = 0; k < DQW_WITNESS_INPUTS; k++) {
        alike(expected->healthy.re_q28[k], m->healthy.re_q28[k], "witness");
        alike(expected->healthy.im_q28[k], m->healthy.im_q28[k], "witness");
    }
    alike(expected->healthy.cold_R_q24, m->healthy.cold_R_q24, "cold R");
    alike(expected->healthy.cold_psi_q24, m->healthy.cold_psi_q24, "cold flux");
    alike(expected->healthy.hottest_q16, m->healthy.hottest_q16, "hottest");
    alike(expected->healthy.residual_q54, m->healthy.residual_q54, "residual");
    alike(expected->healthy.friction_q24, m->healthy.friction_q24, "friction");
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
        config.heating_mK_s = k % 7 == 0 ? 300 : 0;
        dqw_monitor_q15 m = watching(&r);
        // A block that teaches no ripple: nobody knows its angle.
        if (k % 3 == 1) m.estimator.rise_cosine_q15 = m.estimator.rise_sine_q15 = 0;
        // Deviations from well within a band to beyond it.
        const double noisier = k % 4 == 3 ? pow(10, (k / 4) % 100 * 0.06) : 1;
        for (int i = 0; i < 2; i++) m.estimator.error_q56[i] = llrint((double)m.estimator.error_q56[i] * noisier);
        dqw_monitor_q15 expected = m;
        CASE("look %d", k);
        m.watch.back = k % 3 == 0;
        HOLDS(!dqw_monitor_background_q15(&m));
        // With a residual in its band it stays in service, and the wish is forgotten.
        HOLDS(!m.watch.back && m.estimator.stage.name == DQW_STAGE_IN_SERVICE);
        const bool witnessed = before_the_look(&expected);
        HOLDS(witnessed == (k % 3 != 1));
        dqw_monitor_q15 *x = &expected;
        HOLDS(dqw_watch_begin(&x->watch) == DQW_WATCH_SETTLES);
        follow(x, DQW_WATCH_R);
        follow(x, DQW_WATCH_PSI);
        const double hottest_K = fmax(0.99999 * x->healthy.hottest_q16 / Q16,
                                      rise_K(x, x->healthy.weight_q24[0] / Q24));
        x->healthy.hottest_q16 = rounded(Q16 * hottest_K);
        const double least = x->healthy.cold_psi_q24 * (1 - 1.3e-6 * (double)dqw_monitor_beta_ppm(x) * hottest_K -
                                                        (double)dqw_monitor_band_q24(x, DQW_WATCH_PSI) / Q24 / 2);
        x->healthy.weight_q24[DQW_PSI] = rounded(fmax(x->healthy.weight_q24[DQW_PSI], least));
        const double most = (double)x->healthy.residual_q54 * (x->estimator.segment.segments < 20 ? 1.1 : 1.005);
        if (config.estimator.follow && x->estimator.recent_q54 > x->healthy.residual_q54)
            x->healthy.residual_q54 = llrint(fmin((double)x->estimator.recent_q54, most));
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

// (E64): each change over its deviation, of a third of a band at least; parts of the healthy values, of dead time in
// its unit, of the angle radians.
static dqw_fault_verdict_q15 named(const dqw_monitor_q15 *m)
{
    int32_t change_q24[DQW_SIGNS];
    int32_t unit_q24[DQW_SIGNS];
    for (int i = 0; i < DQW_WATCH_FRICTION; i++) {
        dqw_monitor_channel_q15 x;
        dqw_monitor_read_channel_q15(m, i, &x);
        const double least = hypot(x.sd / Q24, band_of(m, i) / 3);
        const bool known = x.sd != INT32_MAX && m->watch.looks[i] >= 20;
        if (dqw_watch_is_map(i)) {
            change_q24[i] = 0;
            unit_q24[i] = INT32_MAX;
        } else if (i < DQW_WATCH_OFFSET) {
            // What the gain has let it follow of a change, two rows a block, since it showed.
            const dqw_estimator_q15 *e = &m->estimator;
            const int w = dqw_watch_weight(i);
            const double gain = (double)e->cov_q40[w] / 1099511627776 * e->residual.alone_q31[w] / 2147483648;
            const double share = fmin(1, 0.05 + 32.0 * m->named_looks * gain);
            const double of = share * (i == DQW_WATCH_DEAD_TIME
                                           ? 1
                                           : m->healthy.weight_q24[i == DQW_WATCH_ANGLE ? 3 : i] / Q24);
            change_q24[i] = rounded((value(m, i) * Q24 - m->healthy.weight_q24[i]) / of);
            unit_q24[i] = known ? rounded(least / fabs(of) * Q24) : INT32_MAX;
        } else {
            const int k = i - DQW_WATCH_OFFSET;
            const int at = DQW_SIGN_OFFSET_RE + 2 * k;
            change_q24[at] = rounded((m->witness.re_q28[k] - m->healthy.re_q28[k]) / 16.0);
            change_q24[at + 1] = rounded((m->witness.im_q28[k] - m->healthy.im_q28[k]) / 16.0);
            unit_q24[at] = unit_q24[at + 1] = known ? rounded(least * Q24) : INT32_MAX;
        }
    }
    // (E177): a phase's ripple as it is at the speed that its input remembers.
    const double power = (double)m->witness.power_q52[1];
    const double speed = power > 0 ? fmin(fmax((double)m->witness.across_q52 / power, -128), 128) : 0;
    const int32_t *gain_q24 = &change_q24[DQW_SIGN_REACTANCE_RE];
    change_q24[DQW_SIGN_RESISTANCE_RE] = rounded(change_q24[DQW_SIGN_RESISTANCE_RE] - speed * gain_q24[1]);
    change_q24[DQW_SIGN_RESISTANCE_IM] = rounded(change_q24[DQW_SIGN_RESISTANCE_IM] + speed * gain_q24[0]);
    const int32_t *h = m->healthy.weight_q24;
    const dqw_fault_machine_q15 machine = {h[DQW_R],
                                           dqw_witness_mean_L_q24(&config.estimator, h[DQW_LD], h[DQW_LQ]),
                                           dqw_witness_short_q40(&config.estimator),
                                           rounded(speed * Q24),
                                           config.estimator.observed,
                                           h[DQW_DEAD_TIME]};
    return dqw_fault_name_it_q15(change_q24, unit_q24, machine);
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
        config.heating_mK_s = 0;
        dqw_monitor_q15 m = watching(&r);
        const int drawn = (int)(random_bits(&r) % DQW_WATCH_TEMPERATURE);
        const int channel = dqw_watch_is_map(drawn) ? drawn + 2 : drawn;  // no map here
        for (int i = 0; i < DQW_WATCH_TEMPERATURE; i++) {
            // Some have no healthy value yet: they say nothing of its name.
            m.watch.looks[i] = i != channel && (k + i) % 7 == 3 ? 19 : 255;
            m.watch.change[i].above = 7;
        }
        if (channel < DQW_WATCH_OFFSET)
            m.healthy.weight_q24[channel] = rounded(m.healthy.weight_q24[channel] *
                                                    (channel == DQW_WATCH_PSI ? 1.05 : random_uniform(&r, 1.3, 1.6)));
        else if (channel < DQW_WATCH_FRICTION)
            m.witness.re_q28[channel - DQW_WATCH_OFFSET] += rounded(6 * Q28 * band_of(&m, channel));
        else
            m.friction_q24 = m.healthy.friction_q24 + rounded((k % 2 ? 9 : -9) * Q24 * band_of(&m, channel));
        m.watch.reversals = DQW_WATCH_REVERSALS_MOST;
        // Weights have followed all of a change that showed long ago, a part of one that has only begun; and all together
        // may look like one factor.
        const uint32_t looks = k % 2 ? 100 : (uint32_t)(k / 2 % 30);
        m.watch.change[channel].above = (uint8_t)looks;
        for (int i = 0; i <= DQW_WATCH_DEAD_TIME && k % 3 == 0; i++)
            if (i != channel)
                m.healthy.weight_q24[i] = rounded(m.healthy.weight_q24[i] * random_uniform(&r, 1.05, 1.15));
        // The last look before it is named, whatever its name: it has waited as often as it may.
        m.watch.alarms = (uint16_t)(1u << channel);
        m.watch.extended = 6;
        m.watch.wait = 1;
        dqw_monitor_q15 expected = m;
        CASE("name %d, channel %d", k, channel);
        const bool told = dqw_monitor_background_q15(&m);
        (void)before_the_look(&expected);
        dqw_monitor_q15 *x = &expected;
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
        dqw_monitor_change_q15 c;
        HOLDS(dqw_monitor_event_q15(&m, &c) && !dqw_monitor_event_q15(&m, &c));
        dqw_monitor_channel_q15 now;
        dqw_monitor_read_channel_q15(x, channel, &now);
        HOLDS((int)c.parameter == channel && c.value_q40 == (int64_t)now.now * 65536 &&
              c.sd_q40 == (int64_t)now.sd * 65536);
        HOLDS(c.sample == (uint64_t)x->estimator.number * 20 &&
              c.since == (uint64_t)(x->estimator.number - (looks + 1) * 16) * 20);
        const int w = channel - DQW_WATCH_OFFSET;
        const double healthy = channel < DQW_WATCH_OFFSET ? (double)x->healthy.weight_q24[channel]
                               : channel == DQW_WATCH_FRICTION
                                   ? (double)x->healthy.friction_q24
                                   : hypot(x->healthy.re_q28[w] / 16.0, x->healthy.im_q28[w] / 16.0);
        alike(llrint(healthy), c.healthy_q40 / 65536, "healthy");
        faults[c.fault.name]++;
        if (channel != DQW_WATCH_FRICTION) {
            x->named_looks = (uint8_t)(looks + 1);
            const dqw_fault_verdict_q15 v = named(x);
            const bool sure = v.confidence_q15 >= 21299;
            if (abs(v.confidence_q15 - 21299) > 32) HOLDS(c.fault.name == (sure ? v.name : DQW_FAULT_UNKNOWN));
            BETWEEN(v.confidence_q15 - 32, c.fault.confidence_q15, v.confidence_q15 + 32);
            if (sure) HOLDS(c.fault.phase == v.phase);
        }
        if (channel == DQW_WATCH_FRICTION) {
            HOLDS(c.fault.name == (now.change > 0 ? DQW_FAULT_BEARING_WEAR : DQW_FAULT_UNKNOWN));
            if (now.change > 0) {
                HOLDS(m.healthy.friction_q24 == m.friction_q24 && m.watch.reversals == 0 && !m.watch.resting);
                continue;
            }
        }
        HOLDS(c.fault.name == DQW_FAULT_UNKNOWN || c.fault.confidence_q15 >= 0.65 * 32768 - 1);
        // A rest begins: what is, is healthy; temperatures count from where they did.
        HOLDS(m.watch.resting && m.watch.wait == 60 && m.watch.alarms == 0 && m.watch.reversals == 0);
        for (int i = 0; i < DQW_WATCH_OFFSET; i++) HOLDS(m.healthy.weight_q24[i] == value_q24(&m, i));
        HOLDS(m.healthy.friction_q24 == m.friction_q24);
        const double residual = fmax((double)m.estimator.recent_q54, 4e-6 * Q54);
        BETWEEN(0.9999 * residual, (double)m.healthy.residual_q54, 1.0001 * residual);
        alike(llrint(x->healthy.cold_psi_q24 * value(x, DQW_PSI) / (x->healthy.weight_q24[DQW_PSI] / Q24)),
              m.healthy.cold_psi_q24, "cold flux");
    }
    CASE("%d events", events);
    HOLDS(events > 500 && faults[DQW_FAULT_DEMAGNETISATION] > 0 && faults[DQW_FAULT_BEARING_WEAR] > 10);
}

// (E65), block by block: what the torque leaves beside the acceleration, in one direction for 32 blocks; half the
// difference of two on both sides of a reversal, as a mean with its spread.
static void test_friction(void)
{
    learn();
    static dqw_monitor_q15 m;
    m = learned;
    m.friction_q24 = m.gathered_q24 = m.before_q24 = 0;
    m.spread_q48 = 0;
    // Of the nominal flux at the full current.
    const double unit_Nm = 1.5 * 4 * 0.02 * I_FULL;
    dqw_watch_init(&m.watch);
    const long was = row;
    int reversals = 0;
    int length = 0;
    for (int k = 0; k < 4000; k++) {
        // No inertia is that large: what it makes of a torque is none.
        const bool absurd = k % 500 == 499;
        config.J_nkgm2 = absurd ? UINT32_MAX : 10000;
        dqw_monitor_q15 x = m;
        dqw_estimator_q15_block b;
        HOLDS(dqw_estimator_take_q15(&x.estimator, &b));
        (void)dqw_estimator_learn_q15(&x.estimator, &b);
        (void)dqw_monitor_background_q15(&m);
        const double one = 32768.0 * b.weight;
        const double w = 0.5 * b.sums[8] / one * W_FULL;
        const double flux = 0.02 * value(&x, DQW_PSI) +
                            (1e-3 * value(&x, DQW_LD) - 1.4e-3 * value(&x, DQW_LQ)) * 0.5 * b.sums[2] / one * I_FULL;
        const double used = 1.5 * 4 * flux * 0.5 * b.sums[3] / one * I_FULL -
                            1e-9 * config.J_nkgm2 * (w - x.w_before_q28 / Q28 * W_FULL) / (20 * DT_S);
        const int way = absurd ? 0 : w > 11 ? 1 : w < -11 ? -1 : 0;
        const bool goes_on = way != 0 && x.watch.gathered * way > 0;
        length = way == 0 ? 0 : goes_on ? length + 1 : 1;
        CASE("block %d, %d of a stretch", k, length);
        const double room = 1e-5;
        if (way != 0) {
            const double gathered = goes_on ? x.gathered_q24 / Q24 + used / unit_Nm / 32 : used / unit_Nm / 32;
            BETWEEN(gathered - room, m.gathered_q24 / Q24, gathered + room);
        }
        HOLDS(m.watch.gathered == (length == 32 ? 0 : length * way));
        if (length == 32) {
            length = 0;
            const double mean = m.gathered_q24 / Q24;
            HOLDS(m.before_q24 == m.gathered_q24);
            if (x.watch.before * way < 0) {
                reversals++;
                const double n = fmin(reversals, 32);
                const double off = 0.5 * way * (mean - x.before_q24 / Q24) - x.friction_q24 / Q24;
                const double friction = x.friction_q24 / Q24 + off / n;
                const double spread = reversals == 1
                                          ? 0
                                          : (double)x.spread_q48 / Q48 + (off * off - (double)x.spread_q48 / Q48) / n;
                BETWEEN(friction - 1e-6, m.friction_q24 / Q24, friction + 1e-6);
                BETWEEN(spread * 0.999 - 1e-9, (double)m.spread_q48 / Q48, spread * 1.001 + 1e-9);
            }
        }
        HOLDS(m.watch.reversals == (reversals < 32 ? reversals : 32));
        m.watch.alarms = 0;
        do {
            const dqw_sample_q15 s = sample();
            (void)dqw_monitor_sample_q15(&m, &s, false);
        } while (!m.estimator.window.over.pending);
    }
    row = was;
    CASE("%d reversals", reversals);
    HOLDS(reversals > 20);
}

// Sums that say that the voltage is late by one period: P_uu b_u.
static void late_by_one(dqw_estimator_q15 *e)
{
    static const int64_t none[DQW_NORMAL_INPUTS] = {0};
    dqw_solution_q15 s;
    dqw_normal_solve_q15(&e->normal, none, &s);
    e->normal.b_q32[e->inputs] = llrint(Q24 * Q48 / (double)s.cov_q40[e->inputs]);
}

// Temperatures count from what is measured on entering service, or from what was commissioned; nothing is hot yet.
static void test_what_service_begins_with(void)
{
    learn();
    for (int commissioned = 0; commissioned < 2; commissioned++) {
        config.commissioned = commissioned == 1;
        dqw_monitor_q15 m = learned;
        m.estimator.stage.name = DQW_STAGE_ORDINAL;
        m.estimator.stage.blocks = DQW_STAGE_ORDINAL_BLOCKS;
        m.healthy.hottest_q16 = 7;
        HOLDS(!dqw_monitor_background_q15(&m) && m.estimator.stage.name == DQW_STAGE_IN_SERVICE);
        CASE("commissioned %d", commissioned);
        const double R = commissioned ? 1 : value(&m, DQW_R);
        const double psi = commissioned ? 1 : value(&m, DQW_PSI);
        BETWEEN(-1e-6, (double)m.healthy.cold_R_q24 / Q24 / R - 1, 1e-6);
        BETWEEN(-1e-6, (double)m.healthy.cold_psi_q24 / Q24 / psi - 1, 1e-6);
        HOLDS(m.healthy.hottest_q16 == 0);
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
            dqw_monitor_q15 m = learned;
            dqw_estimator_q15 *e = &m.estimator;
            e->stage.name = DQW_STAGE_ORDINAL;
            e->normal.b_q32[e->inputs] = 0;
            for (int i = 0; i < DQW_PARAMETERS; i++) e->excess_q10[i] = 0;
            e->excess_q10[DQW_LQ] = 1;
            for (int k = 0; k < REASONS; k++) {
                if (k != first && k != also) continue;
                switch (order[k]) {
                case DQW_WHY_NO_BLOCK: e->number = 0; break;
                case DQW_WHY_NOISE: e->handed.rows = DQW_NOISE_ROWS - 1; break;
                case DQW_WHY_EXCITATION: e->excess_q10[DQW_LQ] = 0; break;
                case DQW_WHY_MODULATION: e->trial = 1; break;
                case DQW_WHY_VOLTAGE: late_by_one(e); break;
                case DQW_WHY_RESIDUAL: e->stage.threshold_ppm = 1; break;
                case DQW_WHY_R: e->learned &= ~(1u << DQW_R); break;
                case DQW_WHY_LQ: e->learned &= ~(1u << DQW_LQ); break;
                case DQW_WHY_PSI: e->learned &= ~(1u << DQW_PSI); break;
                default: break;
                }
            }
            CASE("%d and %d", first, also);
            TEST_ASSERT_EQUAL_INT_MESSAGE(order[first], dqw_monitor_why_q15(&m), test_case);
        }
}

// Known is what has a deviation within a tenth of itself, beside an observer within a fifth: R, L_q and the flux, each by
// itself.
static void test_known_is_to_a_tenth(void)
{
    learn();
    static const int weights[] = {DQW_R, DQW_LQ, DQW_PSI};
    static const enum dqw_why wanting[] = {DQW_WHY_R, DQW_WHY_LQ, DQW_WHY_PSI};
    for (int n = 0; n < 6; n++) {
        config.estimator.observed = n >= 3;
        const double most = n >= 3 ? 0.2 : 0.1;
        int seen[2] = {0};
        for (int k = 0; k < 140; k++) {
            dqw_monitor_q15 m = learned;
            m.config = &config;
            m.estimator.config = &config.estimator;
            m.estimator.stage.name = DQW_STAGE_ORDINAL;
            m.estimator.excess_q10[DQW_LQ] = 1;
            const int i = weights[n % 3];
            m.estimator.cov_q40[i] = llrint((double)m.estimator.cov_q40[i] * pow(1.15, k));
            const double part = sd_of(&m, i) / value(&m, i);
            CASE("weight %d to %g", i, part);
            if (fabs(part - most) < 2e-5) continue;
            HOLDS(dqw_monitor_why_q15(&m) == (part < most ? DQW_WHY_BLOCKS : wanting[n % 3]));
            seen[part < most]++;
        }
        CASE("%d, %d", seen[0], seen[1]);
        HOLDS(seen[0] > 5 && seen[1] > 5);
    }
    config.estimator.observed = false;
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_look);
    RUN_TEST(test_what_is_named);
    RUN_TEST(test_friction);
    RUN_TEST(test_what_service_begins_with);
    RUN_TEST(test_why_it_is_not_in_service);
    RUN_TEST(test_known_is_to_a_tenth);
    return UNITY_END();
}
