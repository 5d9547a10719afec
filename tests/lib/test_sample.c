// What a controller hands over: the two builders, float and Q15, and what counts as a number and as an angle.
#include "dqw_number.h"
#include "dqw_sample.h"
#include "dqw_sample_q15.h"
#include "dqw_scale.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

static void test_from_dq_keeps_all_and_turns_the_angle(void)
{
    test_random r = {1};
    for (int k = 0; k < 20000; k++) {
        const double theta = random_uniform(&r, -1, 1) * (k % 3 == 0 ? 1e4 : k % 3 == 1 ? 100 : PI);
        const dqw_sample s = dqw_sample_from_dq(1, 2, 3, 4, 5, (float)theta);
        HOLDS(s.v_d_V == 1 && s.v_q_V == 2 && s.i_d_A == 3 && s.i_q_A == 4 && s.w_m_rad_s == 5 &&
              s.temp_winding_C == 0 && s.temp_magnet_C == 0);
        BETWEEN(cos((float)theta) - 2e-6, s.cosine, cos((float)theta) + 2e-6);
        BETWEEN(sin((float)theta) - 2e-6, s.sine, sin((float)theta) + 2e-6);
        HOLDS(dqw_is_direction(s.cosine, s.sine));
        const uint16_t turn = (uint16_t)(random_bits(&r) & 65535);
        const dqw_sample_q15 q = dqw_sample_from_dq_q15(1, 2, 3, 4, 5, turn);
        HOLDS(q.v_d_q15 == 1 && q.v_q_q15 == 2 && q.i_d_q15 == 3 && q.i_q_q15 == 4 && q.w_m_q15 == 5 &&
              q.temp_winding_cC == 0 && q.temp_magnet_cC == 0);
        BETWEEN(32768 * cos(turn * 2 * PI / 65536) - 1.01, q.cosine_q15, 32768 * cos(turn * 2 * PI / 65536) + 1.01);
        BETWEEN(32768 * sin(turn * 2 * PI / 65536) - 1.01, q.sine_q15, 32768 * sin(turn * 2 * PI / 65536) + 1.01);
        HOLDS(dqw_scale_is_direction(q.cosine_q15, q.sine_q15));
    }
}

// From the stationary frame: what the rotor sees there.
static void test_from_alphabeta_turns_both(void)
{
    test_random r = {2};
    for (int k = 0; k < 20000; k++) {
        const double theta = random_uniform(&r, -PI, PI);
        const double v[2] = {random_uniform(&r, -0.6, 0.6), random_uniform(&r, -0.6, 0.6)};
        const double i[2] = {random_uniform(&r, -0.6, 0.6), random_uniform(&r, -0.6, 0.6)};
        const double c = cos(theta);
        const double z = sin(theta);
        const double right[] = {c * v[0] + z * v[1], c * v[1] - z * v[0], c * i[0] + z * i[1], c * i[1] - z * i[0],
                                0.25};
        const dqw_sample s = dqw_sample_from_alphabeta((float)v[0], (float)v[1], (float)i[0], (float)i[1], 0.25f,
                                                       (float)c, (float)z);
        HOLDS(s.cosine == (float)c && s.sine == (float)z && s.temp_winding_C == 0 && s.temp_magnet_C == 0);
        const float got[] = {s.v_d_V, s.v_q_V, s.i_d_A, s.i_q_A, s.w_m_rad_s};
        int16_t x[6];
        const double in[] = {v[0], v[1], i[0], i[1], c, z};
        for (int n = 0; n < 6; n++) x[n] = (int16_t)lrint(fmin(32767, 32768 * in[n]));
        const dqw_sample_q15 q = dqw_sample_from_alphabeta_q15(x[0], x[1], x[2], x[3], 8192, x[4], x[5]);
        HOLDS(q.cosine_q15 == x[4] && q.sine_q15 == x[5]);
        const int16_t fixed[] = {q.v_d_q15, q.v_q_q15, q.i_d_q15, q.i_q_q15, q.w_m_q15};
        for (int n = 0; n < 5; n++) {
            BETWEEN(right[n] - 2e-7, got[n], right[n] + 2e-7);
            BETWEEN(32768 * right[n] - 2.5, fixed[n], 32768 * right[n] + 2.5);
        }
    }
    // What does not fit stops at the full scale, and counts as beyond it.
    HOLDS(dqw_scale_beyond(dqw_sample_from_alphabeta_q15(30000, 30000, 0, 0, 0, 23170, 23170).v_d_q15));
}

// An angle that is none has no direction, so that who needs it refuses the sample.
static void test_no_angle_no_direction(void)
{
    const float bad[] = {NAN, INFINITY, -INFINITY, 1.1e5f, 3e38f};
    for (int k = 0; k < 5; k++) {
        const dqw_sample s = dqw_sample_from_dq(1, 2, 3, 4, 5, bad[k]);
        HOLDS(!dqw_is_direction(s.cosine, s.sine) && s.cosine == 0.0f && s.sine == 0.0f);
        HOLDS(!dqw_is_direction(bad[k], 0.0f) && !dqw_is_direction(0.0f, bad[k]) && !dqw_is_direction(1.0f, bad[k]));
    }
    HOLDS(dqw_is_direction(1, 0) && dqw_is_direction(-0.96f, 0) && dqw_is_direction(0.6f, -0.8f) &&
          dqw_is_direction(0.3f, 1.0f));
    HOLDS(!dqw_is_direction(0.94f, 0) && !dqw_is_direction(1.06f, 0) && !dqw_is_direction(0.8f, 0.8f) &&
          !dqw_is_direction(0, 0));
}

// Numbers by their bits, against the library's words, over every exponent.
static void test_numbers(void)
{
    test_random r = {3};
    const float ends[] = {0.0f,          -0.0f,          NAN,    -NAN,    INFINITY,       -INFINITY,
                          3.4028235e38f, -3.4028235e38f, 1e-45f, -1e-45f, 1.1754944e-38f, DQW_UNKNOWN};
    for (int k = 0; k < 200000; k++) {
        const float x = k < 12 ? ends[k] : random_float_bits(&r);
        const float limit = fabsf(k % 2 ? random_float_bits(&r) : x);
        CASE("%a", (double)x);
        HOLDS(dqw_is_finite(x) == (isfinite(x) != 0));
        HOLDS(dqw_is_positive(x) == (isfinite(x) && x > 0.0f));
        HOLDS(dqw_is_zero_or_positive(x) == (isfinite(x) && x >= 0.0f));
        if (isfinite(limit)) HOLDS(dqw_within(x, limit) == (fabsf(x) <= limit));
    }
    HOLDS(dqw_is_finite(DQW_UNKNOWN));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_from_dq_keeps_all_and_turns_the_angle);
    RUN_TEST(test_from_alphabeta_turns_both);
    RUN_TEST(test_no_angle_no_direction);
    RUN_TEST(test_numbers);
    return UNITY_END();
}
