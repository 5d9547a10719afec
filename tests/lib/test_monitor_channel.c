// A monitor's channels by themselves: bands as they are documented, what is read, how far a healthy value moves, why
// one is not watched; from numbers set by hand, against their closed forms in double.
#include "bent_iron.h"
#include "dqw_estimator_block.h"
#include "dqw_monitor_channel.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

static const double HEALTHY[DQW_WATCH_OFFSET] = {0.5, 1.0e-3, 1.4e-3, 0.02, 0.2, 0.001, 1.1, 0.9};
static const double RE[DQW_WITNESS_INPUTS] = {0.01, -0.02, 3e-5, 0.004};
static const double IM[DQW_WITNESS_INPUTS] = {-0.03, 0.01, 4e-5, -0.003};

// With a flux map, so that all channels are asked for.
static dqw_monitor_config config_of(void)
{
    static dqw_effect_config map;
    map = (dqw_effect_config){.effect = DQW_EFFECT_FLUX_MAP,
                              .shape = {(float)BENT_FULL_WB, (float)BENT_CELL_D_A, (float)BENT_CELL_Q_A},
                              .start = {1.05f, 0.95f},
                              .map = bent_table()};
    const dqw_monitor_config c = {.estimator = {.dt_s = 5e-5f,
                                                .v_base_V = 14.0f,
                                                .i_base_A = 6.0f,
                                                .w_base_rad_s = 110.0f,
                                                .R_ohm = 0.55f,
                                                .Ld_H = 1.1e-3f,
                                                .Lq_H = 1.3e-3f,
                                                .psi_Wb = 0.021f,
                                                .pole_pairs = 4,
                                                .dead_time_width_A = 0.05f,
                                                .angle = true,
                                                .encoder_offset = true,
                                                .effects = &map,
                                                .effect_count = 1}};
    return c;
}

static dqw_monitor begin(const dqw_monitor_config *c)
{
    dqw_monitor m;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_monitor_init(&m, c));
    for (int i = 0; i < DQW_WATCH_OFFSET; i++) m.healthy.weight[i] = (float)HEALTHY[i];
    for (int k = 0; k < DQW_WITNESS_INPUTS; k++) {
        m.healthy.re[k] = (float)RE[k];
        m.healthy.im[k] = (float)IM[k];
    }
    return m;
}

#define NEAR(expected, value) BETWEEN((expected)-1e-5 * fabs(expected), (value), (expected) + 1e-5 * fabs(expected))

static void test_bands_are_the_documented_ones(void)
{
    const double L3 = (HEALTHY[1] + HEALTHY[2]) / 6;
    const double torque_Nm = 1.5 * 4 * HEALTHY[3] * 6;
    const double band[DQW_WATCH_TEMPERATURE] = {
        0.04 * 0.5, 0.06 * 1e-3, 0.06 * 1.4e-3,  0.012 * 0.02, 0.005 * 14,        0.02 * 0.02,     0.06 * 1.1,
        0.06 * 0.9, 0.01 * 6,    0.03 * 0.5 / 3, 0.03 * L3,    0.003 / (3 * 0.5), 0.05 * torque_Nm};
    dqw_monitor_config c = config_of();
    const dqw_monitor m = begin(&c);
    for (int i = 0; i < DQW_WATCH_TEMPERATURE; i++) {
        CASE("channel %d", i);
        c.band[i] = 0.0f;
        NEAR(band[i], dqw_monitor_band_of(&m, i));
        const double part = (double)dqw_monitor_band(&m, i);
        c.band[i] = 0.5f;
        NEAR(band[i] * 0.5 / part, dqw_monitor_band_of(&m, i));
    }
    NEAR(110.0, dqw_monitor_band(&m, DQW_WATCH_TEMPERATURE));
    NEAR(3.0, dqw_monitor_band(&m, DQW_WATCH_RESIDUAL));
    NEAR(0.0039, dqw_monitor_alpha(&m));
    NEAR(0.001, dqw_monitor_beta(&m));
    c.alpha_per_K = 0.5f, c.beta_per_K = 0.25f;
    HOLDS(dqw_monitor_alpha(&m) == 0.5f && dqw_monitor_beta(&m) == 0.25f);
}

// A map's weights are followed, each in parts of itself. (E104)
static void test_least_bands_of_a_map(void)
{
    const dqw_monitor_config c = config_of();
    dqw_monitor m = begin(&c);
    float band[DQW_FOLLOWED];
    for (int i = DQW_PARAMETERS; i < DQW_FOLLOWED; i++) m.estimator.w_pu[i] = (i % 2 ? -0.3f : 0.5f);
    dqw_estimator_least_bands(&m.estimator, band);
    for (int i = DQW_PARAMETERS; i < DQW_FOLLOWED; i++) NEAR(0.002 * (i % 2 ? 0.3 : 0.5), (double)band[i]);
}

static void test_what_a_channel_reads(void)
{
    const dqw_monitor_config c = config_of();
    dqw_monitor m = begin(&c);
    static const double nominal[DQW_WATCH_OFFSET] = {0.55, 1.1e-3, 1.3e-3, 0.021, 0.0, 0.0, 1.05, 0.95};
    dqw_monitor_channel_value x;
    for (int i = 0; i < DQW_WATCH_OFFSET; i++) {
        CASE("channel %d", i);
        dqw_monitor_read_channel(&m, i, &x);
        NEAR(nominal[i], x.now);
        BETWEEN(nominal[i] - HEALTHY[i] - 1e-7, x.change, nominal[i] - HEALTHY[i] + 1e-7);
        HOLDS(x.sd == DQW_UNKNOWN && !dqw_monitor_read(&m, (enum dqw_monitor_channel)i).usable);
    }
    for (int k = 0; k < DQW_WITNESS_INPUTS; k++) {
        CASE("witness %d", k);
        m.witness.re[k] = (float)(2 * RE[k]);
        m.witness.im[k] = (float)(-IM[k]);
        dqw_monitor_read_channel(&m, DQW_WATCH_OFFSET + k, &x);
        NEAR(hypot(2 * RE[k], IM[k]), x.now);
        NEAR(hypot(RE[k], 2 * IM[k]), x.change);
        HOLDS(x.sd == DQW_UNKNOWN);
    }
    // Its own mean power and both axes' residual make a witness' deviation, once its memory is full. (E62)
    m.estimator.error_pu2[0] = 1e-4f, m.estimator.error_pu2[1] = 3e-4f;
    for (int k = 0; k < DQW_WITNESS_INPUTS; k++) {
        CASE("witness %d", k);
        m.witness.power[k] = 0.5f;
        m.witness.blocks = DQW_WITNESS_MEMORY - 1;
        HOLDS(dqw_monitor_read(&m, (enum dqw_monitor_channel)(DQW_WATCH_OFFSET + k)).sd == DQW_UNKNOWN);
        m.witness.blocks = DQW_WITNESS_MEMORY;
        NEAR(14 * sqrt(2e-4 / (2.0 * DQW_WITNESS_MEMORY * 0.5)),
             dqw_monitor_read(&m, (enum dqw_monitor_channel)(DQW_WATCH_OFFSET + k)).sd);
        m.witness.power[k] = 0.0f;
        HOLDS(dqw_monitor_read(&m, (enum dqw_monitor_channel)(DQW_WATCH_OFFSET + k)).sd == DQW_UNKNOWN);
    }
    // Friction is known from eight reversals on. (E65)
    m.friction_Nm = -0.03f, m.healthy.friction_Nm = 0.05f, m.spread_Nm2 = 4e-8f;
    for (uint8_t n = 0; n <= DQW_WATCH_REVERSALS_MOST; n++) {
        CASE("%d reversals", n);
        m.watch.reversals = n;
        dqw_monitor_read_channel(&m, DQW_WATCH_FRICTION, &x);
        NEAR(-0.03, x.now);
        NEAR(-0.08, x.change);
        if (n < 8)
            HOLDS(x.sd == DQW_UNKNOWN);
        else
            NEAR(sqrt(2 * 4e-8 / n), x.sd);
    }
    // Three deviations below a tenth of it, whatever its sign.
    for (int usable = 0; usable < 2; usable++) {
        const double least = 0.03 / 30 * (usable ? 0.99 : 1.01);
        m.spread_Nm2 = (float)(0.5 * least * least * DQW_WATCH_REVERSALS_MOST);
        HOLDS(dqw_monitor_read(&m, DQW_WATCH_FRICTION).usable == (usable == 1));
    }
    // The temperature counts from a cold value; of the residual the last blocks' is read.
    HOLDS(dqw_monitor_read(&m, DQW_WATCH_TEMPERATURE).sd == DQW_UNKNOWN &&
          dqw_monitor_read(&m, DQW_WATCH_TEMPERATURE).value == 0.0f);
    m.healthy.cold_R_ohm = 0.44f;
    dqw_monitor_read_channel(&m, DQW_WATCH_TEMPERATURE, &x);
    NEAR(0.25 / 0.0039, x.now);
    HOLDS(x.change == x.now && x.sd == DQW_UNKNOWN);
    m.estimator.blocks = 1000;
    // A parameter is read as the estimator has it: wider than a change by what an opening left open.
    m.estimator.learned = (1u << DQW_PARAMETERS) - 1u;
    m.estimator.opened = 1;
    m.estimator.segment.since = 1;
    m.estimator.error_pu2[0] = m.estimator.error_pu2[1] = 1e-12f;
    for (int i = 0; i <= DQW_WATCH_ANGLE; i++) {
        m.estimator.segment.band_pu[i] = 100.0f;
        const dqw_reading r = dqw_monitor_read(&m, (enum dqw_monitor_channel)i);
        const dqw_reading of = dqw_estimator_read(&m.estimator, (enum dqw_parameter)i);
        CASE("channel %d", i);
        HOLDS(r.value == of.value && r.sd == of.sd && r.sd_change == of.sd_change && r.usable == of.usable);
        HOLDS(r.sd > 1.01f * r.sd_change);
        // A stage that begins anew has nothing to use.
        m.estimator.segment.band_pu[i] = 0.0f;
        m.estimator.gain.d[i] = 1e-3f;
        if (i > DQW_WATCH_PSI) m.estimator.w_pu[i] = 0.5f;
        for (int anew = 0; anew < 2; anew++) {
            m.estimator.stage.name = anew ? DQW_STAGE_DOMAIN : DQW_STAGE_RANDOM;
            HOLDS(dqw_monitor_read(&m, (enum dqw_monitor_channel)i).usable == (anew == 0));
        }
        m.estimator.stage.name = DQW_STAGE_RANDOM;
    }
    m.estimator.error_pu2[0] = m.estimator.error_pu2[1] = 0.0f;
    m.estimator.opened = 0;
    m.estimator.segment.since = 0;
    m.estimator.learned = 1u << DQW_R;
    const double R_sd = (double)dqw_monitor_read(&m, DQW_WATCH_R).sd;
    HOLDS(R_sd < (double)DQW_UNKNOWN);
    NEAR(R_sd / (0.44 * 0.0039), dqw_monitor_read(&m, DQW_WATCH_TEMPERATURE).sd);
    m.estimator.recent_pu2 = 0.0004f;
    dqw_monitor_read_channel(&m, DQW_WATCH_RESIDUAL, &x);
    NEAR(0.02 * 14, x.now);
    HOLDS(x.change == x.now && x.sd == 0.0f);
    for (int i = -1; i <= DQW_WATCH_CHANNELS; i += DQW_WATCH_CHANNELS + 1) {
        const dqw_reading r = dqw_monitor_read(&m, (enum dqw_monitor_channel)i);
        HOLDS(r.value == 0.0f && r.sd == DQW_UNKNOWN && r.sd_change == DQW_UNKNOWN && !r.usable);
    }
}

// A change is one beyond the band, or beyond five deviations of itself and of a mean over so many looks. (E63)
static void test_what_is_surely_a_change(void)
{
    const dqw_monitor_config c = config_of();
    dqw_monitor m = begin(&c);
    const double band = 0.04 * 0.5;
    for (int looks = 0; looks <= 255; looks += 51) {
        m.watch.looks[DQW_WATCH_R] = (uint8_t)looks;
        const double wider = 5 * sqrt(1 + 20.0 / (20 + looks));
        for (double part = 0.5; part < 2.0; part += 0.25) {
            CASE("%d looks, %g of the band", looks, part);
            NEAR(fmax(band, part * band), dqw_monitor_surely(&m, DQW_WATCH_R, (float)(part * band / wider)));
        }
        HOLDS(dqw_monitor_surely(&m, DQW_WATCH_R, DQW_UNKNOWN) == DQW_UNKNOWN);
    }
    // A ripple may turn round.
    for (int k = 0; k < DQW_WITNESS_INPUTS; k++)
        for (int looks = 0; looks <= 255; looks += 51) {
            const int channel = DQW_WATCH_OFFSET + k;
            const double width = (double)dqw_monitor_band_of(&m, channel);
            m.watch.looks[channel] = (uint8_t)looks;
            for (double size = 0.1; size < 3.0; size += 0.3) {
                CASE("channel %d, %d looks, a healthy ripple of %g bands", channel, looks, size);
                m.healthy.re[k] = (float)(0.6 * size * width);
                m.healthy.im[k] = (float)(-0.8 * size * width);
                NEAR(width * fmax(1, 2 * size), dqw_monitor_surely(&m, channel, 0.0f));
            }
        }
    // Of a resistance and a gain it may be the other's, in the one's unit at the mean speed, either way round.
    const double power[2] = {4.0, 360000.0};
    const double size[2] = {0.02, 4e-5};
    for (int k = 0; k < 2; k++) {
        m.witness.power[DQW_WITNESS_RESISTANCE + k] = (float)power[k];
        m.healthy.re[DQW_WITNESS_RESISTANCE + k] = 0.0f;
        m.healthy.im[DQW_WITNESS_RESISTANCE + k] = (float)(k == 0 ? size[k] : -size[k]);
    }
    for (int way = -2; way <= 2; way++)
        for (int k = 0; k < 2; k++) {
            CASE("input %d, the speed's mean %d hundreds", k, way);
            const bool stands = way != 1;
            m.watch.looks[DQW_WATCH_RESISTANCE] = m.watch.looks[DQW_WATCH_REACTANCE] = 30;
            if (!stands) m.watch.looks[DQW_WATCH_REACTANCE - k] = 19;
            m.witness.across = (float)(power[0] * 100 * way);
            const double speed = stands ? power[0] * 100 * abs(way) / power[k] : 0;
            NEAR(2 * (size[k] + speed * size[1 - k]), dqw_monitor_surely(&m, DQW_WATCH_RESISTANCE + k, 0.0f));
        }
}

// What would be an event: known in service alone, of a mean of twenty looks or more.
static void test_what_would_be_an_event(void)
{
    const dqw_monitor_config c = config_of();
    dqw_monitor m = begin(&c);
    m.healthy.cold_R_ohm = 0.5f;
    m.healthy.residual_pu2 = 0.0001f;
    m.watch.looks[DQW_WATCH_R] = 20;
    m.estimator.excess_q10[DQW_R] = 1;
    m.estimator.gain.d[DQW_R] *= 0.01f;
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
        HOLDS(dqw_monitor_sensitivity(&m, DQW_WATCH_R) == DQW_UNKNOWN);
        m.watch.looks[DQW_WATCH_R] = 20;
        HOLDS((dqw_monitor_sensitivity(&m, DQW_WATCH_R) < DQW_UNKNOWN) == (way == 5));
        HOLDS((dqw_monitor_sensitivity(&m, DQW_WATCH_TEMPERATURE) < DQW_UNKNOWN) == (way == 5));
        HOLDS((dqw_monitor_sensitivity(&m, DQW_WATCH_RESIDUAL) < DQW_UNKNOWN) == serves);
    }
    NEAR(1.25 * fmax(0.04 * 0.5, 5 * sqrt(1.5) * (double)dqw_monitor_read(&m, DQW_WATCH_R).sd),
         dqw_monitor_sensitivity(&m, DQW_WATCH_R));
    NEAR(110.0 + 1.64 * (double)dqw_monitor_read(&m, DQW_WATCH_R).sd / (0.5 * 0.0039),
         dqw_monitor_sensitivity(&m, DQW_WATCH_TEMPERATURE));
    // Of R by what heat may have made of it since it was last followed: 1 K/s, and 1.3 times. (E178)
    const double before = (double)dqw_monitor_sensitivity(&m, DQW_WATCH_R);
    m.estimator.number += 5 * 256, m.watch.learned_at = m.estimator.halves = m.estimator.number;
    NEAR(1.3 * 0.0039 * 0.5 * 5 * 256 * m.estimator.window.half * (double)c.estimator.dt_s,
         (double)dqw_monitor_sensitivity(&m, DQW_WATCH_R) - before);
    NEAR(3 * 0.01 * 14, dqw_monitor_sensitivity(&m, DQW_WATCH_RESIDUAL));
    HOLDS(dqw_monitor_sensitivity(&m, DQW_WATCH_CHANNELS) == DQW_UNKNOWN);
}

static void test_a_healthy_value_goes_part_of_the_way(void)
{
    const dqw_monitor_config c = config_of();
    for (int n = 0; n < 3; n++) {
        const double keep = 0.375 * n;
        dqw_monitor m = begin(&c);
        for (int k = 0; k < DQW_WITNESS_INPUTS; k++) {
            m.witness.re[k] = (float)(3 * RE[k]);
            m.witness.im[k] = (float)(-2 * IM[k]);
        }
        m.friction_Nm = 0.03f, m.healthy.friction_Nm = 0.07f;
        for (int i = 0; i < DQW_WATCH_TEMPERATURE; i++) dqw_monitor_move_healthy(&m, i, (float)keep);
        for (int i = 0; i < DQW_WATCH_OFFSET; i++) {
            CASE("keeps %g, channel %d", keep, i);
            const double now = (double)dqw_monitor_read(&m, (enum dqw_monitor_channel)i).value;
            BETWEEN(-1e-6, (double)m.healthy.weight[i] - (now + keep * (HEALTHY[i] - now)), 1e-6);
        }
        for (int k = 0; k < DQW_WITNESS_INPUTS; k++) {
            CASE("keeps %g, witness %d", keep, k);
            NEAR(RE[k] * (3 - 2 * keep), m.healthy.re[k]);
            NEAR(IM[k] * (3 * keep - 2), m.healthy.im[k]);
        }
        NEAR(0.03 + 0.04 * keep, m.healthy.friction_Nm);
    }
}

// ---- why a channel is not watched ----

// In service with everything known and taught: all is watched.
static dqw_monitor serving(dqw_monitor_config *c)
{
    c->J_kgm2 = 1e-4f;
    dqw_monitor m = begin(c);
    m.healthy.cold_R_ohm = 0.5f;
    m.healthy.residual_pu2 = 0.0001f;
    m.healthy.friction_Nm = m.friction_Nm = 0.05f;
    m.spread_Nm2 = 1e-8f;
    m.estimator.stage.name = DQW_STAGE_IN_SERVICE;
    m.estimator.learned = (1u << DQW_FOLLOWED) - 1u;
    m.estimator.blocks = 1000;
    m.estimator.halves = m.watch.learned_at = 4000;
    for (int i = 0; i < DQW_FOLLOWED; i++) m.estimator.gain.d[i] *= 1e-4f;
    for (int i = 0; i < DQW_FOLLOWED; i++) m.estimator.excess_q10[i] = 1;
    for (int k = 0; k < DQW_WITNESS_INPUTS; k++) m.witness.power[k] = 0.5f;
    m.witness.blocks = DQW_WITNESS_MEMORY;
    m.watch.reversals = DQW_WATCH_REVERSALS_MOST;
    for (int i = 0; i < DQW_WATCH_TEMPERATURE; i++) m.watch.looks[i] = DQW_WATCH_LOOKS_MOST;
    return m;
}

// Channels as bits.
#define BIT(channel) (1u << (channel))
#define WITNESS (BIT(DQW_WATCH_OFFSET) | BIT(DQW_WATCH_RESISTANCE) | BIT(DQW_WATCH_REACTANCE) | BIT(DQW_WATCH_SHORT))
#define WEIGHTS (BIT(DQW_WATCH_OFFSET) - 1u)
#define ALL (BIT(DQW_WATCH_CHANNELS) - 1u)

// These channels have this reason, the others are watched; and what is watched, if in name alone, has a sensitivity.
static void only(const dqw_monitor *m, unsigned channels, enum dqw_why why)
{
    for (int i = 0; i < DQW_WATCH_CHANNELS; i++) {
        const enum dqw_why is = dqw_monitor_unwatched(m, (enum dqw_monitor_channel)i);
        CASE("channels %x, reason %d: channel %d, %d", channels, (int)why, i, (int)is);
        HOLDS(is == ((channels >> i & 1u) != 0 ? why : DQW_WHY_IN_SERVICE));
        HOLDS((dqw_monitor_sensitivity(m, (enum dqw_monitor_channel)i) < DQW_UNKNOWN) ==
              (is == DQW_WHY_IN_SERVICE || is == DQW_WHY_COARSE));
    }
}

static void test_what_the_configuration_does_not_ask_for(void)
{
    dqw_monitor_config c = config_of();
    dqw_monitor m = serving(&c);
    only(&m, 0, DQW_WHY_IN_SERVICE);
    c.J_kgm2 = 0;
    only(&m, BIT(DQW_WATCH_FRICTION), DQW_WHY_NOT_ASKED);
    // Before service too: it will never be watched.
    m.estimator.stage.name = DQW_STAGE_ORDINAL;
    HOLDS(dqw_monitor_unwatched(&m, DQW_WATCH_FRICTION) == DQW_WHY_NOT_ASKED);
    HOLDS(dqw_monitor_unwatched(&m, DQW_WATCH_R) == dqw_monitor_why(&m));
    c = config_of();
    c.estimator.dead_time_width_A = 0;
    m = serving(&c);
    only(&m, BIT(DQW_WATCH_DEAD_TIME), DQW_WHY_NOT_ASKED);
    c = config_of();
    c.estimator.observed = true;
    m = serving(&c);
    only(&m, BIT(DQW_WATCH_LQ), DQW_WHY_OBSERVED);
    c = config_of();
    c.estimator.encoder_offset = false;
    m = serving(&c);
    only(&m, BIT(DQW_WATCH_ANGLE), DQW_WHY_NOT_ASKED);
    c = config_of();
    c.estimator.angle = false;
    m = serving(&c);
    only(&m, WITNESS | BIT(DQW_WATCH_DEAD_TIME), DQW_WHY_NOT_ASKED);
    // Without a map, or with one that is not the first.
    dqw_effect_config two[2] = {{.effect = DQW_EFFECT_SKIN_EFFECT}, *config_of().estimator.effects};
    for (int effects = 0; effects <= 2; effects += 2) {
        c = config_of();
        c.estimator.effects = two;
        c.estimator.effect_count = (uint8_t)effects;
        m = serving(&c);
        only(&m, BIT(DQW_WATCH_MAP_D) | BIT(DQW_WATCH_MAP_Q), DQW_WHY_NOT_ASKED);
        dqw_monitor_channel_value x;
        dqw_monitor_read_channel(&m, DQW_WATCH_MAP_Q, &x);
        HOLDS(x.now == 0.0f && x.sd == DQW_UNKNOWN);
    }
    HOLDS(dqw_monitor_unwatched(&m, (enum dqw_monitor_channel) - 1) == DQW_WHY_NOT_ASKED);
    HOLDS(dqw_monitor_unwatched(&m, DQW_WATCH_CHANNELS) == DQW_WHY_NOT_ASKED);
}

static void test_while_nothing_is_watched(void)
{
    dqw_monitor_config c = config_of();
    for (int way = 0; way < 4; way++) {
        dqw_monitor m = serving(&c);
        if (way == 0) m.estimator.stage.name = DQW_STAGE_DOMAIN;
        m.watch.resting = way == 1;
        m.watch.alarms = way == 2;
        m.watch.wait = way == 3;
        HOLDS(dqw_monitor_why(&m) != DQW_WHY_IN_SERVICE);
        only(&m, ALL, dqw_monitor_why(&m));
    }
    // No block for 64 halves of a window is nothing, more is a pause.
    dqw_monitor m = serving(&c);
    m.estimator.halves += 64;
    only(&m, 0, DQW_WHY_IN_SERVICE);
    m.estimator.halves++;
    only(&m, ALL, DQW_WHY_PAUSE);
}

static void test_what_the_motion_does_not_teach(void)
{
    dqw_monitor_config c = config_of();
    const dqw_monitor all = serving(&c);
    for (int i = 0; i < DQW_WATCH_OFFSET; i++)
        for (int never = 0; never < 2; never++) {
            dqw_monitor m = all;
            m.estimator.excess_q10[dqw_watch_weight(i)] = (int16_t)never;
            if (never != 0) m.estimator.learned &= ~BIT(dqw_watch_weight(i));
            only(&m, BIT(i) | (i == DQW_WATCH_R ? BIT(DQW_WATCH_TEMPERATURE) : 0), DQW_WHY_NOT_TAUGHT);
        }
    dqw_monitor m = all;
    m.witness.blocks = DQW_WITNESS_MEMORY - 1;
    only(&m, WITNESS, DQW_WHY_NOT_TAUGHT);
    m = all;
    m.watch.reversals = DQW_WATCH_REVERSALS_LEAST - 1;
    only(&m, BIT(DQW_WATCH_FRICTION), DQW_WHY_NOT_TAUGHT);
    // What follows is compared by segments: none yet, then one that says nothing of L_d.
    c.estimator.follow = true;
    m = serving(&c);
    for (int i = 0; i < DQW_FOLLOWED; i++) m.estimator.segment.share_q15[i] = 32768;
    for (int i = 0; i < DQW_FOLLOWED; i++) m.estimator.segment.band_pu[i] = 0.0001f;
    only(&m, WEIGHTS, DQW_WHY_UNSETTLED);
    m.estimator.segment.segments = 100;
    only(&m, 0, DQW_WHY_IN_SERVICE);
    m.estimator.segment.share_q15[DQW_LD] = 328;
    only(&m, BIT(DQW_WATCH_LD), DQW_WHY_NOT_TAUGHT);
    // A quarter of it known, and a band of its own, which the first of two widens: 5.75 (1 + sqrt(1/50)) tau/sqrt(1/4).
    // (E178)
    const double wider = sqrt(1 + 8 * 0.02);
    m.estimator.segment.share_q15[DQW_LD] = 8192;
    m.estimator.segment.band_pu[DQW_LD] = 0.02f;
    NEAR(5.75 * (1 + sqrt(0.02)) * 2 * wider / (1 + wider) * 0.02 / 0.5 *
             (double)dqw_estimator_unit(&m.estimator, DQW_LD),
         (double)dqw_monitor_sensitivity(&m, DQW_WATCH_LD));
    // What no residual shows is less of a change, the longer nothing was found changed; what would be is three segments
    // old at most. (E178)
    m.estimator.segment.band_pu[DQW_LD] = 0.0001f;
    m.estimator.calm.fast_pu2 = 1e-3f, m.estimator.alone_pu2[DQW_LD] = 1.0f;
    m.estimator.segment.since = 99;
    const double late = (double)dqw_monitor_read(&m, DQW_WATCH_LD).sd_change;
    const double opened = (double)dqw_estimator_sd_since(&m.estimator, DQW_LD, 3);
    HOLDS(opened > 2 * late);
    NEAR(6.25 * sqrt(1 + 20.0 / (20 + m.watch.looks[DQW_WATCH_LD])) * opened,
         (double)dqw_monitor_sensitivity(&m, DQW_WATCH_LD));
    c.estimator.follow = false;
}

static void test_what_no_machine_has(void)
{
    dqw_monitor_config c = config_of();
    const dqw_monitor all = serving(&c);
    for (int i = 0; i < DQW_WATCH_OFFSET; i++)
        for (int below = 0; below < 2; below++) {
            dqw_monitor m = all;
            const int w = dqw_watch_weight(i);
            m.estimator.w_pu[w] = below != 0 ? -m.estimator.w_pu[w] : 0;
            // Dead time and an angle may have either sign.
            only(&m, i > DQW_WATCH_PSI ? 0 : BIT(i) | (i == DQW_WATCH_R ? BIT(DQW_WATCH_TEMPERATURE) : 0),
                 DQW_WHY_SIGN);
            HOLDS(i > DQW_WATCH_PSI || !dqw_monitor_read(&m, (enum dqw_monitor_channel)i).usable);
        }
}

static void test_what_is_not_known_well_enough(void)
{
    dqw_monitor_config c = config_of();
    const dqw_monitor all = serving(&c);
    for (int i = 0; i < DQW_WATCH_TEMPERATURE; i++) {
        dqw_monitor m = all;
        m.watch.looks[i] = DQW_WATCH_LOOKS_LEAST;
        only(&m, 0, DQW_WHY_IN_SERVICE);
        m.watch.looks[i]--;
        only(&m, BIT(i) | (i == DQW_WATCH_R ? BIT(DQW_WATCH_TEMPERATURE) : 0), DQW_WHY_UNSETTLED);
    }
    // A temperature is as sure as R: to its band.
    dqw_monitor m = all;
    m.estimator.gain.d[DQW_R] *= 1e4f;
    HOLDS(dqw_monitor_unwatched(&m, DQW_WATCH_TEMPERATURE) == DQW_WHY_UNSETTLED);
    HOLDS(dqw_monitor_sensitivity(&m, DQW_WATCH_TEMPERATURE) == DQW_UNKNOWN);
}

// 0.3 of the first four and of a map's weights, ten usual bands of the others: here a band says it, else five deviations do.
static void test_what_is_watched_in_name_only(void)
{
    static const double usual[DQW_WATCH_TEMPERATURE] = {0.03, 0.03, 0.03, 0.03, 0.005, 0.02, 0.03,
                                                        0.03, 0.01, 0.03, 0.03, 0.003, 0.05};
    dqw_monitor_config c = config_of();
    dqw_monitor m = serving(&c);
    for (int i = 0; i < DQW_WATCH_TEMPERATURE; i++) {
        const double part = 10 * usual[i];
        for (int beyond = 0; beyond < 2; beyond++) {
            c.band[i] = (float)(part * (beyond ? 1.01 : 0.99));
            only(&m, beyond ? BIT(i) : 0, DQW_WHY_COARSE);
        }
        c.band[i] = 0.0f;
    }
    m.estimator.gain.d[DQW_R] *= 1e4f;
    HOLDS(dqw_monitor_unwatched(&m, DQW_WATCH_R) == DQW_WHY_COARSE);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_bands_are_the_documented_ones);
    RUN_TEST(test_least_bands_of_a_map);
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
