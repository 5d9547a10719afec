// A fixed-point monitor's channels by themselves: bands as they are documented, what is read, how far a healthy value
// moves, why one is not watched; from numbers set by hand, against their closed forms in double.
#include "bent_iron.h"
#include "dqw_estimator_block_q15.h"
#include "dqw_monitor_channel_q15.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

#define Q24 16777216.0
#define Q28 268435456.0
#define Q40 1099511627776.0

// In units of the nominal values; dead time in parts of the full voltage; a map's weights as they are.
static const double HEALTHY[DQW_WATCH_OFFSET] = {0.9, 1.1, 1.2, 0.95, 0.3, 0.05, 1.1, 0.9};
static const double MAP[2] = {1.05, 0.95};
static const double RE[DQW_WITNESS_INPUTS] = {0.01, -0.02, 0.03, 0.004};
static const double IM[DQW_WITNESS_INPUTS] = {-0.03, 0.01, 0.04, -0.003};

static int32_t fixed(double x, double one) { return (int32_t)lrint(x * one); }

// With a flux map, so that all channels are asked for.
static dqw_monitor_q15_config config_of(void)
{
    static dqw_effect_q15_config map;
    map = (dqw_effect_q15_config){.effect = DQW_EFFECT_FLUX_MAP,
                                  .psi_nWb = 13200000,
                                  .cell_d_uA = 1500000,
                                  .cell_q_uA = 800000,
                                  .start_q40 = {(int64_t)(MAP[0] * Q40), (int64_t)(MAP[1] * Q40)},
                                  .map = bent_table()};
    const dqw_monitor_q15_config c = {
        .estimator = {
            .scale = {.v_full_mV = 21000, .i_full_mA = 9000, .w_full_mrad_s = 165000, .dt_ns = 50000, .pole_pairs = 4},
            .R_uohm = 500000,
            .Ld_nH = 1000000,
            .Lq_nH = 1400000,
            .psi_nWb = 20000000,
            .dead_time_width_mA = 50,
            .angle = true,
            .encoder_offset = true,
            .effects = &map,
            .effect_count = 1}};
    return c;
}

// In its place: effects point at their estimator's own numbers.
static void begin(dqw_monitor_q15 *m, const dqw_monitor_q15_config *c)
{
    memset(m, 0x5a, sizeof *m);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_monitor_init_q15(m, c));
    for (int i = 0; i < DQW_WATCH_OFFSET; i++) m->healthy.weight_q24[i] = fixed(HEALTHY[i], Q24);
    for (int k = 0; k < DQW_WITNESS_INPUTS; k++) {
        m->healthy.re_q28[k] = fixed(RE[k], Q28);
        m->healthy.im_q28[k] = fixed(IM[k], Q28);
    }
}

// To two last places of what is kept, and a little more.
static double off(double x) { return 1e-5 * fabs(x) + 2 / Q24; }
#define NEAR(expected, value) BETWEEN((expected)-off(expected), (value), (expected) + off(expected))

static void test_bands_are_the_documented_ones(void)
{
    dqw_monitor_q15_config c = config_of();
    dqw_monitor_q15 m;
    begin(&m, &c);
    const double L = (HEALTHY[1] * 1.0 + HEALTHY[2] * 1.4) / 2.4;
    const double short_unit = (double)dqw_witness_short_q40(&c.estimator) / Q40;
    const double band[DQW_WATCH_TEMPERATURE] = {0.04 * HEALTHY[0],
                                                0.06 * HEALTHY[1],
                                                0.06 * HEALTHY[2],
                                                0.012 * HEALTHY[3],
                                                0.005 * DQW_DEAD_TIME_Q15_PARTS,
                                                0.02 * HEALTHY[3],
                                                0.06 * HEALTHY[6],
                                                0.06 * HEALTHY[7],
                                                0.01,
                                                0.03 * HEALTHY[0] / 3,
                                                0.03 * L / 3,
                                                0.003 / (3 * HEALTHY[0]) / short_unit,
                                                0.05 * HEALTHY[3]};
    for (int i = 0; i < DQW_WATCH_TEMPERATURE; i++) {
        CASE("channel %d", i);
        c.band_ppm[i] = 0;
        NEAR(band[i], dqw_monitor_band_of_q15(&m, i) / Q24);
        const double part = (double)dqw_monitor_band_q24(&m, i) / Q24;
        c.band_ppm[i] = 500000;
        NEAR(band[i] * 0.5 / part, dqw_monitor_band_of_q15(&m, i) / Q24);
    }
    // To a last place: a millionth is sixteen of them. The temperature's to 28 bits.
    static const double part[DQW_WATCH_CHANNELS] = {0.04, 0.06, 0.06, 0.012, 0.005, 0.02, 0.06, 0.06,
                                                    0.01, 0.03, 0.03, 0.003, 0.05,  110,  3};
    for (int i = 0; i < DQW_WATCH_CHANNELS; i++) {
        CASE("channel %d", i);
        c.band_ppm[i] = 0;
        const double places = i == DQW_WATCH_TEMPERATURE ? 8 : 1;
        BETWEEN(-places, (double)dqw_monitor_band_q24(&m, i) - part[i] * Q24, places);
    }
    HOLDS(dqw_monitor_alpha_ppm(&m) == 3900 && dqw_monitor_beta_ppm(&m) == 1000);
    c.alpha_ppm_per_K = 5000, c.beta_ppm_per_K = 1;
    HOLDS(dqw_monitor_alpha_ppm(&m) == 5000 && dqw_monitor_beta_ppm(&m) == 1);
}

static double value_of(const dqw_monitor_q15 *m, int channel)
{
    return (double)dqw_monitor_read_q15(m, (enum dqw_monitor_channel)channel).value_q40 / Q40;
}

static int64_t sd_of(const dqw_monitor_q15 *m, int channel)
{
    return dqw_monitor_read_q15(m, (enum dqw_monitor_channel)channel).sd_q40;
}

static void test_what_a_channel_reads(void)
{
    const dqw_monitor_q15_config c = config_of();
    dqw_monitor_q15 m;
    begin(&m, &c);
    dqw_monitor_channel_q15 x;
    for (int i = 0; i < DQW_WATCH_OFFSET; i++) {
        CASE("channel %d", i);
        // A map's weights are counted by the map: they stay where they start.
        const double now = dqw_watch_is_map(i) ? MAP[i - DQW_WATCH_MAP_D] : 0.7 + 0.1 * i;
        if (!dqw_watch_is_map(i)) m.estimator.w_q24[i] = fixed(now, Q24);
        dqw_monitor_read_channel_q15(&m, i, &x);
        NEAR(now, x.now / Q24);
        NEAR(now, value_of(&m, i));
        BETWEEN(-1e-5, x.change / Q24 - (now - HEALTHY[i]), 1e-5);
        HOLDS(x.sd == INT32_MAX && sd_of(&m, i) == INT64_MAX);
    }
    // Both axes' residual over its own mean power is a witness' deviation, once its memory is full. (E62)
    m.estimator.error_q56[0] = (int64_t)ldexp(1e-4, 56);
    m.estimator.error_q56[1] = (int64_t)ldexp(3e-4, 56);
    for (int k = 0; k < DQW_WITNESS_INPUTS; k++) {
        CASE("witness %d", k);
        m.witness.re_q28[k] = fixed(2 * RE[k], Q28);
        m.witness.im_q28[k] = fixed(-IM[k], Q28);
        dqw_monitor_read_channel_q15(&m, DQW_WATCH_OFFSET + k, &x);
        NEAR(hypot(2 * RE[k], IM[k]), x.now / Q24);
        NEAR(hypot(RE[k], 2 * IM[k]), x.change / Q24);
        m.witness.power_q52[k] = (int64_t)ldexp(0.5, 52);
        m.witness.blocks = DQW_WITNESS_MEMORY - 1;
        HOLDS(sd_of(&m, DQW_WATCH_OFFSET + k) == INT64_MAX);
        m.witness.blocks = DQW_WITNESS_MEMORY;
        NEAR(sqrt(2e-4 / (2.0 * DQW_WITNESS_MEMORY * 0.5)), (double)sd_of(&m, DQW_WATCH_OFFSET + k) / Q40);
        m.witness.power_q52[k] = 0;
        HOLDS(sd_of(&m, DQW_WATCH_OFFSET + k) == INT64_MAX);
    }
    // A map's deviation is its effect's, wider than that of a change by what an opening left open.
    m.estimator.learned = 3u << DQW_PARAMETERS;
    m.estimator.blocks = 1000;
    m.estimator.residual.opened = 1;
    for (int i = 0; i < 2; i++) {
        m.estimator.cov_q40[DQW_PARAMETERS + i] = (int64_t)1 << 30;
        m.estimator.segment.band_q28[DQW_PARAMETERS + i] = fixed(0.01, Q28);
    }
    int64_t map_q40[2];
    int64_t map_sd_q40[2];
    (void)dqw_estimator_read_effect_q15(&m.estimator, 0, map_q40, map_sd_q40);
    for (int i = 0; i < 2; i++) {
        const dqw_reading_q15 r = dqw_monitor_read_q15(&m, (enum dqw_monitor_channel)(DQW_WATCH_MAP_D + i));
        CASE("map %d", i);
        HOLDS(r.sd_q40 == map_sd_q40[i] && r.sd_q40 > r.sd_change_q40);
    }
    m.estimator.learned = 0;
    m.estimator.blocks = 0;
    // Friction is known from eight reversals on. (E65)
    m.friction_q24 = fixed(-0.3, Q24);
    m.healthy.friction_q24 = fixed(0.5, Q24);
    m.spread_q48 = (int64_t)ldexp(4e-4, 48);
    for (uint8_t n = 0; n <= DQW_WATCH_REVERSALS_MOST; n++) {
        CASE("%d reversals", n);
        m.watch.reversals = n;
        dqw_monitor_read_channel_q15(&m, DQW_WATCH_FRICTION, &x);
        NEAR(-0.3, x.now / Q24);
        NEAR(-0.8, x.change / Q24);
        if (n < 8)
            HOLDS(x.sd == INT32_MAX && sd_of(&m, DQW_WATCH_FRICTION) == INT64_MAX);
        else
            NEAR(sqrt(2 * 4e-4 / n), (double)sd_of(&m, DQW_WATCH_FRICTION) / Q40);
    }
    // Three deviations below a tenth of it, whatever its sign.
    for (int usable = 0; usable < 2; usable++) {
        const double least = 0.3 / 30 * (usable ? 0.99 : 1.01);
        m.spread_q48 = (int64_t)ldexp(0.5 * least * least * DQW_WATCH_REVERSALS_MOST, 48);
        HOLDS(dqw_monitor_read_q15(&m, DQW_WATCH_FRICTION).usable == (usable == 1));
    }
    // The temperature counts from a cold value; of the residual the last blocks' is read.
    HOLDS(sd_of(&m, DQW_WATCH_TEMPERATURE) == INT64_MAX && value_of(&m, DQW_WATCH_TEMPERATURE) == 0.0);
    m.healthy.cold_R_q24 = fixed(0.56, Q24);
    NEAR(0.25 / 0.0039, value_of(&m, DQW_WATCH_TEMPERATURE));
    HOLDS(sd_of(&m, DQW_WATCH_TEMPERATURE) == INT64_MAX);
    m.estimator.learned = 1u << DQW_R;
    m.estimator.blocks = 1000;
    m.estimator.cov_q40[DQW_R] = (int64_t)1 << 50;
    NEAR((double)sd_of(&m, DQW_WATCH_R) / Q40 / (0.56 * 0.0039), (double)sd_of(&m, DQW_WATCH_TEMPERATURE) / Q40);
    m.estimator.recent_q54 = (int64_t)ldexp(4e-4, 54);
    NEAR(0.02, value_of(&m, DQW_WATCH_RESIDUAL));
    HOLDS(sd_of(&m, DQW_WATCH_RESIDUAL) == 0);
    m.healthy.residual_q54 = (int64_t)ldexp(1e-4, 54);
    NEAR(3 * 0.01, dqw_monitor_residual_limit_q24(&m) / Q24);
    for (int i = -1; i <= DQW_WATCH_CHANNELS; i += DQW_WATCH_CHANNELS + 1) {
        const dqw_reading_q15 r = dqw_monitor_read_q15(&m, (enum dqw_monitor_channel)i);
        HOLDS(r.value_q40 == 0 && r.sd_q40 == INT64_MAX && r.sd_change_q40 == INT64_MAX && !r.usable);
    }
}

// A change is one beyond the band, or beyond five deviations of itself and of a mean over so many looks. (E63)
static void test_what_is_surely_a_change(void)
{
    dqw_monitor_q15_config c = config_of();
    dqw_monitor_q15 m;
    begin(&m, &c);
    const double band = 0.04 * HEALTHY[0];
    for (int looks = 0; looks <= 255; looks += 51) {
        m.watch.looks[DQW_WATCH_R] = (uint8_t)looks;
        const double wider = 5 * sqrt(1 + 20.0 / (20 + looks));
        for (double part = 0.5; part < 2.0; part += 0.25) {
            CASE("%d looks, %g of the band", looks, part);
            const double x = (double)dqw_monitor_surely_q15(&m, DQW_WATCH_R, fixed(part * band / wider, Q24)) / Q24;
            BETWEEN(0.9998, x / fmax(band, part * band), 1.0002);
        }
    }
    // A ripple may turn round.
    for (int k = 0; k < DQW_WITNESS_INPUTS; k++)
        for (int looks = 0; looks <= 255; looks += 51) {
            const int channel = DQW_WATCH_OFFSET + k;
            const double width = dqw_monitor_band_of_q15(&m, channel);
            m.watch.looks[channel] = (uint8_t)looks;
            for (double size = 0.1; size < 3.0; size += 0.3) {
                CASE("channel %d, %d looks, a healthy ripple of %g bands", channel, looks, size);
                m.healthy.re_q28[k] = (int32_t)(0.6 * 16 * size * width);
                m.healthy.im_q28[k] = (int32_t)(-0.8 * 16 * size * width);
                const double x = width * fmax(1, 2 * size);
                BETWEEN(x - 3, (double)dqw_monitor_surely_q15(&m, channel, 0), x + 3);
            }
        }
    // Of a resistance and a gain it may be the other's, in the one's unit at the mean speed, either way round.
    const double power[2] = {0.2, 0.05};
    const double size[2] = {0.11, 0.07};
    for (int k = 0; k < 2; k++) {
        m.witness.power_q52[DQW_WITNESS_RESISTANCE + k] = llrint(ldexp(power[k], 52));
        m.healthy.re_q28[DQW_WITNESS_RESISTANCE + k] = 0;
        m.healthy.im_q28[DQW_WITNESS_RESISTANCE + k] = (int32_t)lrint((k == 0 ? 1 : -1) * ldexp(size[k], 28));
    }
    for (int way = -4; way <= 4; way++)
        for (int k = 0; k < 2; k++) {
            CASE("input %d, the speed's mean %d tenths", k, way);
            const bool stands = way != 3;
            m.watch.looks[DQW_WATCH_RESISTANCE] = m.watch.looks[DQW_WATCH_REACTANCE] = 30;
            if (!stands) m.watch.looks[DQW_WATCH_REACTANCE - k] = 19;
            m.witness.across_q52 = llrint(ldexp(power[0] * 0.1 * way, 52));
            const double speed = stands ? power[0] * 0.1 * abs(way) / power[k] : 0;
            const double x = ldexp(2 * (size[k] + speed * size[1 - k]), 24);
            BETWEEN(x - 6, (double)dqw_monitor_surely_q15(&m, DQW_WATCH_RESISTANCE + k, 0), x + 6);
        }
    // Three times what segments scatter, where they are made.
    for (int follow = 0; follow < 2; follow++)
        for (int i = DQW_WATCH_R; i <= DQW_WATCH_ANGLE; i++)
            for (int part = 0; part < 4; part++) {
                c.estimator.follow = follow == 1;
                const double width = dqw_monitor_band_of_q15(&m, i);
                m.estimator.segment.band_q28[i] = (int32_t)lrint(0.25 * part * 16 * width);
                const double x = width * (follow ? fmax(1, 0.75 * part) : 1);
                CASE("channel %d, follow %d, a quarter of its band by %d", i, follow, part);
                BETWEEN(x - 4, (double)dqw_monitor_surely_q15(&m, i, 0), x + 4);
            }
}

// What would be an event: known in service alone, of a mean of twenty looks or more.
static void test_what_would_be_an_event(void)
{
    const dqw_monitor_q15_config c = config_of();
    dqw_monitor_q15 m;
    begin(&m, &c);
    m.healthy.cold_R_q24 = fixed(0.9, Q24);
    m.healthy.residual_q54 = (int64_t)ldexp(1e-4, 54);
    m.estimator.cov_q40[DQW_R] = (int64_t)1 << 50;
    m.estimator.excess_q10[DQW_R] = 1;
    for (int way = 0; way < 6; way++) {
        CASE("way %d", way);
        m.estimator.stage.name = way == 0 ? DQW_STAGE_ORDINAL : DQW_STAGE_IN_SERVICE;
        m.watch.resting = way == 1;
        m.watch.alarms = way == 2;
        m.watch.wait = way == 3;
        const bool serves = way >= 4;
        // Not known, then known.
        m.estimator.learned = way == 4 ? 0 : 1u << DQW_R;
        m.estimator.blocks = 1000;
        m.watch.looks[DQW_WATCH_R] = 19;
        HOLDS(dqw_monitor_sensitivity_q15(&m, DQW_WATCH_R) == INT64_MAX);
        m.watch.looks[DQW_WATCH_R] = 20;
        HOLDS((dqw_monitor_sensitivity_q15(&m, DQW_WATCH_R) < INT64_MAX) == (way == 5));
        HOLDS((dqw_monitor_sensitivity_q15(&m, DQW_WATCH_TEMPERATURE) < INT64_MAX) == (way == 5));
        HOLDS((dqw_monitor_sensitivity_q15(&m, DQW_WATCH_RESIDUAL) < INT64_MAX) == serves);
    }
    NEAR(1.25 * fmax(0.04 * HEALTHY[0], 5 * sqrt(1.5) * (double)sd_of(&m, DQW_WATCH_R) / Q40),
         (double)dqw_monitor_sensitivity_q15(&m, DQW_WATCH_R) / Q40);
    NEAR(110.0 + 1.64 * (double)sd_of(&m, DQW_WATCH_R) / Q40 / (0.9 * 0.0039),
         (double)dqw_monitor_sensitivity_q15(&m, DQW_WATCH_TEMPERATURE) / Q40);
    // Of R by what heat may have made of it since it was last followed: 1 K/s, and 1.3 times. (E178)
    const int64_t before = dqw_monitor_sensitivity_q15(&m, DQW_WATCH_R);
    m.estimator.number += 5 * 256, m.watch.learned_at = m.estimator.halves = m.estimator.number;
    NEAR(1.3 * 0.0039 * 0.9 * 5 * 256 * m.estimator.window.half * 50e-6,
         (double)(dqw_monitor_sensitivity_q15(&m, DQW_WATCH_R) - before) / Q40);
    NEAR(3 * 0.01, (double)dqw_monitor_sensitivity_q15(&m, DQW_WATCH_RESIDUAL) / Q40);
    HOLDS(dqw_monitor_sensitivity_q15(&m, DQW_WATCH_CHANNELS) == INT64_MAX);
}

static void test_a_healthy_value_goes_part_of_the_way(void)
{
    const dqw_monitor_q15_config c = config_of();
    for (int n = 1; n <= 5; n++) {
        dqw_monitor_q15 m;
        begin(&m, &c);
        for (int k = 0; k < DQW_WITNESS_INPUTS; k++) {
            m.witness.re_q28[k] = fixed(3 * RE[k], Q28);
            m.witness.im_q28[k] = fixed(-2 * IM[k], Q28);
        }
        m.friction_q24 = fixed(0.03, Q24);
        m.healthy.friction_q24 = fixed(0.07, Q24);
        for (int i = 0; i < DQW_WATCH_TEMPERATURE; i++) dqw_monitor_move_healthy_q15(&m, i, n);
        for (int i = 0; i < DQW_WATCH_OFFSET; i++) {
            CASE("part 1/%d, channel %d", n, i);
            const double now = dqw_watch_is_map(i) ? MAP[i - DQW_WATCH_MAP_D] : m.estimator.w_q24[i] / Q24;
            BETWEEN(-1e-5, m.healthy.weight_q24[i] / Q24 - (HEALTHY[i] + (now - HEALTHY[i]) / n), 1e-6);
        }
        for (int k = 0; k < DQW_WITNESS_INPUTS; k++) {
            CASE("part 1/%d, witness %d", n, k);
            BETWEEN(-1e-7, m.healthy.re_q28[k] / Q28 - RE[k] * (1 + 2.0 / n), 1e-7);
            BETWEEN(-1e-7, m.healthy.im_q28[k] / Q28 - IM[k] * (1 - 3.0 / n), 1e-7);
        }
        BETWEEN(-1e-6, m.healthy.friction_q24 / Q24 - (0.07 - 0.04 / n), 1e-6);
    }
}

// ---- why a channel is not watched ----

// In service with everything known and taught: all is watched.
static void serving(dqw_monitor_q15 *m, dqw_monitor_q15_config *c)
{
    c->J_nkgm2 = 100000;
    begin(m, c);
    m->healthy.cold_R_q24 = fixed(0.9, Q24);
    m->healthy.residual_q54 = (int64_t)ldexp(1e-4, 54);
    m->healthy.friction_q24 = m->friction_q24 = fixed(0.1, Q24);
    m->spread_q48 = (int64_t)ldexp(1e-8, 48);
    for (int i = 0; i < DQW_WATCH_OFFSET; i++)
        if (!dqw_watch_is_map(i)) m->estimator.w_q24[i] = m->healthy.weight_q24[i];
    m->estimator.stage.name = DQW_STAGE_IN_SERVICE;
    m->estimator.learned = (1u << DQW_FOLLOWED) - 1u;
    m->estimator.blocks = 1000;
    m->estimator.halves = m->watch.learned_at = 4000;
    for (int i = 0; i < DQW_FOLLOWED; i++) m->estimator.cov_q40[i] = (int64_t)1 << 40;
    for (int i = 0; i < DQW_FOLLOWED; i++) m->estimator.excess_q10[i] = 1;
    for (int k = 0; k < DQW_WITNESS_INPUTS; k++) m->witness.power_q52[k] = (int64_t)ldexp(0.5, 52);
    m->witness.blocks = DQW_WITNESS_MEMORY;
    m->watch.reversals = DQW_WATCH_REVERSALS_MOST;
    for (int i = 0; i < DQW_WATCH_TEMPERATURE; i++) m->watch.looks[i] = DQW_WATCH_LOOKS_MOST;
}

// Channels as bits.
#define BIT(channel) (1u << (channel))
#define WITNESS (BIT(DQW_WATCH_OFFSET) | BIT(DQW_WATCH_RESISTANCE) | BIT(DQW_WATCH_REACTANCE) | BIT(DQW_WATCH_SHORT))
#define WEIGHTS (BIT(DQW_WATCH_OFFSET) - 1u)
#define ALL (BIT(DQW_WATCH_CHANNELS) - 1u)

// These channels have this reason, the others are watched; and what is watched, if in name alone, has a sensitivity.
static void only(const dqw_monitor_q15 *m, unsigned channels, enum dqw_why why)
{
    for (int i = 0; i < DQW_WATCH_CHANNELS; i++) {
        const enum dqw_why is = dqw_monitor_unwatched_q15(m, (enum dqw_monitor_channel)i);
        CASE("channels %x, reason %d: channel %d, %d", channels, (int)why, i, (int)is);
        HOLDS(is == ((channels >> i & 1u) != 0 ? why : DQW_WHY_IN_SERVICE));
        HOLDS((dqw_monitor_sensitivity_q15(m, (enum dqw_monitor_channel)i) < INT64_MAX) ==
              (is == DQW_WHY_IN_SERVICE || is == DQW_WHY_COARSE));
    }
}

static void test_what_the_configuration_does_not_ask_for(void)
{
    dqw_monitor_q15_config c = config_of();
    dqw_monitor_q15 m;
    serving(&m, &c);
    only(&m, 0, DQW_WHY_IN_SERVICE);
    c.J_nkgm2 = 0;
    only(&m, BIT(DQW_WATCH_FRICTION), DQW_WHY_NOT_ASKED);
    // Before service too: it will never be watched.
    m.estimator.stage.name = DQW_STAGE_ORDINAL;
    HOLDS(dqw_monitor_unwatched_q15(&m, DQW_WATCH_FRICTION) == DQW_WHY_NOT_ASKED);
    HOLDS(dqw_monitor_unwatched_q15(&m, DQW_WATCH_R) == dqw_monitor_why_q15(&m));
    c = config_of();
    c.estimator.dead_time_width_mA = 0;
    serving(&m, &c);
    only(&m, BIT(DQW_WATCH_DEAD_TIME), DQW_WHY_NOT_ASKED);
    c = config_of();
    c.estimator.observed = true;
    serving(&m, &c);
    only(&m, BIT(DQW_WATCH_LQ), DQW_WHY_OBSERVED);
    c = config_of();
    c.estimator.encoder_offset = false;
    serving(&m, &c);
    only(&m, BIT(DQW_WATCH_ANGLE), DQW_WHY_NOT_ASKED);
    c = config_of();
    c.estimator.angle = false;
    serving(&m, &c);
    only(&m, WITNESS | BIT(DQW_WATCH_DEAD_TIME), DQW_WHY_NOT_ASKED);
    // Without a map, or with one that is not the first.
    dqw_effect_q15_config two[2] = {{.effect = DQW_EFFECT_SKIN_EFFECT}, *config_of().estimator.effects};
    for (int effects = 0; effects <= 2; effects += 2) {
        c = config_of();
        c.estimator.effects = two;
        c.estimator.effect_count = (uint8_t)effects;
        serving(&m, &c);
        only(&m, BIT(DQW_WATCH_MAP_D) | BIT(DQW_WATCH_MAP_Q), DQW_WHY_NOT_ASKED);
        dqw_monitor_channel_q15 x;
        dqw_monitor_read_channel_q15(&m, DQW_WATCH_MAP_Q, &x);
        HOLDS(x.now == 0 && x.sd == INT32_MAX);
    }
    HOLDS(dqw_monitor_unwatched_q15(&m, (enum dqw_monitor_channel) - 1) == DQW_WHY_NOT_ASKED);
    HOLDS(dqw_monitor_unwatched_q15(&m, DQW_WATCH_CHANNELS) == DQW_WHY_NOT_ASKED);
}

static void test_while_nothing_is_watched(void)
{
    dqw_monitor_q15_config c = config_of();
    for (int way = 0; way < 4; way++) {
        dqw_monitor_q15 m;
        serving(&m, &c);
        if (way == 0) m.estimator.stage.name = DQW_STAGE_DOMAIN;
        m.watch.resting = way == 1;
        m.watch.alarms = way == 2;
        m.watch.wait = way == 3;
        HOLDS(dqw_monitor_why_q15(&m) != DQW_WHY_IN_SERVICE);
        only(&m, ALL, dqw_monitor_why_q15(&m));
    }
    // No block for 64 halves of a window is nothing, more is a pause.
    dqw_monitor_q15 m;
    serving(&m, &c);
    m.estimator.halves += 64;
    only(&m, 0, DQW_WHY_IN_SERVICE);
    m.estimator.halves++;
    only(&m, ALL, DQW_WHY_PAUSE);
}

static void test_what_the_motion_does_not_teach(void)
{
    dqw_monitor_q15_config c = config_of();
    dqw_monitor_q15 all;
    serving(&all, &c);
    for (int i = 0; i < DQW_WATCH_OFFSET; i++)
        for (int never = 0; never < 2; never++) {
            dqw_monitor_q15 m = all;
            m.estimator.excess_q10[dqw_watch_weight(i)] = (int16_t)never;
            if (never != 0) m.estimator.learned &= ~BIT(dqw_watch_weight(i));
            only(&m, BIT(i) | (i == DQW_WATCH_R ? BIT(DQW_WATCH_TEMPERATURE) : 0), DQW_WHY_NOT_TAUGHT);
        }
    dqw_monitor_q15 m = all;
    m.witness.blocks = DQW_WITNESS_MEMORY - 1;
    only(&m, WITNESS, DQW_WHY_NOT_TAUGHT);
    m = all;
    m.watch.reversals = DQW_WATCH_REVERSALS_LEAST - 1;
    only(&m, BIT(DQW_WATCH_FRICTION), DQW_WHY_NOT_TAUGHT);
    // What follows is compared by segments: none yet, then one that says nothing of L_d.
    c.estimator.follow = true;
    serving(&m, &c);
    for (int i = 0; i < DQW_FOLLOWED; i++) m.estimator.segment.share_q15[i] = 32768;
    for (int i = 0; i < DQW_FOLLOWED; i++) m.estimator.segment.band_q28[i] = fixed(0.001, Q28);
    only(&m, WEIGHTS, DQW_WHY_UNSETTLED);
    m.estimator.segment.segments = 100;
    only(&m, 0, DQW_WHY_IN_SERVICE);
    m.estimator.segment.share_q15[DQW_LD] = 327;
    only(&m, BIT(DQW_WATCH_LD), DQW_WHY_NOT_TAUGHT);
    // A quarter of it known, and a band of its own, which the first of two widens: 5.75 (1 + sqrt(1/50)) tau/sqrt(1/4).
    // (E178)
    const double wider = sqrt(1 + 8 * 0.02);
    m.estimator.segment.share_q15[DQW_LD] = 8192;
    m.estimator.segment.band_q28[DQW_LD] = fixed(0.02, Q28);
    NEAR(5.75 * (1 + sqrt(0.02)) * 2 * wider / (1 + wider) * 0.02 / 0.5 * 1.0,
         (double)dqw_monitor_sensitivity_q15(&m, DQW_WATCH_LD) / Q40);
    c.estimator.follow = false;
}

static void test_what_no_machine_has(void)
{
    dqw_monitor_q15_config c = config_of();
    dqw_monitor_q15 all;
    serving(&all, &c);
    for (int i = 0; i < DQW_WATCH_OFFSET; i++)
        for (int below = 0; below < 2; below++) {
            dqw_monitor_q15 m = all;
            const int w = dqw_watch_weight(i);
            m.estimator.w_q24[w] = below != 0 ? -m.estimator.w_q24[w] : 0;
            // Dead time and an angle may have either sign.
            only(&m, i > DQW_WATCH_PSI ? 0 : BIT(i) | (i == DQW_WATCH_R ? BIT(DQW_WATCH_TEMPERATURE) : 0),
                 DQW_WHY_SIGN);
            HOLDS(i > DQW_WATCH_PSI || !dqw_monitor_read_q15(&m, (enum dqw_monitor_channel)i).usable);
        }
}

static void test_what_is_not_known_well_enough(void)
{
    dqw_monitor_q15_config c = config_of();
    dqw_monitor_q15 all;
    serving(&all, &c);
    for (int i = 0; i < DQW_WATCH_TEMPERATURE; i++) {
        dqw_monitor_q15 m = all;
        m.watch.looks[i] = DQW_WATCH_LOOKS_LEAST;
        only(&m, 0, DQW_WHY_IN_SERVICE);
        m.watch.looks[i]--;
        only(&m, BIT(i) | (i == DQW_WATCH_R ? BIT(DQW_WATCH_TEMPERATURE) : 0), DQW_WHY_UNSETTLED);
    }
    // A temperature is as sure as R: to its band.
    dqw_monitor_q15 m = all;
    m.estimator.cov_q40[DQW_R] = (int64_t)1 << 60;
    HOLDS(dqw_monitor_unwatched_q15(&m, DQW_WATCH_TEMPERATURE) == DQW_WHY_UNSETTLED);
    HOLDS(dqw_monitor_sensitivity_q15(&m, DQW_WATCH_TEMPERATURE) == INT64_MAX);
}

// 0.3 of the first four and of a map's weights, ten usual bands of the others: here a band says it, else five deviations do.
static void test_what_is_watched_in_name_only(void)
{
    static const double usual[DQW_WATCH_TEMPERATURE] = {0.03, 0.03, 0.03, 0.03, 0.005, 0.02, 0.03,
                                                        0.03, 0.01, 0.03, 0.03, 0.003, 0.05};
    dqw_monitor_q15_config c = config_of();
    dqw_monitor_q15 m;
    serving(&m, &c);
    for (int i = 0; i < DQW_WATCH_TEMPERATURE; i++) {
        const double part = 10 * usual[i];
        for (int beyond = 0; beyond < 2; beyond++) {
            c.band_ppm[i] = (uint32_t)lrint(1e6 * part * (beyond ? 1.01 : 0.99));
            only(&m, beyond ? BIT(i) : 0, DQW_WHY_COARSE);
        }
        c.band_ppm[i] = 0;
    }
    m.estimator.cov_q40[DQW_R] = (int64_t)1 << 60;
    HOLDS(dqw_monitor_unwatched_q15(&m, DQW_WATCH_R) == DQW_WHY_COARSE);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_bands_are_the_documented_ones);
    RUN_TEST(test_what_a_channel_reads);
    RUN_TEST(test_what_is_surely_a_change);
    RUN_TEST(test_what_would_be_an_event);
    RUN_TEST(test_a_healthy_value_goes_part_of_the_way);
    RUN_TEST(test_what_the_configuration_does_not_ask_for);
    RUN_TEST(test_while_nothing_is_watched);
    RUN_TEST(test_what_the_motion_does_not_teach);
    RUN_TEST(test_what_no_machine_has);
    RUN_TEST(test_what_is_not_known_well_enough);
    RUN_TEST(test_what_is_watched_in_name_only);
    return UNITY_END();
}
