// Half a block's pairs from the nameplate: machines by hand, the three bounds everywhere, float and fixed point against
// exact integers.
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

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_machines);
    RUN_TEST(test_no_longer_and_no_shorter_than_it_says);
    RUN_TEST(test_any_bits);
    return UNITY_END();
}
