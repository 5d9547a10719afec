// How late the speed is against the angle, half by half, in whole numbers against (E107) in double: the means, when
// they are believed, and the block's speeds.
#include "dqw_estimator_block_q15.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

enum { POLES = 5, HALF = 20 };
#define DT_S 1e-4
#define HALF_S (HALF * DT_S)
#define I_FULL 12.0
#define W_FULL 400.0
#define TURN (POLES * HALF_S)  // electrical, in a half

static dqw_estimator_q15_config config;
static dqw_estimator_q15 e;

static void start(bool settled, uint16_t pole_pairs)
{
    static const dqw_estimator_q15_config given = {
        .scale = {40000, (uint32_t)(1000 * I_FULL), (uint32_t)(1000 * W_FULL), 100000, 0},
        .half_window = HALF,
        .angle = true};
    config = given;
    config.settled = settled, config.scale.pole_pairs = pole_pairs;
    memset(&e, 0, sizeof e);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(&e, &config));
}

static int32_t rounded(double x) { return (int32_t)lrint(x); }

// In radians of a half.
static double mean_of(int32_t x) { return ldexp(x, e.lag_halvings - 56); }

typedef struct lag {
    double num, den, rest, by;
} lag;

static double lag_s(const lag *l)
{
    const double blocks = fmin(e.blocks, 4096);
    const bool sure = e.blocks >= 100 && l->num * l->num > 25 * l->rest * l->by / blocks;
    const double s = sure && l->den > 0.5 * l->by ? l->num / l->den : 0;
    return s > 0.1 * HALF_S ? s : 0;
}

static void alike(double expected, double value, double room, const char *what)
{
    test_between(expected - room, value, expected + room, what, __LINE__);
}

// A speed that is late by `late_s`, both with this noise; now and then there is no angle, a half is missing, or another
// sensor's angle is off.
static int paced(double late_s, double noise_rad, double noise_rad_s, int halves, uint64_t seed, bool learns)
{
    test_random r = {seed};
    lag l = {0, 0, 0, 0};
    double w[4] = {0};
    int run = 0;
    int corrected = 0;
    double size = 0;
    double shaft = 0;
    double change = 0;
    for (int k = 0; k < halves; k++) {
        CASE("late by %g s, half %d", late_s, k);
        for (int n = 3; n > 0; n--) w[n] = w[n - 1];
        // A shaft on a spring, which is pushed about.
        change = 0.93 * change - 0.005 * shaft + 2 * random_normal(&r);
        shaft += change;
        w[0] = shaft + (noise_rad_s > 0 ? noise_rad_s * random_normal(&r) : 0);
        const double faster = w[0] - w[1];
        const double earlier = w[2] - w[3];
        dqw_estimator_q15_block b;
        memset(&b, 0, sizeof b);
        b.whole = random_bits(&r) % 50 != 0;
        e.elapsed = random_bits(&r) % 50 == 0 ? 2 : 1;
        e.blocks = (uint16_t)(k + 1);
        e.number = (uint32_t)k;
        const bool blind = random_bits(&r) % 40 == 0;
        const bool wild = random_bits(&r) % 40 == 0;
        double ahead = POLES * (late_s * change + (shaft - w[0]) * HALF_S);
        ahead += noise_rad * random_normal(&r) + (wild ? 0.6 : 0);
        const double angle = POLES * w[0] * HALF_S + ahead;
        const int64_t advance_q30[2] = {blind ? 0 : llrint(cos(angle) * 1073741824),
                                        blind ? 0 : llrint(sin(angle) * 1073741824)};
        const double one = 32768.0 * HALF * (HALF + 1);
        b.weight = HALF * (HALF + 1);
        const double i_A[2] = {random_uniform(&r, -5, 5), random_uniform(&r, -5, 5)};
        b.sums[2] = rounded(2 * i_A[0] / I_FULL * one), b.sums[3] = rounded(2 * i_A[1] / I_FULL * one);
        b.sums[6] = 1000, b.sums[7] = -2000, b.sums[8] = rounded((w[0] + w[1]) / W_FULL * one);
        const dqw_estimator_q15_block before = b;
        run = e.elapsed == 1 && b.whole ? (run < 3 ? run + 1 : 3) : 0;
        // Sums of two samples over the half.
        const bool teaches = dqw_estimator_keep_pace_q15(&e, &b, advance_q30,
                                                         rounded(2 * HALF * 32768 * w[0] / W_FULL));
        if (run == 3 && !blind && learns) {
            ahead = remainder(ahead, 2 * PI);
            if (cos(ahead) > 0.9) {
                // The angle itself, of what is ahead its sine.
                const double a = sin(ahead) / POLES;
                const double rest = a - lag_s(&l) * faster;
                l.num += (a * earlier - l.num) / 4096;
                l.den += (faster * earlier - l.den) / 4096;
                l.rest += (rest * rest - l.rest) / 4096;
                l.by += (earlier * earlier - l.by) / 4096;
            }
        }
        const double more = lag_s(&l) * faster / HALF_S;
        // Near the edge of belief rounding decides.
        const double edge = l.num * l.num * fmin(e.blocks, 4096) / (25 * l.rest * l.by + 1e-300);
        size = fmax(size, l.by);
        alike(l.num, mean_of(e.lag_num) / (POLES * TURN), 3e-3 * fabs(l.num) + 1e-6 * size,
              "ahead by the change before");
        alike(l.den, mean_of(e.lag_den) / (TURN * TURN), 3e-3 * fabs(l.den) + 1e-4 * size,
              "change by the change before");
        alike(l.by, mean_of(e.lag_by) / (TURN * TURN), 3e-3 * l.by, "change before");
        const double motion = l.den / (0.5 * l.by + 1e-300);
        if ((edge > 0.99 && edge < 1.01) || (motion > 0.99 && motion < 1.01)) continue;
        alike(l.rest, mean_of(e.lag_rest) / (POLES * POLES), 2e-2 * l.rest + 1e-9, "rest");
        HOLDS(e.paced == run);
        // Where pairs are missing nobody knows how a speed that is late has changed.
        HOLDS(teaches == (more == 0 || run > 0));
        corrected += more != 0 && teaches;
        if (!teaches) continue;
        alike(before.sums[8] + 2 * more / W_FULL * one, b.sums[8], (3e-3 * fabs(more) + 0.02) / W_FULL * one, "speed");
        alike(1000 + 2 * more / W_FULL * b.sums[2], b.sums[6], (1e-2 * fabs(more) + 0.02) / W_FULL * one,
              "speed by current on d");
        alike(-2000 + 2 * more / W_FULL * b.sums[3], b.sums[7], (1e-2 * fabs(more) + 0.02) / W_FULL * one,
              "speed by current on q");
    }
    return corrected;
}

// One jolt after a long rest, the change before it next to nothing: the largest of the four means is the product of
// both, and it fits.
static void test_a_jolt(void)
{
    start(false, POLES);
    static const double w[] = {0, 0, 0, 0, 0, 0.01, 0.01, 190, 190};
    for (int k = 1; k < 9; k++) {
        dqw_estimator_q15_block b;
        memset(&b, 0, sizeof b);
        b.whole = true, b.weight = HALF * (HALF + 1);
        e.elapsed = 1, e.blocks = (uint16_t)k, e.number = (uint32_t)k;
        const int32_t sum = rounded(2 * HALF * 32768 * w[k] / W_FULL);
        const double angle = POLES * (sum * W_FULL / 32768 / (2 * HALF)) * HALF_S;
        const int64_t advance_q30[2] = {llrint(cos(angle) * 1073741824), llrint(sin(angle) * 1073741824)};
        dqw_estimator_keep_pace_q15(&e, &b, advance_q30, sum);
    }
    const double step = rounded(2 * HALF * 32768 * 0.01 / W_FULL) * W_FULL / 32768 / (2 * HALF);
    const double jolt = 190 - step;
    const double den = jolt * step / 4096;
    alike(den, mean_of(e.lag_den) / (TURN * TURN), 1e-3 * den, "change by the change before");
    alike(0, mean_of(e.lag_num) / (POLES * TURN), 1e-3 * den, "ahead by the change before");
}

static void test_a_speed_that_is_late(void)
{
    start(false, POLES);
    const int late = paced(1e-3, 0.01, 0, 6000, 761, true);
    CASE("%d corrected", late);
    HOLDS(late > 4000);
    // Not late, or by less than the angle may be; or nobody can tell it for noise.
    start(false, POLES);
    HOLDS(paced(0, 0.01, 0, 2000, 762, true) == 0);
    start(false, POLES);
    HOLDS(paced(0.09 * HALF_S, 1e-4, 0, 2000, 763, true) == 0);
    start(false, POLES);
    HOLDS(paced(0.12 * HALF_S, 1e-4, 0, 2000, 764, true) > 1000);
}

// A speed whose changes are more noise than motion, as some observers' are: what the angle says of it goes with them
// beyond doubt, and the quotient of two small means would throw the speed about.
static void test_a_speed_that_is_mostly_noise(void)
{
    start(false, POLES);
    const int quiet = paced(1e-3, 0.01, 2, 6000, 767, true);
    CASE("%d corrected", quiet);
    HOLDS(quiet > 3000);
    for (int n = 0; n < 4; n++) {
        start(false, POLES);
        HOLDS(paced(1e-3, 0.01, 10 + 10 * n, 6000, 768 + (uint64_t)n, true) == 0);
    }
}

// Settled rows have no course, and without pole pairs nobody knows the angle's speed.
static void test_what_has_no_pace(void)
{
    start(true, POLES);
    HOLDS(paced(1e-3, 0.01, 0, 300, 765, false) == 0);
    start(false, 0);
    HOLDS(paced(1e-3, 0.01, 0, 300, 766, false) == 0);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_jolt);
    RUN_TEST(test_a_speed_that_is_late);
    RUN_TEST(test_a_speed_that_is_mostly_noise);
    RUN_TEST(test_what_has_no_pace);
    return UNITY_END();
}
