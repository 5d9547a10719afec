// The change detector: against the rule told in other words, over random sequences; its limit, its ends.
#include "dqw_change.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

enum { BAND = 32, MOST = 4 * BAND };

// Page's sum in its other form: how far the walk of the excesses stands above the lowest it has been, as long as it
// stays below the limit.
// A walk that would pass the limit is pushed down onto it, all its past with it.
typedef struct walk {
    long at, lowest;
    int above;
} walk;

static bool walk_step(walk *w, long deviation, int limit)
{
    w->at += (deviation > MOST ? MOST : deviation < 0 ? 0 : deviation) - BAND;
    if (w->at < w->lowest) w->lowest = w->at;
    if (w->at - w->lowest > limit) w->at = w->lowest + limit;
    w->above = w->at == w->lowest ? 0 : w->above < 255 ? w->above + 1 : 255;
    return w->at - w->lowest == limit;
}

static void test_fresh_detector_has_seen_nothing(void)
{
    dqw_change c;
    memset(&c, 0x5a, sizeof c);
    dqw_change_init(&c);
    TEST_ASSERT_EQUAL_UINT8(0, c.sum_q5);
    TEST_ASSERT_EQUAL_UINT8(0, c.above);
    TEST_ASSERT_EQUAL_INT(BAND, DQW_CHANGE_BAND_Q5);
}

// Sequences that stay about the band for a while, go up, come down; every limit.
static void test_random_sequences_at_every_limit(void)
{
    test_random r = {1};
    int seen = 0;
    for (int limit = 1; limit <= 255; limit++)
        for (int sequence = 0; sequence < scaled(20); sequence++) {
            dqw_change c;
            dqw_change_init(&c);
            walk w = {0, 0, 0};
            double centre = BAND;
            for (int k = 0; k < 600; k++) {
                CASE("limit %d, sequence %d, step %d", limit, sequence, k);
                if (random_bits(&r) % 50 == 0) centre = random_uniform(&r, 0, 60);
                int32_t deviation = (int32_t)(centre + 10 * random_normal(&r));
                if (random_bits(&r) % 200 == 0) deviation = (int32_t)random_bits(&r);
                const bool expected = walk_step(&w, deviation, limit);
                seen += expected;
                HOLDS(dqw_change_step(&c, deviation, (uint8_t)limit) == expected);
                HOLDS(c.sum_q5 == w.at - w.lowest);
                HOLDS(c.above == w.above);
            }
        }
    BETWEEN(0.3, seen / (255.0 * 600 * scaled(20)), 0.5);  // 0.4: both answers are tried
}

// d bands out of the band tell after limit / (d - 1) steps, and `above` counts them.
static void test_a_steady_deviation_is_told_when_the_sum_is_full(void)
{
    for (int limit = 1; limit <= 255; limit++)
        for (int deviation = 0; deviation <= 300; deviation++) {
            CASE("limit %d, deviation %d", limit, deviation);
            dqw_change c;
            dqw_change_init(&c);
            int steps = 0;
            while (steps < 300) {
                steps++;
                if (dqw_change_step(&c, deviation, (uint8_t)limit)) break;
            }
            const int gain = (deviation < MOST ? deviation : MOST) - BAND;
            const int expected = gain <= 0 ? 300 : (limit + gain - 1) / gain;
            HOLDS(steps == expected);
            HOLDS(c.above == (gain <= 0 ? 0 : expected > 255 ? 255 : expected));
        }
}

static void test_wild_deviations_count_as_four_bands_or_none(void)
{
    static const int32_t wild[] = {INT32_MAX, INT32_MAX - 1, MOST, MOST + 1};
    static const int32_t none[] = {INT32_MIN, INT32_MIN + 1, -1, 0};
    for (int k = 0; k < 4; k++) {
        CASE("value %d", k);
        dqw_change c;
        dqw_change_init(&c);
        HOLDS(!dqw_change_step(&c, wild[k], 255));
        HOLDS(c.sum_q5 == MOST - BAND);
        HOLDS(!dqw_change_step(&c, wild[k], 255));
        HOLDS(dqw_change_step(&c, wild[k], 255) && c.sum_q5 == 255 && c.above == 3);
        HOLDS(!dqw_change_step(&c, none[k], 255) && c.sum_q5 == 255 - BAND && c.above == 4);
        // A limit that has come down since holds at once.
        HOLDS(dqw_change_step(&c, none[k], 7) && c.sum_q5 == 7);
        HOLDS(!dqw_change_step(&c, none[k], 7) && c.sum_q5 == 0 && c.above == 0);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_fresh_detector_has_seen_nothing);
    RUN_TEST(test_random_sequences_at_every_limit);
    RUN_TEST(test_a_steady_deviation_is_told_when_the_sum_is_full);
    RUN_TEST(test_wild_deviations_count_as_four_bands_or_none);
    return UNITY_END();
}
