// How late the speed is against the angle, half by half, against (E107) in double: the means, when they are believed,
// and the block's speeds.
#include "dqw_estimator_block.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

enum { POLES = 5, HALF = 20 };
#define DT_S 1e-4
#define HALF_S (HALF * DT_S)

static dqw_estimator_config config;
static dqw_estimator e;

static void start(bool settled, uint16_t pole_pairs)
{
    static const dqw_estimator_config given = {.dt_s = (float)DT_S,
                                               .v_base_V = 24.0f,
                                               .i_base_A = 7.0f,
                                               .w_base_rad_s = 300.0f,
                                               .half_window = HALF,
                                               .angle = true};
    config = given;
    config.settled = settled, config.pole_pairs = pole_pairs;
    memset(&e, 0, sizeof e);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&e, &config));
}

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
        dqw_estimator_block b;
        memset(&b, 0, sizeof b);
        b.whole = random_bits(&r) % 50 != 0;
        e.elapsed = random_bits(&r) % 50 == 0 ? 2 : 1;
        e.blocks = (uint16_t)(k + 1);
        const bool blind = random_bits(&r) % 40 == 0;
        const bool wild = random_bits(&r) % 40 == 0;
        double ahead = POLES * (late_s * change + (shaft - w[0]) * HALF_S);
        ahead += noise_rad * random_normal(&r) + (wild ? 0.6 : 0);
        const double angle = POLES * w[0] * HALF_S + ahead;
        const float advance[2] = {blind ? 0.0f : (float)cos(angle), blind ? 0.0f : (float)sin(angle)};
        b.sum[2] = (float)random_uniform(&r, -10, 10), b.sum[3] = (float)random_uniform(&r, -10, 10);
        b.sum[6] = 100, b.sum[7] = -200, b.sum[8] = (float)(w[0] + w[1]);
        const dqw_estimator_block before = b;
        run = e.elapsed == 1 && b.whole ? (run < 3 ? run + 1 : 3) : 0;
        const bool teaches = dqw_estimator_keep_pace(&e, &b, advance, (float)w[0]);
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
        alike(l.num, (double)e.lag_num, 1e-3 * fabs(l.num) + 1e-7 * size, "ahead by the change before");
        alike(l.den, (double)e.lag_den, 1e-3 * fabs(l.den) + 1e-5 * size, "change by the change before");
        alike(l.by, (double)e.lag_by, 1e-3 * l.by, "change before");
        const double motion = l.den / (0.5 * l.by + 1e-300);
        if ((edge > 0.99 && edge < 1.01) || (motion > 0.99 && motion < 1.01)) continue;
        alike(l.rest, (double)e.lag_rest, 2e-3 * l.rest + 1e-12, "rest");
        HOLDS(e.paced == run);
        // Where pairs are missing nobody knows how a speed that is late has changed.
        HOLDS(teaches == (more == 0 || run > 0));
        corrected += more != 0 && teaches;
        if (!teaches) continue;
        alike((double)before.sum[8] + 2 * more, (double)b.sum[8], 3e-3 * fabs(more) + 1e-3, "speed");
        alike(100 + more * (double)b.sum[2], (double)b.sum[6], 3e-2 * fabs(more) + 1e-3, "speed by current on d");
        alike(-200 + more * (double)b.sum[3], (double)b.sum[7], 3e-2 * fabs(more) + 1e-3, "speed by current on q");
    }
    return corrected;
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
    RUN_TEST(test_a_speed_that_is_late);
    RUN_TEST(test_a_speed_that_is_mostly_noise);
    RUN_TEST(test_what_has_no_pace);
    return UNITY_END();
}
