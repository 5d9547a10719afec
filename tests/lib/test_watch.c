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

// Too hot is told once, and again when the winding was cool in between.
static void test_too_hot_is_told_again_after_it_was_cool(void)
{
    dqw_watch w;
    dqw_watch_init(&w);
    int32_t q5[DQW_WATCH_CHANNELS] = {0};
    for (int cool = 0; cool < 2; cool++) {
        dqw_watch_init(&w);
        TEST_ASSERT_EQUAL_INT(DQW_WATCH_APART,
                              dqw_watch_named(&w, DQW_WATCH_TEMPERATURE, DQW_FAULT_OVER_TEMPERATURE, true));
        q5[DQW_WATCH_TEMPERATURE] = 4 * DQW_CHANGE_BAND_Q5;
        for (int k = 0; k < 5; k++) (void)dqw_watch_look(&w, q5);
        HOLDS(w.alarms == 0);
        q5[DQW_WATCH_TEMPERATURE] = cool ? 0 : 1;
        (void)dqw_watch_look(&w, q5);
        q5[DQW_WATCH_TEMPERATURE] = 4 * DQW_CHANGE_BAND_Q5;
        for (int k = 0; k < 5; k++) (void)dqw_watch_look(&w, q5);
        CASE("cool %d", cool);
        HOLDS(w.alarms == (cool ? 1u << DQW_WATCH_TEMPERATURE : 0u));
    }
}

// What two names explain waits six times, what none does twice, what one does not at all.
static void test_a_name_that_is_not_sure_waits(void)
{
    static const struct {
        enum dqw_fault_name name;
        bool sure;
        int later;
    } cases[] = {{DQW_FAULT_DEMAGNETISATION, true, 0},
                 {DQW_FAULT_DEMAGNETISATION, false, 6},
                 {DQW_FAULT_RESISTANCE_RISE, true, 2},
                 {DQW_FAULT_UNKNOWN, false, 2}};
    for (unsigned k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        dqw_watch w;
        dqw_watch_init(&w);
        w.alarms = 1u << DQW_WATCH_PSI;
        int later = 0;
        while (later < 9 && dqw_watch_named(&w, DQW_WATCH_PSI, cases[k].name, cases[k].sure) == DQW_WATCH_LATER)
            later++;
        CASE("case %u: %d times", k, later);
        HOLDS(later == cases[k].later && w.back == (cases[k].name == DQW_FAULT_UNKNOWN));
    }
}

// A worn bearing is healthy friction from then on: it is gathered anew.
static void test_friction_is_gathered_anew_after_its_event(void)
{
    dqw_watch w;
    dqw_watch_init(&w);
    w.looks[DQW_WATCH_FRICTION] = DQW_WATCH_LOOKS_MOST;
    w.looks[DQW_WATCH_R] = 77;
    w.reversals = DQW_WATCH_REVERSALS_MOST;
    w.change[DQW_WATCH_FRICTION].sum_q5 = 99;
    w.alarms = 1u << DQW_WATCH_FRICTION;
    TEST_ASSERT_EQUAL_INT(DQW_WATCH_APART, dqw_watch_named(&w, DQW_WATCH_FRICTION, DQW_FAULT_BEARING_WEAR, true));
    HOLDS(w.looks[DQW_WATCH_FRICTION] == 0 && w.reversals == 0 && w.change[DQW_WATCH_FRICTION].sum_q5 == 0);
    HOLDS(w.alarms == 0 && w.looks[DQW_WATCH_R] == 77);
}

// Healthy values that are taken anew settle anew: what is timed and waited for goes on.
static void test_adopting_leaves_what_is_timed(void)
{
    dqw_watch w;
    memset(&w, 0x5a, sizeof w);
    const dqw_watch before = w;
    dqw_watch_adopt(&w, 7u << DQW_WATCH_FOLLOW_SHIFT);
    for (int i = 0; i < DQW_WATCH_TEMPERATURE; i++) HOLDS(w.looks[i] == 0);
    for (int i = 0; i < DQW_WATCH_CHANNELS; i++) HOLDS(w.change[i].sum_q5 == 0 && w.change[i].above == 0);
    HOLDS(w.reversals == 0 && w.alarms == 0 && w.followed[0] == 7 && w.followed[1] == 7);
    HOLDS(w.blocks == before.blocks && w.wait == before.wait && w.learned_at == before.learned_at &&
          w.gathered == before.gathered && w.before == before.before);
    uint8_t looks[DQW_WATCH_TEMPERATURE + 1];
    for (int i = 0; i <= DQW_WATCH_TEMPERATURE; i++) looks[i] = (uint8_t)(i + 1);
    dqw_watch_restore(&w, looks);
    for (int i = 0; i < DQW_WATCH_TEMPERATURE; i++) HOLDS(w.looks[i] == i + 1);
    HOLDS(w.blocks == before.blocks && w.wait == before.wait);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_long_pause_is_the_longest_time);
    RUN_TEST(test_too_hot_is_told_again_after_it_was_cool);
    RUN_TEST(test_a_name_that_is_not_sure_waits);
    RUN_TEST(test_friction_is_gathered_anew_after_its_event);
    RUN_TEST(test_adopting_leaves_what_is_timed);
    return UNITY_END();
}
