// The watch: how long healthy values have not followed, where blocks were missing for long.
#include "dqw_test.h"
#include "dqw_watch.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

// The 16 bits of that time would come round in 65536 steps: from a pause of one less on it stands at its end.
static void test_a_long_pause_is_the_longest_time(void)
{
    const uint32_t step = 1u << DQW_WATCH_FOLLOW_SHIFT;
    const uint32_t pauses[] = {65535, 65536, 70000, 16000000};
    for (int k = 0; k < 4; k++) {
        CASE("pause of %lu", (unsigned long)pauses[k]);
        dqw_watch w;
        dqw_watch_init(&w);
        dqw_watch_learned(&w, 5 * step);
        for (int channel = DQW_WATCH_R; channel <= DQW_WATCH_PSI; channel += DQW_WATCH_PSI - DQW_WATCH_R)
            dqw_watch_follow(&w, channel, 5 * step);
        dqw_watch_learned(&w, 10 * step);
        TEST_ASSERT_EQUAL_UINT16(5, dqw_watch_unfollowed(&w, DQW_WATCH_R, 10 * step));
        dqw_watch_learned(&w, (10 + pauses[k]) * step);
        TEST_ASSERT_EQUAL_UINT16(0xffff, dqw_watch_unfollowed(&w, DQW_WATCH_R, (10 + pauses[k]) * step));
        TEST_ASSERT_EQUAL_UINT16(0xffff, dqw_watch_unfollowed(&w, DQW_WATCH_PSI, (10 + pauses[k]) * step));
    }
    dqw_watch w;
    dqw_watch_init(&w);
    dqw_watch_learned(&w, 65534 * step);
    TEST_ASSERT_EQUAL_UINT16(65534, dqw_watch_unfollowed(&w, DQW_WATCH_R, 65534 * step));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_long_pause_is_the_longest_time);
    return UNITY_END();
}
