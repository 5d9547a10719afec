// The fixed-point transforms beside the float ones: every angle, balanced phases, random phases, the extremes.
#include "dqw_q15.h"
#include "dqw_test.h"
#include "dqw_transform.h"
#include "dqw_transform_q15.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

static double full(double x) { return fmax(-32768.0, fmin(32767.0, x)); }
static int16_t any(test_random *r) { return (int16_t)((int)(random_bits(r) % 65536) - 32768); }

static void test_every_angle_against_libm(void)
{
    double worst = 0.0;
    double length = 0.0;
    for (int k = 0; k < 65536; k++) {
        int16_t c;
        int16_t s;
        dqw_cosine_sine_q15((uint16_t)k, &c, &s);
        const double t = 2 * PI * k / 65536;
        const double off = fmax(fabs(c - full(32768 * cos(t))), fabs(s - full(32768 * sin(t))));
        CASE("angle %d", k);
        HOLDS(off < 1.0);
        worst = fmax(worst, off);
        length = fmax(length, fabs(hypot(c, s) / 32768 - 1));
    }
    test_case[0] = 0;
    BETWEEN(0.6, worst, 0.75);  // 0.737
    BETWEEN(1e-5, length, 4e-5);
    // Quarter turns are exact but for the 1 that does not fit; half a turn on is the other sign.
    static const int16_t quarter[4][2] = {{32767, 0}, {0, 32767}, {-32768, 0}, {0, -32768}};
    for (int k = 0; k < 4; k++) {
        int16_t c;
        int16_t s;
        dqw_cosine_sine_q15((uint16_t)(k * 16384), &c, &s);
        TEST_ASSERT_EQUAL_INT16(quarter[k][0], c);
        TEST_ASSERT_EQUAL_INT16(quarter[k][1], s);
    }
    for (int k = 0; k < 32768; k++) {
        int16_t c[2];
        int16_t s[2];
        dqw_cosine_sine_q15((uint16_t)k, &c[0], &s[0]);
        dqw_cosine_sine_q15((uint16_t)(k + 32768), &c[1], &s[1]);
        CASE("angle %d", k);
        HOLDS(abs(c[0] + c[1]) <= (abs(c[0]) >= 32767) && abs(s[0] + s[1]) <= (abs(s[0]) >= 32767));
    }
}

// The float twin of the same numbers; float rounds a number of 32768 by 0.002.
static void test_phases(void)
{
    test_random r = {1};
    double balanced = 0.0;
    double worst = 0.0;
    double back = 0.0;
    for (int k = 0; k < scaled(300000); k++) {
        dqw_abc_q15 x = {any(&r), any(&r), any(&r)};
        const bool whole = k % 2 == 0;
        if (whole) {
            const double size = random_uniform(&r, 0, 32767);
            const double t = random_uniform(&r, 0, 2 * PI);
            x.a = (int16_t)lrint(size * cos(t));
            x.b = (int16_t)lrint(size * cos(t - 2 * PI / 3));
            x.c = (int16_t)lrint(size * cos(t + 2 * PI / 3));
        }
        const dqw_alphabeta y = dqw_clarke((dqw_abc){x.a, x.b, x.c});
        const dqw_alphabeta_q15 z = dqw_clarke_q15(x);
        const double off = fmax(fabs(z.alpha - full(y.alpha)), fabs(z.beta - full(y.beta)));
        if (whole)
            balanced = fmax(balanced, off);
        else
            worst = fmax(worst, off);
        const dqw_abc u = dqw_clarke_inverse((dqw_alphabeta){z.alpha, z.beta});
        const dqw_abc_q15 v = dqw_clarke_inverse_q15(z);
        back = fmax(back, fmax(fabs(v.a - full(u.a)), fmax(fabs(v.b - full(u.b)), fabs(v.c - full(u.c)))));
    }
    BETWEEN(0.45, balanced, 0.6);
    BETWEEN(0.6, worst, 1.1);
    BETWEEN(0.45, back, 0.6);
}

static void test_turns(void)
{
    test_random r = {2};
    double worst[3] = {0};
    double home = 0.0;
    for (int k = 0; k < scaled(300000); k++) {
        int16_t c = any(&r);
        int16_t s = any(&r);
        if (k % 2 == 0) dqw_cosine_sine_q15((uint16_t)random_bits(&r), &c, &s);
        const dqw_alphabeta_q15 x = {any(&r), any(&r)};
        const float cf = (float)c / 32768;
        const float sf = (float)s / 32768;
        const dqw_dq_q15 y = dqw_park_q15(x, c, s);
        const dqw_dq yf = dqw_park((dqw_alphabeta){x.alpha, x.beta}, cf, sf);
        worst[0] = fmax(worst[0], fmax(fabs(y.d - full(yf.d)), fabs(y.q - full(yf.q))));
        const dqw_alphabeta_q15 z = dqw_park_inverse_q15(y, c, s);
        const dqw_alphabeta zf = dqw_park_inverse((dqw_dq){y.d, y.q}, cf, sf);
        worst[1] = fmax(worst[1], fmax(fabs(z.alpha - full(zf.alpha)), fabs(z.beta - full(zf.beta))));
        const dqw_dq_q15 p = dqw_park_paper_q15(x, c, s);
        const dqw_dq pf = dqw_park_paper((dqw_alphabeta){x.alpha, x.beta}, cf, sf);
        worst[2] = fmax(worst[2], fmax(fabs(p.d - full(pf.d)), fabs(p.q - full(pf.q))));
        // There and back: two roundings, and a length that is wrong by less than 4e-5.
        if (k % 2 == 0 && abs(x.alpha) < 22000 && abs(x.beta) < 22000)
            home = fmax(home, fmax(abs(z.alpha - x.alpha), abs(z.beta - x.beta)));
    }
    for (int k = 0; k < 3; k++) BETWEEN(0.5, worst[k], 0.51);
    BETWEEN(1.0, home, 3.0);
}

static void test_extremes(void)
{
    static const int16_t ends[] = {-32768, -32767, -1, 0, 1, 32767};
    for (int k = 0; k < 6 * 6 * 6 * 6; k++) {
        CASE("case %d", k);
        const int16_t a = ends[k % 6];
        const int16_t b = ends[k / 6 % 6];
        const int16_t c = ends[k / 36 % 6];
        const int16_t s = ends[k / 216];
        const dqw_alphabeta_q15 y = dqw_clarke_q15((dqw_abc_q15){a, b, c});
        const dqw_alphabeta yf = dqw_clarke((dqw_abc){a, b, c});
        BETWEEN(-1.1, y.alpha - full(yf.alpha), 1.1);
        BETWEEN(-1.1, y.beta - full(yf.beta), 1.1);
        const dqw_dq_q15 z = dqw_park_q15((dqw_alphabeta_q15){a, b}, c, s);
        const dqw_dq zf = dqw_park((dqw_alphabeta){a, b}, (float)c / 32768, (float)s / 32768);
        BETWEEN(-0.51, z.d - full(zf.d), 0.51);
        BETWEEN(-0.51, z.q - full(zf.q), 0.51);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_angle_against_libm);
    RUN_TEST(test_phases);
    RUN_TEST(test_turns);
    RUN_TEST(test_extremes);
    return UNITY_END();
}
