// The triangular window in whole numbers: to the last bit the sums in 64 bits, with refused pairs, incomplete blocks,
// restarts, extremes.
#include "dqw_test.h"
#include "dqw_window_q15.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

// Both sides, one pair: NULL where it was refused.
typedef struct both {
    dqw_window_q15 w;
    dqw_window_q15_rise r;
} both;

static void begin(both *b, int half, int signals)
{
    memset(b, 0, sizeof *b);
    // Whatever the memory held.
    memset(&b->w, 0x5a, sizeof b->w);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_window_init_q15(&b->w, half, signals));
}

static void gather(both *b, const int32_t x[])
{
    if (x == NULL) {
        dqw_window_refuse_q15(&b->w);
        return;
    }
    for (int i = 0; i < b->w.signals; i++) dqw_window_gather_q15(&dqw_window_cells_q15(&b->w)[i], x[i]);
    dqw_window_count_q15(&b->w);
}

static uint32_t join(both *b, int32_t block[], uint16_t *weight)
{
    int32_t sum[2];
    TEST_ASSERT_TRUE(dqw_handover_waits(&b->w.over));
    const uint32_t event = dqw_window_join_q15(&b->w, &b->r, block, weight, sum);
    dqw_handover_release(&b->w.over);
    return event;
}

static uint32_t step(both *b, const int32_t x[], int32_t block[], uint16_t *weight)
{
    gather(b, x);
    if (!dqw_window_full_q15(&b->w)) return 0;
    TEST_ASSERT_TRUE(dqw_window_turn_q15(&b->w));
    return join(b, block, weight);
}

static void test_init_refuses_and_leaves_the_object_alone(void)
{
    dqw_window_q15 w;
    TEST_ASSERT_EQUAL_INT(DQW_ERR_NULL, dqw_window_init_q15(NULL, 20, 9));
    static const int bad[][2] = {{0, 9},         {-1, 9}, {101, 9}, {256 + 20, 9},
                                 {INT32_MAX, 9}, {20, 0}, {20, -1}, {20, DQW_WINDOW_Q15_SIGNALS + 1},
                                 {20, 257}};
    for (unsigned k = 0; k < sizeof bad / sizeof bad[0]; k++)
        REFUSED(w, DQW_ERR_SIZE, dqw_window_init_q15(&w, bad[k][0], bad[k][1]));
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_window_init_q15(&w, DQW_WINDOW_Q15_HALF, DQW_WINDOW_Q15_SIGNALS));
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_window_init_q15(&w, 1, 1));
}

enum { LENGTH = 4000, SIGNALS = 3, EDGE = 1 << 17 };
static int32_t signal[LENGTH][SIGNALS];
static bool present[LENGTH];

// Block b covers pairs b half .. (b + 2) half - 1: weights 1 .. half up, half .. 1 down.
static bool naive(int half, int block, int64_t out[SIGNALS], int64_t *weight)
{
    int valid = 0;
    *weight = 0;
    for (int i = 0; i < SIGNALS; i++) out[i] = 0;
    for (int k = 0; k < 2 * half; k++) {
        const int at = block * half + k;
        if (!present[at]) continue;
        const int g = k < half ? k + 1 : 2 * half - k;
        for (int i = 0; i < SIGNALS; i++) out[i] += (int64_t)g * signal[at][i];
        *weight += g;
        valid++;
    }
    return 4 * valid >= 3 * 2 * half;
}

static void test_is_the_triangular_sum_of_what_was_there(void)
{
    static const int halves[] = {1, 2, 3, 20, 25, 77, 100};
    static const double missing[] = {0.0, 0.05, 0.2, 0.27, 0.6};
    test_random r = {21};
    int learned = 0;
    int incomplete = 0;
    double largest = 0.0;
    for (int h = 0; h < 7; h++)
        for (int m = 0; m < 5; m++) {
            const int half = halves[h];
            for (int k = 0; k < LENGTH; k++) {
                present[k] = random_uniform(&r, 0, 1) >= missing[m];
                signal[k][0] = (int32_t)(random_bits(&r) % (2 * EDGE + 1)) - EDGE;
                signal[k][1] = EDGE;
                signal[k][2] = k / 500 % 2 ? EDGE : -EDGE;
            }
            both w;
            begin(&w, half, SIGNALS);
            for (int k = 0; k < LENGTH; k++) {
                CASE("half %d, missing %g, pair %d", half, missing[m], k);
                int32_t block[SIGNALS] = {-99, -99, -99};
                uint16_t weight = 9999;
                const uint32_t event = step(&w, present[k] ? signal[k] : NULL, block, &weight);
                int64_t expected[SIGNALS];
                int64_t expected_weight;
                if ((k + 1) % half != 0 || k + 1 < 2 * half) {
                    HOLDS(event == 0);
                    HOLDS(block[0] == -99 && weight == 9999);
                } else if (naive(half, (k + 1) / half - 2, expected, &expected_weight)) {
                    HOLDS(event == DQW_EVENT_BLOCK);
                    HOLDS(weight == expected_weight);
                    for (int i = 0; i < SIGNALS; i++) HOLDS(block[i] == expected[i]);
                    largest = fmax(largest, fabs((double)block[1]));
                    learned++;
                } else {
                    HOLDS(event == DQW_EVENT_INCOMPLETE);
                    HOLDS(block[0] == -99 && weight == 9999);
                    incomplete++;
                }
            }
        }
    BETWEEN(20000, learned, 40000);
    BETWEEN(100, incomplete, 20000);
    // The bound of DQW_WINDOW_Q15_HALF is reached: 100 * 101 * 2^17.
    BETWEEN(1323827200.0, largest, 1323827200.0);
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
        int32_t block = 0;
        uint16_t weight = 0;
        for (int k = 0; k < at; k++) {
            const int32_t x = (int32_t)(random_bits(&r) % EDGE);
            (void)step(&used, k % 7 ? &x : NULL, &block, &weight);
        }
        dqw_window_restart_q15(&used.w);
        for (int k = 0; k < 50; k++) {
            const int32_t x = (int32_t)(random_bits(&r) % EDGE);
            int32_t a = 0;
            int32_t b = 0;
            const uint32_t one = step(&fresh, &x, &a, &weight);
            const uint32_t two = step(&used, &x, &b, &weight);
            HOLDS(one == two);
            HOLDS(a == b);
        }
    }
}

// As many signals as there is room for: each stays in its place, also where what is being gathered is forgotten while a
// half waits.
static void test_as_many_signals_as_there_is_room_for(void)
{
    enum { MOST = DQW_WINDOW_Q15_SIGNALS };
    int32_t x[MOST];
    for (int i = 0; i < MOST; i++) x[i] = (int32_t)(i + 1);
    for (int before = 0; before < 2; before++) {
        both b;
        begin(&b, 2, MOST);
        for (int n = 0; n < before + 2; n++) {
            int32_t block[MOST + 1];
            for (int i = 0; i <= MOST; i++) block[i] = -99;
            uint16_t weight = 0;
            for (int k = 0; k < 2; k++) gather(&b, x);
            TEST_ASSERT_TRUE(dqw_window_turn_q15(&b.w));
            if (n == before + 1) {
                gather(&b, x);
                dqw_window_restart_q15(&b.w);
            }
            CASE("%d before, half %d", before, n);
            HOLDS(join(&b, block, &weight) == (n == 0 ? 0u : (uint32_t)DQW_EVENT_BLOCK));
            for (int i = 0; i < MOST && n > 0; i++) HOLDS(block[i] == 6 * (i + 1));
            HOLDS(block[MOST] == -99);
        }
    }
}

// A background that comes too late loses the half that was full meanwhile; the next one follows nothing.
static void test_a_late_background_loses_a_half(void)
{
    both b;
    begin(&b, 3, 1);
    int32_t block = 0;
    uint16_t weight = 0;
    int32_t x = 1;
    for (int k = 0; k < 3; k++) gather(&b, &x);
    TEST_ASSERT_TRUE(dqw_window_turn_q15(&b.w));
    x = 100;
    for (int k = 0; k < 3; k++) gather(&b, &x);
    TEST_ASSERT_FALSE(dqw_window_turn_q15(&b.w));
    TEST_ASSERT_EQUAL_UINT32(0, join(&b, &block, &weight));
    TEST_ASSERT_FALSE(dqw_handover_waits(&b.w.over));
    x = 3;
    for (int k = 0; k < 3; k++) TEST_ASSERT_EQUAL_UINT32(0, step(&b, &x, &block, &weight));
    x = 5;
    for (int k = 0; k < 2; k++) TEST_ASSERT_EQUAL_UINT32(0, step(&b, &x, &block, &weight));
    TEST_ASSERT_EQUAL_UINT32(DQW_EVENT_BLOCK, step(&b, &x, &block, &weight));
    TEST_ASSERT_EQUAL_INT32(3 * 6 + 5 * 6, block);
    TEST_ASSERT_EQUAL_UINT16(12, weight);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_and_leaves_the_object_alone);
    RUN_TEST(test_is_the_triangular_sum_of_what_was_there);
    RUN_TEST(test_restart_forgets);
    RUN_TEST(test_as_many_signals_as_there_is_room_for);
    RUN_TEST(test_a_late_background_loses_a_half);
    return UNITY_END();
}
