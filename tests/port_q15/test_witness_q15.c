// The witness in whole numbers, block by block, against (E62) in complex doubles: its inputs, the error that they
// share, the steps, and where it does not learn.
#include <complex.h>

#include "dqw_estimator_block_q15.h"
#include "dqw_test.h"
#include "dqw_witness_q15.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

enum { POLES = 5, HALF = 20, K = DQW_WITNESS_INPUTS };
#define V_FULL 40.0
#define I_FULL 12.0
#define W_FULL 400.0
#define DT_S 1e-4
#define Q24 16777216.0
#define Q28 268435456.0
#define Q40 1099511627776.0
#define Q52 4503599627370496.0
#define Q56 72057594037927936.0

static const double UNIT[4] = {0.4, 1.1e-3, 1.7e-3, 0.015};
static dqw_estimator_q15_config config;
static dqw_estimator_q15 e;
static double machine[4];

static void start(test_random *r)
{
    static const dqw_estimator_q15_config given = {
        .scale = {(uint32_t)(1000 * V_FULL), (uint32_t)(1000 * I_FULL), (uint32_t)(1000 * W_FULL), 100000, POLES},
        .R_uohm = 400000,
        .Ld_nH = 1100000,
        .Lq_nH = 1700000,
        .psi_nWb = 15000000,
        .half_window = HALF,
        .angle = true};
    config = given;
    memset(&e, 0, sizeof e);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(&e, &config));
    for (int i = 0; i < 4; i++) {
        e.w_q24[i] = (int32_t)lrint(random_uniform(r, 0.6, 1.5) * Q24);
        machine[i] = UNIT[i] * e.w_q24[i] / Q24;
    }
}

static int32_t rounded(double x) { return (int32_t)lrint(x); }

static dqw_estimator_q15_block block_of(double theta, double w_rad_s, double complex i_A)
{
    dqw_estimator_q15_block b;
    memset(&b, 0, sizeof b);
    b.weight = HALF * (HALF + 1);
    b.whole = true;
    const double one = 32768.0 * b.weight;
    b.sums[2] = rounded(2 * creal(i_A) / I_FULL * one), b.sums[3] = rounded(2 * cimag(i_A) / I_FULL * one);
    b.sums[8] = rounded(2 * w_rad_s / W_FULL * one);
    b.with.cosine_q15 = (int16_t)lrint(32767 * cos(theta)), b.with.sine_q15 = (int16_t)lrint(32767 * sin(theta));
    return b;
}

// What a triangle over two halves leaves of a ripple that turns by so much in a half.
static double left_of(double turn) { return pow(sin(turn / 2) / (turn / 2), 2); }

// What a unit of each weight adds to the voltage, of the full one.
static void inputs(double theta, double w_rad_s, double complex i_A, double complex x[K])
{
    const double w_e = POLES * w_rad_s;
    const double turn = fabs(w_e) * HALF * DT_S;
    const double complex once = cexp(-I * theta) * left_of(turn);
    const double complex twice = cexp(-2 * I * theta) * left_of(2 * turn);
    const double L_unit = (UNIT[1] + UNIT[2]) / 2;
    const double L_H = (machine[1] + machine[2]) / 2;
    const double siemens = 1 / (UNIT[0] + L_unit * POLES * W_FULL);
    x[DQW_WITNESS_OFFSET] = -machine[0] * once * I_FULL / V_FULL;
    x[DQW_WITNESS_RESISTANCE] = UNIT[0] * conj(i_A) * twice / V_FULL;
    x[DQW_WITNESS_REACTANCE] = L_unit * I * w_e * conj(i_A) * twice / V_FULL;
    x[DQW_WITNESS_SHORT] = siemens * (machine[0] - I * w_e * L_H) * I * w_e * machine[3] * twice / V_FULL;
}

static void alike(double expected, double value, double room, const char *what)
{
    test_between(expected - room, value, expected + room, what, __LINE__);
}

static void test_a_block_is_the_equations(void)
{
    test_random r = {770};
    for (int way = 0; way < 3; way++) {
        start(&r);
        dqw_witness_q15 w;
        dqw_witness_init_q15(&w);
        double theta = 0;
        for (int k = 0; k < 800; k++) {
            CASE("way %d, block %d", way, k);
            // A drive that hardly moves, and then does: a block of many times the mean power.
            const double size = way == 1 && k % 100 < 95 ? 0.02 : 1;
            const double w_rad_s = (random_bits(&r) % 2 ? 1 : -1) * random_uniform(&r, 9.5, 110);
            const double complex i_A = size * (random_uniform(&r, -8, 8) + I * random_uniform(&r, -8, 8));
            theta += 2.4;
            const dqw_estimator_q15_block b = block_of(theta, w_rad_s, i_A);
            for (int a = 0; a < 2; a++) e.e_q28[a] = rounded(random_uniform(&r, -0.1, 0.1) * Q28);
            const dqw_witness_q15 before = w;
            double complex x[K];
            inputs(theta, w_rad_s, i_A, x);
            HOLDS(dqw_witness_learn_q15(&w, &e, &b));
            HOLDS(w.blocks == (k < 300 ? k + 1 : 300));
            double complex error = (e.e_q28[0] + I * e.e_q28[1]) / Q28;
            for (int n = 0; n < K; n++) error -= (before.re_q28[n] + I * before.im_q28[n]) / Q28 * x[n];
            const double across = creal(x[DQW_WITNESS_REACTANCE] * conj(I * x[DQW_WITNESS_RESISTANCE]));
            const double across_was = (double)before.across_q52 / Q52;
            const double across_mean = across_was + (across - across_was) / w.blocks;
            alike(across_mean, (double)w.across_q52 / Q52, 3e-4 * (fabs(across_mean) + fabs(across)) + 1e-13, "across");
            alike((double)w.across_q52 / (double)w.power_q52[1] * 16777216, dqw_witness_speed_q24(&w), 2, "speed");
            for (int n = 0; n < K; n++) {
                CASE("way %d, block %d, weight %d", way, k, n);
                const double power = pow(cabs(x[n]), 2);
                const double was = (double)before.power_q52[n] / Q52;
                const double mean = was + (power - was) / w.blocks;
                alike(mean, (double)w.power_q52[n] / Q52, 3e-4 * (mean + power) + 1e-13, "power");
                // A step is 1/300 of the way, a strong block's no longer than by half of its own power; the first
                // blocks measure their power alone.
                const double complex step = w.blocks < 32 ? 0 : conj(x[n]) * error / (300 * fmax(mean, power / 2));
                const double room = 2e-3 * cabs(step) + 1e-8;
                alike(creal(step), (w.re_q28[n] - before.re_q28[n]) / Q28, room, "real step");
                alike(cimag(step), (w.im_q28[n] - before.im_q28[n]) / Q28, room, "imaginary step");
                const double length = hypot(w.re_q28[n], w.im_q28[n]);
                alike(length, dqw_witness_size_q28(&w, (enum dqw_witness_input)n), 1e-6 * length + 2, "size");
            }
        }
    }
}

// sd^2 = s^2/(2 M p) of each part, and what of the residual lasts; not before the memory is full.
static void test_deviations(void)
{
    test_random r = {771};
    start(&r);
    dqw_witness_q15 w;
    dqw_witness_init_q15(&w);
    for (int blocks = 299; blocks <= 300; blocks++)
        for (int n = 0; n < K; n++) {
            CASE("%d blocks, weight %d", blocks, n);
            w.blocks = (uint16_t)blocks;
            const double power = random_uniform(&r, 0.001, 0.2);
            w.power_q52[n] = llrint(power * Q52);
            e.error_q56[0] = llrint(3e-5 * Q56), e.error_q56[1] = llrint(7e-5 * Q56);
            e.residual.calm_q28[0] = (uint32_t)lrint(sqrt(2e-6) * Q28);
            e.segment.since = 3;
            // Of each axis half of both.
            const double noise2 = (3e-5 + 7e-5) / 2 / (2 * 300);
            // Of reactance what is not in line with resistance: 1 - 0.6^2. (E177)
            const double own = n == DQW_WITNESS_REACTANCE ? 0.64 : 1;
            if (n == DQW_WITNESS_REACTANCE) w.power_q52[1] = llrint(0.03 * Q52);
            w.across_q52 = llrint(-0.6 * sqrt((double)w.power_q52[1]) * sqrt((double)w.power_q52[2]));
            const double sd = sqrt((noise2 + 0.16 * 2e-6 / 4) / (own * power));
            const int32_t got = dqw_witness_sd_q28(&w, &e, (enum dqw_witness_input)n);
            if (blocks < 300)
                HOLDS(got == INT32_MAX);
            else
                alike(sd, got / Q28, 1e-4 * sd, "deviation");
            w.power_q52[n] = 0;
            HOLDS(dqw_witness_sd_q28(&w, &e, (enum dqw_witness_input)n) == INT32_MAX);
        }
}

// Where strong currents turn the shaft round, within a turn of a ripple, a voltage that stands still in the magnet's
// frame is none: what it makes of one stays below the five deviations of a band.
static void test_turning_round_makes_no_ripple(void)
{
    enum { ROUND = 30, APART = 400, ROUNDS = 60 };
    test_random r = {774};
    start(&r);
    dqw_witness_q15 w;
    dqw_witness_init_q15(&w);
    double theta = 0;
    double error2 = 0;
    double z2[K] = {0};
    for (int k = 0; k < ROUNDS * APART; k++) {
        const int at = k % APART;
        const double way = k / APART % 2 == 0 ? 1 : -1;
        const bool strong = at < ROUND;
        // From one direction to the other, 20 rad/s: what is too slow is not learned.
        const double w_rad_s = way * (strong ? -20 + 40.0 * at / ROUND : 20);
        const double complex i_A = strong ? 6 * I * way : 0.4 * (random_normal(&r) + I * random_normal(&r));
        theta += POLES * w_rad_s * HALF * DT_S;
        const dqw_estimator_q15_block b = block_of(theta, w_rad_s, i_A);
        const double still_V = at < 8 ? 0.1 * way : 0;
        for (int a = 0; a < 2; a++) {
            e.e_q28[a] = rounded((0.03 * random_normal(&r) + a * still_V) / V_FULL * Q28);
            error2 += pow(e.e_q28[a] / Q28, 2);
        }
        e.error_q56[0] = e.error_q56[1] = llrint(error2 / (k + 1) / 2 * Q56);
        (void)dqw_witness_learn_q15(&w, &e, &b);
        for (int n = 0; n < K && at == ROUND && k > 2 * APART; n++) {
            const enum dqw_witness_input input = (enum dqw_witness_input)n;
            const double z = (double)dqw_witness_size_q28(&w, input) / dqw_witness_sd_q28(&w, &e, input);
            z2[n] += z * z / 2 / (ROUNDS - 3);
        }
    }
    // Where a strong block taught eight times what one of mean power does: 5.0 and 1.6.
    BETWEEN(1.5, sqrt(z2[DQW_WITNESS_RESISTANCE]), 3.5);  // 2.99
    BETWEEN(0.7, sqrt(z2[DQW_WITNESS_REACTANCE]), 1.35);  // 1.12
}

// Between 0.08 and 1.2 rad a half, with an angle and pole pairs.
static void test_where_it_does_not_learn(void)
{
    test_random r = {772};
    start(&r);
    dqw_witness_q15 w;
    dqw_witness_init_q15(&w);
    static const double turns[] = {0.079, 0.081, 1.199, 1.201};
    for (int k = 0; k < 8; k++) {
        const double turn = turns[k % 4] * (k < 4 ? 1 : -1);
        const dqw_estimator_q15_block b = block_of(1, turn / (POLES * HALF * DT_S), 3 + I);
        CASE("%g rad", turn);
        HOLDS(dqw_witness_learn_q15(&w, &e, &b) == (k % 4 == 1 || k % 4 == 2));
    }
    dqw_estimator_q15_block b = block_of(1, 50, 3 + I);
    const dqw_witness_q15 before = w;
    e.pole_pairs = 0;
    HOLDS(!dqw_witness_learn_q15(&w, &e, &b));
    e.pole_pairs = POLES;
    b.with.cosine_q15 = b.with.sine_q15 = 0;
    HOLDS(!dqw_witness_learn_q15(&w, &e, &b));
    TEST_ASSERT_EQUAL_MEMORY(&before, &w, sizeof w);
}

static void test_units(void)
{
    test_random r = {773};
    start(&r);
    const double X = (UNIT[1] + UNIT[2]) / 2 * POLES * W_FULL;
    alike(UNIT[0] / (UNIT[0] + X), (double)dqw_witness_short_q40(&config) / Q40, 1e-6, "short");
    const double L = (0.8 * UNIT[1] + 1.3 * UNIT[2]) / (UNIT[1] + UNIT[2]);
    alike(L, dqw_witness_mean_L_q24(&config, rounded(0.8 * Q24), rounded(1.3 * Q24)) / Q24, 1e-6, "mean inductance");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_block_is_the_equations);
    RUN_TEST(test_deviations);
    RUN_TEST(test_turning_round_makes_no_ripple);
    RUN_TEST(test_where_it_does_not_learn);
    RUN_TEST(test_units);
    return UNITY_END();
}
