// The triangular window against the same sums in double, with refused pairs, incomplete blocks and restarts.
#include "dqw_test.h"
#include "dqw_window.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

// Both sides, one pair: NULL where it was refused.
typedef struct both {
    dqw_window w;
    dqw_window_rise r;
} both;

static void begin(both *b, int half, int signals)
{
    memset(b, 0, sizeof *b);
    // Whatever the memory held.
    memset(&b->w, 0x5a, sizeof b->w);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_window_init(&b->w, half, signals));
}

static void gather(both *b, const float x[])
{
    if (x == NULL) {
        dqw_window_refuse(&b->w);
        return;
    }
    for (int i = 0; i < b->w.signals; i++) dqw_window_gather(&dqw_window_cells(&b->w)[i], x[i]);
    dqw_window_count(&b->w);
}

static uint32_t join(both *b, float block[])
{
    float sum[2];
    TEST_ASSERT_TRUE(dqw_handover_waits(&b->w.over));
    const uint32_t event = dqw_window_join(&b->w, &b->r, block, sum);
    dqw_handover_release(&b->w.over);
    return event;
}

static uint32_t pair(both *b, const float x[], float block[])
{
    gather(b, x);
    if (!dqw_window_full(&b->w)) return 0;
    TEST_ASSERT_TRUE(dqw_window_turn(&b->w));
    return join(b, block);
}

static void test_init_refuses_and_leaves_the_object_alone(void)
{
    dqw_window w;
    TEST_ASSERT_EQUAL_INT(DQW_ERR_NULL, dqw_window_init(NULL, 20, 9));
    static const int bad[][2] = {{0, 9},          {-1, 9}, {10001, 9}, {INT32_MAX, 9},
                                 {65536 + 20, 9}, {20, 0}, {20, -1},   {20, DQW_WINDOW_SIGNALS + 1},
                                 {20, 257}};
    for (unsigned k = 0; k < sizeof bad / sizeof bad[0]; k++)
        REFUSED(w, DQW_ERR_SIZE, dqw_window_init(&w, bad[k][0], bad[k][1]));
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_window_init(&w, 10000, DQW_WINDOW_SIGNALS));
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_window_init(&w, 1, 1));
}

enum { LENGTH = 4000, SIGNALS = 3 };
static float signal[LENGTH][SIGNALS];
static bool present[LENGTH];

// Block b covers pairs b half .. (b + 2) half - 1: weights 1 .. half up, half .. 1 down.
static bool naive(int half, int block, double out[SIGNALS])
{
    double weight = 0.0;
    int valid = 0;
    for (int i = 0; i < SIGNALS; i++) out[i] = 0.0;
    for (int k = 0; k < 2 * half; k++) {
        const int at = block * half + k;
        if (!present[at]) continue;
        const double w = k < half ? k + 1 : 2 * half - k;
        for (int i = 0; i < SIGNALS; i++) out[i] += w * signal[at][i];
        weight += w;
        valid++;
    }
    for (int i = 0; i < SIGNALS; i++) out[i] /= weight;
    return 4 * valid >= 3 * 2 * half;
}

static void test_is_the_triangular_mean_of_what_was_there(void)
{
    static const int halves[] = {1, 2, 3, 20, 25, 100, 777};
    static const double missing[] = {0.0, 0.05, 0.2, 0.27, 0.6};
    test_random r = {21};
    double worst = 0.0;
    int incomplete = 0;
    for (int h = 0; h < 7; h++)
        for (int m = 0; m < 5; m++) {
            const int half = halves[h];
            for (int k = 0; k < LENGTH; k++) {
                present[k] = random_uniform(&r, 0, 1) >= missing[m];
                for (int i = 0; i < SIGNALS; i++) signal[k][i] = (float)(i + random_normal(&r));
            }
            both w;
            begin(&w, half, SIGNALS);
            for (int k = 0; k < LENGTH; k++) {
                CASE("half %d, missing %g, pair %d", half, missing[m], k);
                float block[SIGNALS] = {-99.0f, -99.0f, -99.0f};
                const uint32_t event = pair(&w, present[k] ? signal[k] : NULL, block);
                double expected[SIGNALS];
                if ((k + 1) % half != 0 || k + 1 < 2 * half) {
                    HOLDS(event == 0);
                    HOLDS(block[0] == -99.0f);
                } else if (naive(half, (k + 1) / half - 2, expected)) {
                    HOLDS(event == DQW_EVENT_BLOCK);
                    for (int i = 0; i < SIGNALS; i++) worst = fmax(worst, fabs(block[i] - expected[i]));
                } else {
                    HOLDS(event == DQW_EVENT_INCOMPLETE);
                    HOLDS(block[0] == -99.0f);
                    incomplete++;
                }
            }
        }
    BETWEEN(1e-7, worst, 1e-5);
    BETWEEN(100, incomplete, 20000);
}

static void test_restart_forgets(void)
{
    test_random r = {22};
    for (int at = 0; at < 60; at++) {
        CASE("restart after %d", at);
        both fresh;
        both used;
        begin(&fresh, 10, 1);
        begin(&used, 10, 1);
        float block = 0.0f;
        for (int k = 0; k < at; k++) {
            const float x = (float)random_normal(&r);
            (void)pair(&used, k % 7 ? &x : NULL, &block);
        }
        dqw_window_restart(&used.w);
        for (int k = 0; k < 50; k++) {
            const float x = (float)random_normal(&r);
            float a = 0.0f;
            float b = 0.0f;
            const uint32_t one = pair(&fresh, &x, &a);
            const uint32_t two = pair(&used, &x, &b);
            HOLDS(one == two);
            HOLDS(a == b);
        }
    }
}

// Pairs of any signal that satisfy v = R i + L di + c satisfy it after windowing, with pairs missing and for any
// signal.
static void test_a_linear_pair_equation_survives(void)
{
    test_random r = {23};
    for (int run = 0; run < 200; run++) {
        CASE("run %d", run);
        const int half = 1 + (int)(random_bits(&r) % 60);
        const double R = random_uniform(&r, 0.01, 10);
        const double L = random_uniform(&r, 1e-5, 1e-2);
        const double c = random_uniform(&r, -5, 5);
        const double dt = 1e-4;
        both w;
        begin(&w, half, 3);
        double i = 0.0;
        double size = fabs(c);
        for (int k = 0; k < 500; k++) {
            const double step = random_normal(&r) * (random_bits(&r) % 8 == 0 ? 10 : 0.3);
            const double mean = i + 0.5 * step;
            const double slope = step / dt;
            i += step;
            const float x[] = {(float)(R * mean + L * slope + c), (float)mean, (float)slope};
            size = fmax(size, fabs(R * mean) + fabs(L * slope));
            float b[3];
            if (pair(&w, random_bits(&r) % 20 ? x : NULL, b) == DQW_EVENT_BLOCK) {
                const double rest = b[0] - R * b[1] - L * b[2] - c;
                BETWEEN(-1e-6, rest / size, 1e-6);  // 2e-7
            }
        }
    }
}

// The slope of a current under the window is the difference of two means: noise falls as half^-1.5.
static void test_noise_of_the_slope(void)
{
    static const int halves[] = {5, 20, 80};
    for (int h = 0; h < 3; h++) {
        const int half = halves[h];
        CASE("half %d", half);
        both w;
        begin(&w, half, 1);
        test_random r = {24};
        double last = random_normal(&r);
        double sum = 0.0;
        int blocks = 0;
        for (int k = 0; k < 40000; k++) {
            const double now = random_normal(&r);
            const float slope = (float)(now - last);
            last = now;
            float b;
            if (pair(&w, &slope, &b) == DQW_EVENT_BLOCK) {
                sum += (double)b * b;
                blocks++;
            }
        }
        // (mean of the last half - mean of the first half) / half-ish: variance 2 half / (half (half + 1))^2.
        const double expected = sqrt(2.0 * half) / (half * (half + 1.0));
        BETWEEN(0.9, sqrt(sum / blocks) / expected, 1.1);
    }
}

// As many signals as there is room for: each stays in its place, also where what is being gathered is forgotten while a
// half waits.
static void test_as_many_signals_as_there_is_room_for(void)
{
    enum { MOST = DQW_WINDOW_SIGNALS };
    float x[MOST];
    for (int i = 0; i < MOST; i++) x[i] = (float)(i + 1);
    for (int before = 0; before < 2; before++) {
        both b;
        begin(&b, 2, MOST);
        for (int n = 0; n < before + 2; n++) {
            float block[MOST + 1];
            for (int i = 0; i <= MOST; i++) block[i] = -99;
            for (int k = 0; k < 2; k++) gather(&b, x);
            TEST_ASSERT_TRUE(dqw_window_turn(&b.w));
            if (n == before + 1) {
                gather(&b, x);
                dqw_window_restart(&b.w);
            }
            CASE("%d before, half %d", before, n);
            HOLDS(join(&b, block) == (n == 0 ? 0u : (uint32_t)DQW_EVENT_BLOCK));
            for (int i = 0; i < MOST && n > 0; i++) HOLDS(block[i] == (float)(i + 1));
            HOLDS(block[MOST] == -99);
        }
    }
}

// A background that comes too late loses the half that was full meanwhile; the next one follows nothing.
static void test_a_late_background_loses_a_half(void)
{
    both b;
    begin(&b, 3, 1);
    float block = 0.0f;
    float x = 1.0f;
    for (int k = 0; k < 3; k++) gather(&b, &x);
    TEST_ASSERT_TRUE(dqw_window_turn(&b.w));
    x = 100.0f;
    for (int k = 0; k < 3; k++) gather(&b, &x);
    TEST_ASSERT_FALSE(dqw_window_turn(&b.w));
    TEST_ASSERT_EQUAL_UINT32(0, join(&b, &block));
    TEST_ASSERT_FALSE(dqw_handover_waits(&b.w.over));
    x = 3.0f;
    for (int k = 0; k < 2; k++) TEST_ASSERT_EQUAL_UINT32(0, pair(&b, &x, &block));
    TEST_ASSERT_EQUAL_UINT32(0, pair(&b, &x, &block));
    x = 5.0f;
    for (int k = 0; k < 2; k++) TEST_ASSERT_EQUAL_UINT32(0, pair(&b, &x, &block));
    TEST_ASSERT_EQUAL_UINT32(DQW_EVENT_BLOCK, pair(&b, &x, &block));
    TEST_ASSERT_EQUAL_FLOAT(4.0f, block);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_and_leaves_the_object_alone);
    RUN_TEST(test_is_the_triangular_mean_of_what_was_there);
    RUN_TEST(test_restart_forgets);
    RUN_TEST(test_a_linear_pair_equation_survives);
    RUN_TEST(test_noise_of_the_slope);
    RUN_TEST(test_as_many_signals_as_there_is_room_for);
    RUN_TEST(test_a_late_background_loses_a_half);
    return UNITY_END();
}
