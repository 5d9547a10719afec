// A monitor's channels by themselves: bands as they are documented, what is read, how far a healthy value moves; from
// numbers set by hand, against their closed forms in double.
#include "dqw_monitor_channel.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

static const double HEALTHY[DQW_WATCH_OFFSET] = {0.5, 1.0e-3, 1.4e-3, 0.02, 0.2, 0.001};
static const double RE[DQW_WITNESS_INPUTS] = {0.01, -0.02, 3e-5, 0.004};
static const double IM[DQW_WITNESS_INPUTS] = {-0.03, 0.01, 4e-5, -0.003};

static dqw_monitor_config config_of(void)
{
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
                                                .encoder_offset = true}};
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
    const double band[DQW_WATCH_TEMPERATURE] = {0.04 * 0.5, 0.06 * 1e-3,       0.06 * 1.4e-3,   0.012 * 0.02,
                                                0.005 * 14, 0.02 * 0.02,       0.01 * 6,        0.03 * 0.5 / 3,
                                                0.03 * L3,  0.003 / (3 * 0.5), 0.05 * torque_Nm};
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

static void test_what_a_channel_reads(void)
{
    const dqw_monitor_config c = config_of();
    dqw_monitor m = begin(&c);
    static const double nominal[DQW_WATCH_OFFSET] = {0.55, 1.1e-3, 1.3e-3, 0.021, 0.0, 0.0};
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
    m.estimator.learned = 1u << DQW_R;
    m.estimator.blocks = 1000;
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
}

// What would be an event: known in service alone, of a mean of twenty looks or more.
static void test_what_would_be_an_event(void)
{
    const dqw_monitor_config c = config_of();
    dqw_monitor m = begin(&c);
    m.healthy.cold_R_ohm = 0.5f;
    m.healthy.residual_pu2 = 0.0001f;
    m.watch.looks[DQW_WATCH_R] = 20;
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
    NEAR(fmax(0.04 * 0.5, 5 * sqrt(1.5) * (double)dqw_monitor_read(&m, DQW_WATCH_R).sd),
         dqw_monitor_sensitivity(&m, DQW_WATCH_R));
    NEAR(110.0, dqw_monitor_sensitivity(&m, DQW_WATCH_TEMPERATURE));
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

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_bands_are_the_documented_ones);
    RUN_TEST(test_what_a_channel_reads);
    RUN_TEST(test_what_is_surely_a_change);
    RUN_TEST(test_what_would_be_an_event);
    RUN_TEST(test_a_healthy_value_goes_part_of_the_way);
    return UNITY_END();
}
