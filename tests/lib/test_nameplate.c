// Half a block's pairs from the nameplate: machines by hand, the three bounds everywhere, float and fixed point against
// exact integers.
#include "dqw_estimator.h"
#include "dqw_estimator_q15.h"
#include "dqw_half_window.h"
#include "dqw_nameplate_q15.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

static void test_machines(void)
{
    static const struct {
        const char *text;
        float dt_s, w_m_rad_s;
        uint16_t pole_pairs, half;
    } machines[] = {
        {"joint at 20 kHz", 5e-5f, 110.0f, 4, 20},
        {"servo at 16 kHz, a millisecond", 62.5e-6f, 314.0f, 3, 16},
        {"small fan at 24 kHz, 30000 a minute", 1.0f / 24000.0f, 3141.6f, 1, 8},
        {"drone at 48 kHz, 2700 rad/s electrical", 1.0f / 48000.0f, 385.0f, 7, 19},
        {"small fast spindle at 20 kHz", 5e-5f, 1571.0f, 2, 7},
        {"faster than a block can be short", 5e-5f, 5000.0f, 4, 5},
        {"slow sampling", 1e-3f, 100.0f, 4, 5},
        {"fast sampling", 1e-8f, 1.0f, 1, 10000},
        {"pole pairs not known", 5e-5f, 5000.0f, 0, 20},
        {"speed not known", 5e-5f, 0.0f, 4, 20},
    };
    for (unsigned k = 0; k < sizeof machines / sizeof machines[0]; k++) {
        const dqw_nameplate plate = {.dt_s = machines[k].dt_s,
                                     .v_V = 14.0f,
                                     .i_A = 6.0f,
                                     .w_m_rad_s = machines[k].w_m_rad_s,
                                     .pole_pairs = machines[k].pole_pairs};
        CASE("%s: %u", machines[k].text, (unsigned)dqw_nameplate_half_window(&plate));
        HOLDS(dqw_nameplate_half_window(&plate) == machines[k].half);
        const dqw_scale scale = {.dt_ns = (uint32_t)lround(1e9 * (double)machines[k].dt_s),
                                 .w_full_mrad_s = (uint32_t)lround(1e3 * (double)machines[k].w_m_rad_s),
                                 .pole_pairs = machines[k].pole_pairs};
        const int difference = dqw_nameplate_half_window_q15(&scale) - dqw_nameplate_half_window(&plate);
        // 1e9/24000 is rounded to a whole nanosecond.
        HOLDS(abs(difference) <= (machines[k].half == 10000 ? 0 : 1));
    }
}

// The longest within both times, unless that is beyond 5 .. 10000.
static void test_no_longer_and_no_shorter_than_it_says(void)
{
    test_random r = {3};
    for (int k = 0; k < scaled(200000); k++) {
        const dqw_scale scale = {.dt_ns = (uint32_t)pow(10, random_uniform(&r, 1, 7)),
                                 .w_full_mrad_s = (uint32_t)pow(10, random_uniform(&r, 0, 7)),
                                 .pole_pairs = (uint16_t)random_uniform(&r, 0, 40)};
        const dqw_nameplate plate = {.dt_s = (float)(1e-9 * scale.dt_ns),
                                     .w_m_rad_s = (float)(1e-3 * scale.w_full_mrad_s),
                                     .pole_pairs = scale.pole_pairs};
        const int halves[] = {dqw_nameplate_half_window(&plate), dqw_nameplate_half_window_q15(&scale)};
        for (int arithmetic = 0; arithmetic < 2; arithmetic++) {
            const int h = halves[arithmetic];
            const double w_e = 1e-3 * scale.pole_pairs * (double)scale.w_full_mrad_s;
            const double dt_s = 1e-9 * scale.dt_ns;
            const double longest_s = w_e > 1100 ? 1.1 / w_e : 1e-3;
            CASE("%s: %d pairs of %g s at %g rad/s", arithmetic ? "q15" : "float", h, dt_s, w_e);
            HOLDS(h >= 5 && h <= 10000);
            if (h > 5) HOLDS(h * dt_s <= longest_s * 1.00001);
            // Fixed point cuts a nanosecond off, and then a pair.
            if (h < 10000) HOLDS((h + 1) * dt_s > longest_s * 0.99999 - 2e-9);
        }
    }
}

static void test_any_bits(void)
{
    test_random r = {4};
    for (int k = 0; k < scaled(100000); k++) {
        const dqw_nameplate plate = {random_float_bits(&r), random_float_bits(&r), random_float_bits(&r),
                                     random_float_bits(&r), (uint16_t)random_bits(&r)};
        const int h = dqw_nameplate_half_window(&plate);
        CASE("period %g s, speed %g rad/s, %u pole pairs: %d", (double)plate.dt_s, (double)plate.w_m_rad_s,
             (unsigned)plate.pole_pairs, h);
        HOLDS(h >= 5 && h <= 10000);
        if (!(isfinite(plate.dt_s) && plate.dt_s > 0.0f)) HOLDS(h == 20);
        const dqw_scale scale = {.dt_ns = (uint32_t)random_bits(&r),
                                 .w_full_mrad_s = (uint32_t)random_bits(&r),
                                 .pole_pairs = (uint16_t)random_bits(&r)};
        const int q = dqw_nameplate_half_window_q15(&scale);
        HOLDS(q >= 5 && q <= 10000);
    }
    const dqw_scale zero = {.dt_ns = 0};
    TEST_ASSERT_EQUAL_UINT16(20, dqw_nameplate_half_window(NULL));
    TEST_ASSERT_EQUAL_UINT16(20, dqw_nameplate_half_window_q15(NULL));
    TEST_ASSERT_EQUAL_UINT16(20, dqw_nameplate_half_window_q15(&zero));
}

// What a nameplate makes of an estimator: its values, a fiftieth of the current as dead time's width, and all that a
// drive with an encoder can learn. In whole numbers full scales are half as much again.
static void test_the_default_estimator(void)
{
    const dqw_nameplate plate = {1e-4f, 24.0f, 10.0f, 300.0f, 2};
    const dqw_estimator_config c = dqw_estimator_config_default(&plate);
    HOLDS(c.dt_s == 1e-4f && c.v_base_V == 24.0f && c.i_base_A == 10.0f && c.w_base_rad_s == 300.0f);
    HOLDS(c.pole_pairs == 2 && c.half_window == 10 && c.dead_time_width_A == 0.02f * 10.0f && c.stale_limit == 10);
    HOLDS(c.angle && c.encoder_offset && c.follow && c.noise_on_inputs);
    const dqw_estimator_config none = dqw_estimator_config_default(NULL);
    HOLDS(none.dt_s == 0 && none.v_base_V == 0 && none.i_base_A == 0 && none.w_base_rad_s == 0 && !none.angle);
    HOLDS(!c.observed && !c.settled && !c.voltage_next && !c.voltage_held && !c.speed_electrical);
    HOLDS(c.R_ohm == 0 && c.Ld_H == 0 && c.Lq_H == 0 && c.psi_Wb == 0 && c.v_limit_V == 0 && c.i_limit_A == 0 &&
          c.excitation_pu == 0 && c.angle_late_s == 0 && c.voltage_error_V == 0 && c.threshold_ppm == 0);
    HOLDS(c.modulation == DQW_MODULATION_CENTRED && c.random == NULL);
    const dqw_nameplate_q15 whole = {100000, 24000, 10001, 300000, 2};
    const dqw_estimator_q15_config q = dqw_estimator_config_default_q15(&whole);
    HOLDS(q.scale.dt_ns == 100000 && q.scale.v_full_mV == 36000 && q.scale.i_full_mA == 15001 &&
          q.scale.w_full_mrad_s == 450000 && q.scale.pole_pairs == 2);
    HOLDS(q.half_window == 10 && q.dead_time_width_mA == 200 && q.stale_limit == 10);
    HOLDS(q.angle && q.encoder_offset && q.follow && q.noise_on_inputs);
    HOLDS(!q.observed && !q.settled && !q.voltage_next && !q.voltage_held && !q.speed_electrical);
    HOLDS(q.R_uohm == 0 && q.Ld_nH == 0 && q.Lq_nH == 0 && q.psi_nWb == 0 && q.excitation_q15 == 0 &&
          q.angle_late_ns == 0 && q.voltage_error_mV == 0 && q.threshold_ppm == 0 && q.solve_blocks == 0);
    HOLDS(q.modulation == DQW_MODULATION_CENTRED && q.random == NULL);
    // A window of whole numbers has no more than a hundred pairs, and a full scale its own end.
    const dqw_nameplate_q15 fast = {1000, 9000000, 9000000, 1000, 1};
    const dqw_estimator_q15_config f = dqw_estimator_config_default_q15(&fast);
    HOLDS(f.half_window == 100 && f.scale.v_full_mV == DQW_SCALE_MAX && f.scale.i_full_mA == DQW_SCALE_MAX);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_machines);
    RUN_TEST(test_no_longer_and_no_shorter_than_it_says);
    RUN_TEST(test_any_bits);
    RUN_TEST(test_the_default_estimator);
    return UNITY_END();
}
