// The three stages: every state with every input at the edges of its limits, paths, counters at their end.
#include "dqw_stage.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

static void test_init_and_define(void)
{
    dqw_stage s;
    memset(&s, 0x5a, sizeof s);
    dqw_stage_init(&s, 0);
    TEST_ASSERT_EQUAL_INT(DQW_STAGE_DOMAIN, s.name);
    TEST_ASSERT_EQUAL_INT(DQW_BACK_NONE, s.back);
    TEST_ASSERT_EQUAL_UINT32(50000, s.threshold_ppm);
    TEST_ASSERT_EQUAL_UINT32(0, s.times_back);
    for (int name = 0; name < 4; name++) {
        s.name = (enum dqw_stage_name)name;
        s.blocks = 5;
        dqw_stage_define(&s);
        TEST_ASSERT_EQUAL_INT(name == DQW_STAGE_DOMAIN ? DQW_STAGE_RANDOM : name, s.name);
        TEST_ASSERT_EQUAL_UINT32(name == DQW_STAGE_DOMAIN ? 0 : 5, s.blocks);
    }
}

// All states x blocks about the limits and the end of the range x converged x residuals about the threshold, against a
// table.
static void test_every_step(void)
{
    static const uint32_t levels[] = {0, 99, 100, 101, UINT32_MAX};
    static const uint32_t at[] = {0, 1, 498, 499, 500, 1998, 1999, 2000, UINT32_MAX - 1, UINT32_MAX};
    for (int name = 0; name < 4; name++)
        for (int b = 0; b < 10; b++)
            for (int c = 0; c < 2; c++)
                for (int i = 0; i < 5; i++) {
                    CASE("state %d, blocks %u, converged %d, residual %u", name, (unsigned)at[b], c,
                         (unsigned)levels[i]);
                    dqw_stage s;
                    dqw_stage_init(&s, 100);
                    s.name = (enum dqw_stage_name)name;
                    s.blocks = at[b];
                    s.times_back = 8;
                    const bool changed = dqw_stage_step(&s, c == 1, levels[i]);

                    const uint64_t blocks = (uint64_t)at[b] + 1;
                    enum dqw_stage_name next = (enum dqw_stage_name)name;
                    enum dqw_stage_back why = DQW_BACK_NONE;
                    if (name == DQW_STAGE_RANDOM && c) next = DQW_STAGE_ORDINAL;
                    if (name == DQW_STAGE_RANDOM && !c && blocks >= 2000) why = DQW_BACK_NOT_CONVERGED;
                    if (name == DQW_STAGE_ORDINAL && blocks >= 500 && levels[i] <= 100) next = DQW_STAGE_IN_SERVICE;
                    if (name == DQW_STAGE_ORDINAL && blocks >= 500 && levels[i] > 100) why = DQW_BACK_THRESHOLD;
                    if (name == DQW_STAGE_IN_SERVICE && levels[i] > 100) why = DQW_BACK_LEFT_BAND;
                    if (why != DQW_BACK_NONE) next = DQW_STAGE_DOMAIN;
                    HOLDS(s.name == next);
                    HOLDS(s.back == why);
                    HOLDS(changed == (next != (enum dqw_stage_name)name));
                    HOLDS(s.times_back == (why != DQW_BACK_NONE ? 9u : 8u));
                    HOLDS(s.residual_ppm == (why == DQW_BACK_NONE ? 0u : levels[i]));
                    HOLDS(s.blocks == (changed ? 0u : blocks > UINT32_MAX ? UINT32_MAX : (uint32_t)blocks));
                }
}

static void stays(dqw_stage *s, int steps, bool converged)
{
    for (int k = 0; k < steps; k++) TEST_ASSERT_FALSE(dqw_stage_step(s, converged, 100));
}

static void test_the_whole_way_and_back(void)
{
    dqw_stage s;
    dqw_stage_init(&s, 100);
    stays(&s, 10, true);
    dqw_stage_define(&s);
    TEST_ASSERT_TRUE(dqw_stage_step(&s, true, 100));
    TEST_ASSERT_EQUAL_INT(DQW_STAGE_ORDINAL, s.name);
    stays(&s, 499, true);
    TEST_ASSERT_TRUE(dqw_stage_step(&s, true, 100));
    TEST_ASSERT_EQUAL_INT(DQW_STAGE_IN_SERVICE, s.name);
    stays(&s, 1000, true);
    TEST_ASSERT_TRUE(dqw_stage_step(&s, true, 101));
    TEST_ASSERT_EQUAL_INT(DQW_STAGE_DOMAIN, s.name);
    TEST_ASSERT_EQUAL_INT(DQW_BACK_LEFT_BAND, s.back);
    TEST_ASSERT_EQUAL_UINT32(101, s.residual_ppm);
    // Without new domain knowledge it stays there.
    stays(&s, 1000, true);
    dqw_stage_define(&s);
    stays(&s, 1999, false);
    TEST_ASSERT_TRUE(dqw_stage_step(&s, false, 100));
    TEST_ASSERT_EQUAL_INT(DQW_BACK_NOT_CONVERGED, s.back);
    TEST_ASSERT_EQUAL_UINT32(2, s.times_back);
}

static void test_counters_stop_at_their_maximum(void)
{
    dqw_stage s;
    dqw_stage_init(&s, 1);
    s.blocks = UINT32_MAX;
    s.times_back = UINT16_MAX;
    TEST_ASSERT_FALSE(dqw_stage_step(&s, false, 2));
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, s.blocks);
    s.name = DQW_STAGE_IN_SERVICE;
    TEST_ASSERT_TRUE(dqw_stage_step(&s, false, 2));
    TEST_ASSERT_EQUAL_UINT32(UINT16_MAX, s.times_back);
}

// 50 blocks, and twice as many each time, while stage 3 is not judged. (E194)
static void test_four_times_a_start_is_forgotten(void)
{
    uint32_t found[5] = {0};
    int count = 0;
    for (uint32_t blocks = 0; blocks <= 70000u; blocks++)
        if (dqw_stage_forgets(blocks) && count < 5) found[count++] = blocks;
    TEST_ASSERT_EQUAL_INT(4, count);
    for (int k = 0; k < 4; k++) TEST_ASSERT_EQUAL_UINT32(50u << k, found[k]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_and_define);
    RUN_TEST(test_every_step);
    RUN_TEST(test_the_whole_way_and_back);
    RUN_TEST(test_counters_stop_at_their_maximum);
    RUN_TEST(test_four_times_a_start_is_forgotten);
    return UNITY_END();
}
