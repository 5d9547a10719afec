// The three stages: every state with every input at the edges of its limits, paths, counters at their end.
#include "dqw_stage.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

static void test_init_and_define(void)
{
    dqw_stage s;
    memset(&s, 0x5a, sizeof s);
    dqw_stage_init(&s, 50000, 0, 0);
    TEST_ASSERT_EQUAL_INT(DQW_STAGE_DOMAIN, s.name);
    TEST_ASSERT_EQUAL_INT(DQW_BACK_NONE, s.back);
    TEST_ASSERT_EQUAL_UINT32(1, s.random_limit);
    TEST_ASSERT_EQUAL_UINT32(1, s.ordinal_blocks);
    TEST_ASSERT_EQUAL_UINT32(0, s.times_back);
    for (int name = 0; name < 4; name++) {
        s.name = (enum dqw_stage_name)name;
        s.blocks = 5;
        dqw_stage_define(&s);
        TEST_ASSERT_EQUAL_INT(name == DQW_STAGE_DOMAIN ? DQW_STAGE_RANDOM : name, s.name);
        TEST_ASSERT_EQUAL_UINT32(name == DQW_STAGE_DOMAIN ? 0 : 5, s.blocks);
    }
}

// All states x blocks 0 .. 5 and the end of the range x converged x residuals about the threshold, against a table.
static void test_every_step(void)
{
    static const uint32_t levels[] = {0, 99, 100, 101, UINT32_MAX};
    static const uint32_t at[] = {0, 1, 2, 3, 4, 5, UINT32_MAX - 1, UINT32_MAX};
    for (int name = 0; name < 4; name++)
        for (int b = 0; b < 8; b++)
            for (int c = 0; c < 2; c++)
                for (int i = 0; i < 5; i++)
                    for (int j = 0; j < 5; j++) {
                        CASE("state %d, blocks %u, converged %d, residuals %u %u", name, (unsigned)at[b], c,
                             (unsigned)levels[i], (unsigned)levels[j]);
                        dqw_stage s;
                        dqw_stage_init(&s, 100, 3, 4);
                        s.name = (enum dqw_stage_name)name;
                        s.blocks = at[b];
                        s.times_back = 8;
                        const dqw_stage_input in = {
                            .random_converged = c == 1, .residual_ppm = levels[i], .residual_recent_ppm = levels[j]};
                        const bool changed = dqw_stage_step(&s, in);

                        const uint64_t blocks = (uint64_t)at[b] + 1;
                        enum dqw_stage_name next = (enum dqw_stage_name)name;
                        enum dqw_stage_back why = DQW_BACK_NONE;
                        if (name == DQW_STAGE_RANDOM && c) next = DQW_STAGE_ORDINAL;
                        if (name == DQW_STAGE_RANDOM && !c && blocks >= 3) why = DQW_BACK_NOT_CONVERGED;
                        if (name == DQW_STAGE_ORDINAL && blocks >= 4 && levels[i] <= 100) next = DQW_STAGE_IN_SERVICE;
                        if (name == DQW_STAGE_ORDINAL && blocks >= 4 && levels[i] > 100) why = DQW_BACK_THRESHOLD;
                        if (name == DQW_STAGE_IN_SERVICE && levels[j] > 100) why = DQW_BACK_LEFT_BAND;
                        if (why != DQW_BACK_NONE) next = DQW_STAGE_DOMAIN;
                        HOLDS(s.name == next);
                        HOLDS(s.back == why);
                        HOLDS(changed == (next != (enum dqw_stage_name)name));
                        HOLDS(s.times_back == (why != DQW_BACK_NONE ? 9u : 8u));
                        HOLDS(s.residual_ppm == (why == DQW_BACK_NONE        ? 0u
                                                 : why == DQW_BACK_LEFT_BAND ? levels[j]
                                                                             : levels[i]));
                        HOLDS(s.blocks == (changed ? 0u : blocks > UINT32_MAX ? UINT32_MAX : (uint32_t)blocks));
                    }
}

static void test_the_whole_way_and_back(void)
{
    dqw_stage s;
    dqw_stage_init(&s, 100, 5, 3);
    const dqw_stage_input good = {true, 100, 100};
    const dqw_stage_input bad = {true, 100, 101};
    for (int k = 0; k < 10; k++) TEST_ASSERT_FALSE(dqw_stage_step(&s, good));
    dqw_stage_define(&s);
    TEST_ASSERT_TRUE(dqw_stage_step(&s, good));
    TEST_ASSERT_EQUAL_INT(DQW_STAGE_ORDINAL, s.name);
    TEST_ASSERT_FALSE(dqw_stage_step(&s, good));
    TEST_ASSERT_FALSE(dqw_stage_step(&s, good));
    TEST_ASSERT_TRUE(dqw_stage_step(&s, good));
    TEST_ASSERT_EQUAL_INT(DQW_STAGE_IN_SERVICE, s.name);
    for (int k = 0; k < 1000; k++) TEST_ASSERT_FALSE(dqw_stage_step(&s, good));
    TEST_ASSERT_TRUE(dqw_stage_step(&s, bad));
    TEST_ASSERT_EQUAL_INT(DQW_STAGE_DOMAIN, s.name);
    TEST_ASSERT_EQUAL_INT(DQW_BACK_LEFT_BAND, s.back);
    TEST_ASSERT_EQUAL_UINT32(101, s.residual_ppm);
    // Without new domain knowledge it stays there.
    for (int k = 0; k < 1000; k++) TEST_ASSERT_FALSE(dqw_stage_step(&s, good));
    dqw_stage_define(&s);
    const dqw_stage_input unsettled = {false, 0, 0};
    for (int k = 0; k < 4; k++) TEST_ASSERT_FALSE(dqw_stage_step(&s, unsettled));
    TEST_ASSERT_TRUE(dqw_stage_step(&s, unsettled));
    TEST_ASSERT_EQUAL_INT(DQW_BACK_NOT_CONVERGED, s.back);
    TEST_ASSERT_EQUAL_UINT32(2, s.times_back);
}

static void test_counters_stop_at_their_maximum(void)
{
    dqw_stage s;
    dqw_stage_init(&s, 0, 1, 1);
    s.blocks = UINT32_MAX;
    s.times_back = UINT16_MAX;
    const dqw_stage_input none = {false, 1, 1};
    TEST_ASSERT_FALSE(dqw_stage_step(&s, none));
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, s.blocks);
    s.name = DQW_STAGE_IN_SERVICE;
    TEST_ASSERT_TRUE(dqw_stage_step(&s, none));
    TEST_ASSERT_EQUAL_UINT32(UINT16_MAX, s.times_back);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_and_define);
    RUN_TEST(test_every_step);
    RUN_TEST(test_the_whole_way_and_back);
    RUN_TEST(test_counters_stop_at_their_maximum);
    return UNITY_END();
}
