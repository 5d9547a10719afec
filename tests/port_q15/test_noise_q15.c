// Sensor noise from single rows in whole numbers: the float sums of the same rows, to the last place of what forgets;
// and what a gap, or a beginning, leaves out.
#include "dqw_noise.h"
#include "dqw_noise_q15.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

#define ONE 32768.0

static int32_t normal(test_random *r, double size_q15) { return (int32_t)lrint(size_q15 * random_normal(r)); }

static void step_both(dqw_noise_q15 *n, dqw_noise *f, int32_t d, int32_t q, int32_t w, int32_t made, uint32_t at)
{
    dqw_noise_step_q15(n, d, q, w, made, at);
    dqw_noise_step(f, (float)(d / ONE), (float)(q / ONE), (float)(w / ONE), (float)(made / ONE));
}

// The variances of both: a mean that forgets as the sum over a full memory does.
static void test_variances_are_those_of_the_float_twin(void)
{
    for (int rows = 100; rows <= 40000; rows *= 20) {
        dqw_noise_q15 n;
        dqw_noise f;
        memset(&n, 0x5a, sizeof n);
        dqw_noise_init_q15(&n);
        dqw_noise_init(&f);
        test_random r = {(uint64_t)rows};
        int32_t i[2] = {0};
        int32_t w = 0;
        for (int k = 0; k < rows; k++) {
            const int32_t made = normal(&r, 50) - i[0] / 4;
            const int32_t next[2] = {normal(&r, 80), normal(&r, 300)};
            const int32_t faster = normal(&r, 40);
            step_both(&n, &f, next[0] - i[0], next[1] - i[1], faster - w, made, (uint32_t)k);
            i[0] = next[0], i[1] = next[1], w = faster;
        }
        const double of_float[] = {(double)f.of.i_d_A2, (double)f.of.i_q_A2, (double)f.of.w_rad2_s2};
        const double truth[] = {80 * 80, 300 * 300, 40 * 40};
        for (int c = 0; c < 3; c++) {
            const int64_t v = dqw_noise_variance_q36(n.sum_q30[c], n.rows, c == DQW_NOISE_W_Q15 ? 6 : -2);
            CASE("channel %d after %d rows", c, rows);
            BETWEEN(0.999 * of_float[c] - 1e-9, ldexp((double)v, -36), 1.001 * of_float[c] + 1e-9);
            if (rows > 10000) BETWEEN(0.85, ldexp((double)v, -36) * ONE * ONE / truth[c], 1.15);
        }
        TEST_ASSERT_EQUAL_UINT16(f.of.rows, n.rows);
        // The voltage of a row takes a quarter off the current before it: -3/4 of its noise. One row in four is looked
        // at here, each in float.
        if (rows < 10000) continue;
        const double answer = (double)n.sum_q30[DQW_NOISE_ANSWER_Q15] / 1073741824.0 / (0.25 * n.rows);
        CASE("answers after %d rows: %g and %g", rows, answer * ONE * ONE / truth[0],
             (double)f.of.answer_A2 * ONE * ONE / truth[0]);
        BETWEEN(-0.9, answer * ONE * ONE / truth[0], -0.6);
        BETWEEN(-0.85, (double)f.of.answer_A2 * ONE * ONE / truth[0], -0.65);
    }
}

// Halves of any length: each sum forgets as often as the others, and as many rows look for an answer as is said.
static void test_every_half_forgets_alike(void)
{
    for (uint32_t half = 3; half <= 23; half += 2) {
        dqw_noise_q15 n;
        dqw_noise_init_q15(&n);
        test_random r = {half};
        int32_t i = 0;
        for (uint32_t k = 0; k < 60000; k++) {
            const int32_t made = -i / 4;
            const int32_t next = normal(&r, 200);
            dqw_noise_step_q15(&n, next - i, next - i, next - i, made, k % half);
            i = next;
        }
        for (int c = 0; c < 3; c++) {
            const int64_t v_q36 = dqw_noise_variance_q36(n.sum_q30[c], n.rows, c == DQW_NOISE_W_Q15 ? 6 : -2);
            CASE("halves of %u, channel %d", half, c);
            BETWEEN(0.85, ldexp((double)v_q36, -36) * ONE * ONE / (200 * 200), 1.15);
        }
        const double looks = n.rows * (double)dqw_noise_looks_q15(half) / half;
        CASE("halves of %u, answer", half);
        // The voltage answers a quarter of the noise a period later.
        BETWEEN(-0.9, (double)n.sum_q30[DQW_NOISE_ANSWER_Q15] / looks / (200 * 200), -0.6);
    }
}

// Between gaps all is level; across them it jumps by far more than the noise, and so it does at the beginning.
static void test_a_gap_is_not_spanned(void)
{
    for (int length = 1; length <= 12; length++) {
        CASE("a gap every %d rows", length);
        dqw_noise_q15 n;
        memset(&n, 0x5a, sizeof n);
        dqw_noise_init_q15(&n);
        test_random r = {(uint64_t)length};
        uint32_t expected = 0;
        int32_t level = 0;
        for (int k = 0; k < 3000; k++) {
            if (k % length == 0) {
                if (k > 0) dqw_noise_gap_q15(&n);
                level = random_bits(&r) % 2 == 0 ? -20000 : 9000 * (k / length % 3);
            }
            dqw_noise_step_q15(&n, level + normal(&r, 3), level, level / 2, level, (uint32_t)k);
            expected += k % length >= 3;
        }
        HOLDS(n.rows == expected);
        // White steps show nothing; a jump within one would show millions.
        for (int c = 0; c < 3; c++) {
            const int64_t v_q36 = dqw_noise_variance_q36(n.sum_q30[c], n.rows, c == DQW_NOISE_W_Q15 ? 6 : -2);
            BETWEEN(0.0, ldexp((double)v_q36, -36) * ONE * ONE, 3.0);
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_variances_are_those_of_the_float_twin);
    RUN_TEST(test_every_half_forgets_alike);
    RUN_TEST(test_a_gap_is_not_spanned);
    return UNITY_END();
}
