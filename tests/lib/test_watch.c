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

// Learned without a pause, but never so surely that a healthy value follows: after 16.8 million halves, 4.7 h of 1 ms,
// the time since it last did must not begin anew, for what heated meanwhile would be a change.
static void test_time_without_following_does_not_come_round(void)
{
    dqw_watch w;
    dqw_watch_init(&w);
    for (uint32_t at = 0; at <= 20000000u; at += 50) dqw_watch_learned(&w, at);
    for (int channel = DQW_WATCH_R; channel <= DQW_WATCH_PSI; channel += DQW_WATCH_PSI - DQW_WATCH_R)
        BETWEEN(0xfffe, dqw_watch_unfollowed(&w, channel, 20000000u), 0xffff);
    dqw_watch_follow(&w, DQW_WATCH_PSI, 20000000u);
    TEST_ASSERT_EQUAL_UINT16(0, dqw_watch_unfollowed(&w, DQW_WATCH_PSI, 20000000u));
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

// What two names explain waits six times, what none does twice, what one does not at all, but R alone twice; and six
// times what none explains where a ripple shows, whatever shows most.
static void test_a_name_that_is_not_sure_waits(void)
{
    static const struct {
        enum dqw_fault_name name;
        int channel;
        bool sure;
        int later;
        uint16_t also;
    } cases[] = {{DQW_FAULT_DEMAGNETISATION, DQW_WATCH_PSI, true, 0, 0},
                 {DQW_FAULT_DEMAGNETISATION, DQW_WATCH_PSI, false, 6, 0},
                 {DQW_FAULT_RESISTANCE_RISE, DQW_WATCH_PSI, true, 2, 0},
                 {DQW_FAULT_RESISTANCE_RISE, DQW_WATCH_R, false, 6, 0},
                 {DQW_FAULT_RESISTANCE_RISE, DQW_WATCH_R, true, 2, 1u << DQW_WATCH_RESISTANCE},
                 {DQW_FAULT_UNKNOWN, DQW_WATCH_ANGLE, false, 2, 0},
                 {DQW_FAULT_UNKNOWN, DQW_WATCH_R, true, 6, 1u << DQW_WATCH_OFFSET},
                 {DQW_FAULT_UNKNOWN, DQW_WATCH_R, true, 6, 1u << DQW_WATCH_SHORT},
                 {DQW_FAULT_UNKNOWN, DQW_WATCH_R, false, 2, 1u << DQW_WATCH_ANGLE | 1u << DQW_WATCH_FRICTION},
                 {DQW_FAULT_UNKNOWN, DQW_WATCH_OFFSET, false, 6, 0},
                 {DQW_FAULT_TURN_SHORT, DQW_WATCH_SHORT, true, 0, 0},
                 {DQW_FAULT_UNKNOWN, DQW_WATCH_SHORT, true, 6, 0},
                 {DQW_FAULT_UNKNOWN, DQW_WATCH_RESIDUAL, false, 2, 1u << DQW_WATCH_RESISTANCE},
                 {DQW_FAULT_UNKNOWN, DQW_WATCH_FRICTION, false, 2, 0}};
    for (unsigned k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        dqw_watch w;
        dqw_watch_init(&w);
        w.alarms = (uint16_t)(1u << cases[k].channel | cases[k].also);
        int later = 0;
        while (later < 9 && dqw_watch_named(&w, cases[k].channel, cases[k].name, cases[k].sure) == DQW_WATCH_LATER)
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

// More than 64 halves without a learned block are a pause, after which healthy values wait as long as it was, a
// minute's looks at most; not while an event is named, nor longer than they wait already.
static void test_pauses(void)
{
    static const uint32_t halves[] = {1, 64, 65, 100, 959, 960, 5000};
    for (unsigned k = 0; k < sizeof halves / sizeof halves[0]; k++) {
        const bool pause = halves[k] > 64;
        const uint32_t looks = halves[k] / DQW_WATCH_TICK_BLOCKS;
        CASE("%u halves", (unsigned)halves[k]);
        dqw_watch w;
        dqw_watch_init(&w);
        dqw_watch_learned(&w, 10);
        HOLDS(w.learned_at == 10 && w.wait == 0);
        const dqw_stage serves = {.name = DQW_STAGE_IN_SERVICE};
        HOLDS(dqw_watch_why(&w, &serves, 10 + halves[k]) == (pause ? DQW_WHY_PAUSE : DQW_WHY_IN_SERVICE));
        dqw_watch_learned(&w, 10 + halves[k]);
        HOLDS(w.learned_at == 10 + halves[k] && w.wait == (!pause ? 0 : looks < 60 ? looks : 60));
        for (int busy = 0; busy < 2; busy++) {
            dqw_watch_init(&w);
            w.wait = 7;
            w.alarms = (uint16_t)busy;
            dqw_watch_learned(&w, halves[k]);
            HOLDS(w.wait == 7);
        }
    }
}

// Blocks in one direction, with its sign; none where one is missing, and anew where the direction is another.
static void test_stretches_of_one_direction(void)
{
    static const struct {
        int way;
        bool unbroken;
        int length;
    } blocks[] = {{1, true, 1}, {1, true, 2},  {1, true, 3}, {-1, true, 1}, {-1, true, 2}, {0, true, 0},
                  {1, true, 1}, {1, false, 0}, {1, true, 1}, {1, true, 2},  {0, false, 0}, {-1, true, 1}};
    dqw_watch w;
    dqw_watch_init(&w);
    for (unsigned k = 0; k < sizeof blocks / sizeof blocks[0]; k++) {
        CASE("block %u", k);
        HOLDS(dqw_watch_stretch(&w, blocks[k].way, blocks[k].unbroken) == blocks[k].length);
        HOLDS(w.gathered == blocks[k].length * blocks[k].way);
    }
    static const int ways[] = {1, 1, -1, -1, 1, -1};
    static const bool reversed[] = {false, false, true, false, true, true};
    int reversals = 0;
    for (int k = 0; k < 6; k++) {
        w.gathered = 5;
        CASE("stretch %d", k);
        HOLDS(dqw_watch_reversal(&w, ways[k]) == reversed[k]);
        reversals += reversed[k];
        HOLDS(w.reversals == reversals && w.gathered == 0 && w.before == ways[k]);
    }
    w.reversals = DQW_WATCH_REVERSALS_MOST;
    HOLDS(dqw_watch_reversal(&w, 1) && w.reversals == DQW_WATCH_REVERSALS_MOST);
}

// Every sixteenth block is looked at; a rest of sixty looks adopts, a pause waits, an alarm names after 24 looks.
static void test_what_a_look_begins_with(void)
{
    dqw_watch w;
    dqw_watch_init(&w);
    for (int k = 1; k <= 48; k++) HOLDS(dqw_watch_block(&w) == (k % DQW_WATCH_TICK_BLOCKS == 0));
    HOLDS(dqw_watch_begin(&w) == DQW_WATCH_SETTLES);
    dqw_watch_rest(&w);
    for (int k = 0; k < 60; k++) HOLDS(w.resting && dqw_watch_begin(&w) == DQW_WATCH_ADOPTS);
    HOLDS(!w.resting && w.wait == 0 && dqw_watch_begin(&w) == DQW_WATCH_SETTLES);
    w.wait = 3;
    for (int k = 0; k < 3; k++) HOLDS(dqw_watch_begin(&w) == DQW_WATCH_PAUSES);
    HOLDS(dqw_watch_begin(&w) == DQW_WATCH_SETTLES);
    dqw_watch_alarm_residual(&w);
    HOLDS(w.alarms == 1u << DQW_WATCH_RESIDUAL && w.wait == 24 && dqw_watch_begin(&w) == DQW_WATCH_NAMES);
    static const int32_t none[DQW_WATCH_CHANNELS] = {0};
    for (int k = 1; k <= 24; k++) HOLDS(dqw_watch_look(&w, none) == (k == 24));
    dqw_watch_later(&w);
    HOLDS(w.wait == 4);
    // Where something is named already, or waited for, the residual says nothing new.
    for (int busy = 0; busy < 2; busy++) {
        dqw_watch_init(&w);
        if (busy == 0)
            w.alarms = 2;
        else
            w.wait = 9;
        const dqw_watch before = w;
        dqw_watch_alarm_residual(&w);
        HOLDS(w.alarms == before.alarms && w.wait == before.wait);
    }
}

// A sum of five bands times looks beyond the band is an alarm; heat is none while the residual rises.
static void test_what_is_an_alarm(void)
{
    for (int channel = 0; channel < DQW_WATCH_CHANNELS; channel++)
        for (int bands = 1; bands < 6; bands++) {
            dqw_watch w;
            dqw_watch_init(&w);
            int32_t q5[DQW_WATCH_CHANNELS] = {0};
            q5[channel] = bands * DQW_CHANGE_BAND_Q5;
            const int a_look = (bands < 4 ? bands : 4) - 1;
            for (int k = 1; k <= 6; k++) {
                (void)dqw_watch_look(&w, q5);
                CASE("channel %d, %d bands, %d looks", channel, bands, k);
                HOLDS(w.alarms == (a_look * k >= 5 ? 1u << channel : 0u));
                HOLDS(dqw_watch_since(&w, channel) == (a_look > 0 ? k : 0));
                const int settling = channel < DQW_WATCH_TEMPERATURE ? channel : 0;
                w.looks[settling] = DQW_WATCH_LOOKS_LEAST;
                HOLDS((dqw_watch_settle(&w, settling, DQW_WATCH_KNOWN, 0) != 0) ==
                      (channel >= DQW_WATCH_TEMPERATURE || a_look == 0));
            }
            // Of a ripple no segment tells anything.
            const bool apart = channel >= DQW_WATCH_OFFSET && channel <= DQW_WATCH_TEMPERATURE;
            HOLDS(dqw_watch_wants_a_segment(&w) == (w.alarms != 0 && !apart));
        }
    for (int below = 0; below < 2; below++) {
        dqw_watch w;
        dqw_watch_init(&w);
        int32_t q5[DQW_WATCH_CHANNELS] = {0};
        q5[DQW_WATCH_TEMPERATURE] = 4 * DQW_CHANGE_BAND_Q5;
        q5[DQW_WATCH_RESIDUAL] = DQW_CHANGE_BAND_Q5 - below;
        for (int k = 0; k < 5; k++) (void)dqw_watch_look(&w, q5);
        HOLDS((w.alarms >> DQW_WATCH_TEMPERATURE & 1u) == (unsigned)below);
    }
    // That an event waits is no channel.
    dqw_watch w;
    dqw_watch_init(&w);
    w.extended = 6;
    HOLDS(!dqw_watch_wants_a_segment(&w));
}

// The alarm that is furthest off names; where none is beyond its band any more, nothing was, unless the model fails.
static void test_the_worst_alarm(void)
{
    for (int above = 0; above < 2; above++)
        for (int worst = 0; worst < DQW_WATCH_CHANNELS; worst++)
            for (int32_t most = DQW_CHANGE_BAND_Q5 - 1; most <= DQW_CHANGE_BAND_Q5; most++) {
                dqw_watch w;
                dqw_watch_init(&w);
                int32_t q5[DQW_WATCH_CHANNELS];
                for (int i = 0; i < DQW_WATCH_CHANNELS; i++) {
                    // One in three shows more, and is no alarm.
                    q5[i] = i == worst ? most : i % 3 == 0 ? 500 : i;
                    if (i == worst || i % 3 != 0) w.alarms |= (uint16_t)(1u << i);
                    w.change[i].sum_q5 = 9;
                }
                const uint16_t alarms = w.alarms;
                const int found = dqw_watch_worst(&w, q5, above != 0);
                CASE("worst %d at %d", worst, (int)most);
                const bool stands = above != 0 || most >= DQW_CHANGE_BAND_Q5;
                HOLDS(found == (stands ? worst : -1) && w.alarms == (stands ? alarms : 0));
                HOLDS(w.change[3].sum_q5 == (stands ? 9 : 0));
            }
}

static void test_why_nothing_is_watched(void)
{
    for (int k = 0; k < 8; k++) {
        dqw_watch w;
        dqw_watch_init(&w);
        w.resting = (k & 4) != 0;
        w.alarms = (uint16_t)((k & 2) != 0);
        w.wait = (uint8_t)(k & 1);
        dqw_stage stage = {.name = DQW_STAGE_IN_SERVICE, .back = DQW_BACK_THRESHOLD};
        CASE("in service, %d", k);
        HOLDS(dqw_watch_why(&w, &stage, 5) == (k >= 4   ? DQW_WHY_RESTS
                                               : k >= 2 ? DQW_WHY_NAMING
                                               : k == 1 ? DQW_WHY_PAUSE
                                                        : DQW_WHY_IN_SERVICE));
        HOLDS(dqw_watch_why(&w, &stage, 65) == DQW_WHY_PAUSE);
        stage.name = DQW_STAGE_ORDINAL;
        HOLDS(dqw_watch_why(&w, &stage, 5) == DQW_WHYS);
        stage.name = DQW_STAGE_DOMAIN;
        HOLDS(dqw_watch_why(&w, &stage, 5) == DQW_WHY_THRESHOLD);
        stage.back = DQW_BACK_LEFT_BAND;
        HOLDS(dqw_watch_why(&w, &stage, 5) == DQW_WHY_LEFT_BAND);
        stage.back = DQW_BACK_NOT_CONVERGED;
        HOLDS(dqw_watch_why(&w, &stage, 5) == DQW_WHY_NOT_CONVERGED);
    }
}

static void test_what_stands(void)
{
    dqw_watch w;
    dqw_watch_init(&w);
    static const int needed[] = {DQW_WATCH_R, DQW_WATCH_LQ, DQW_WATCH_PSI};
    for (int missing = 0; missing <= 3; missing++) {
        for (int k = 0; k < 3; k++) w.looks[needed[k]] = (uint8_t)(DQW_WATCH_LOOKS_LEAST - (k == missing));
        HOLDS(dqw_watch_stands(&w) == (missing == 3));
    }
    for (int at = 0; at <= 5; at++) {
        int16_t excess_q10[6] = {0, -1, 0, -1024, 0, 0};
        if (at < 5) excess_q10[at] = 1;
        HOLDS(dqw_watch_excited(excess_q10, 5) == (at < 5));
        excess_q10[5] = 1;
        HOLDS(dqw_watch_excited(excess_q10, 5) == (at < 5));
    }
    for (int channel = 0; channel < DQW_WATCH_CHANNELS; channel++)
        for (int more = 0; more < 2; more++)
            HOLDS(dqw_watch_fault_of(channel, more != 0) == (channel == DQW_WATCH_TEMPERATURE
                                                                 ? DQW_FAULT_OVER_TEMPERATURE
                                                             : channel != DQW_WATCH_FRICTION ? DQW_FAULT_NONE
                                                             : more != 0                     ? DQW_FAULT_BEARING_WEAR
                                                                                             : DQW_FAULT_UNKNOWN));
    // Friction settles at once, when there were enough reversals.
    dqw_watch_init(&w);
    for (int k = 0; k <= DQW_WATCH_REVERSALS_MOST; k++) {
        w.reversals = (uint8_t)k;
        HOLDS(dqw_watch_friction_settles(&w));
        HOLDS(w.looks[DQW_WATCH_FRICTION] == (k == DQW_WATCH_REVERSALS_MOST ? DQW_WATCH_LOOKS_MOST : 0));
    }
    HOLDS(!dqw_watch_friction_settles(&w));
}

// A mean of looks that are coarse at first: of the last 63; the first that is known well begins it anew, whatever the
// change by then; of well known ones it is the mean of the next 192 in which nothing shows, and coarse ones count for
// nothing any more.
static void test_a_healthy_value_settles(void)
{
    dqw_watch w;
    dqw_watch_init(&w);
    const int half = DQW_CHANGE_BAND_Q5 / 2;
    HOLDS(dqw_watch_settle(&w, DQW_WATCH_LD, DQW_WATCH_NOT_KNOWN, 0) == 1 && w.looks[DQW_WATCH_LD] == 0);
    for (int k = 1; k < 100; k++) {
        const int looks = k < 63 ? k : 63;
        CASE("coarse look %d", k);
        HOLDS(dqw_watch_settle(&w, DQW_WATCH_LD, DQW_WATCH_NOT_KNOWN, 0) == (k == 1));
        HOLDS(dqw_watch_settle(&w, DQW_WATCH_LD, DQW_WATCH_KNOWN, half + 1) == 0);
        HOLDS(dqw_watch_settle(&w, DQW_WATCH_LD, DQW_WATCH_KNOWN, half) == looks && w.looks[DQW_WATCH_LD] == looks);
    }
    w.change[DQW_WATCH_LD].sum_q5 = 1;
    HOLDS(dqw_watch_settle(&w, DQW_WATCH_LD, DQW_WATCH_KNOWN_WELL, 2 * half) == 1);
    HOLDS(dqw_watch_settle(&w, DQW_WATCH_LD, DQW_WATCH_KNOWN_WELL, 0) == 0);
    w.change[DQW_WATCH_LD].sum_q5 = 0;
    for (int k = 2; k <= 192; k++) {
        CASE("well known look %d", k);
        HOLDS(dqw_watch_settle(&w, DQW_WATCH_LD, DQW_WATCH_NOT_KNOWN, 0) == 0);
        HOLDS(dqw_watch_settle(&w, DQW_WATCH_LD, DQW_WATCH_KNOWN, 0) == 0);
        HOLDS(dqw_watch_settle(&w, DQW_WATCH_LD, DQW_WATCH_KNOWN_WELL, half + 1) == 0);
        HOLDS(dqw_watch_settle(&w, DQW_WATCH_LD, DQW_WATCH_KNOWN_WELL, half) == k);
    }
    HOLDS(w.looks[DQW_WATCH_LD] == DQW_WATCH_LOOKS_MOST);
    HOLDS(dqw_watch_settle(&w, DQW_WATCH_LD, DQW_WATCH_KNOWN_WELL, 0) == 0 && w.looks[DQW_WATCH_R] == 0);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_long_pause_is_the_longest_time);
    RUN_TEST(test_time_without_following_does_not_come_round);
    RUN_TEST(test_too_hot_is_told_again_after_it_was_cool);
    RUN_TEST(test_a_name_that_is_not_sure_waits);
    RUN_TEST(test_friction_is_gathered_anew_after_its_event);
    RUN_TEST(test_adopting_leaves_what_is_timed);
    RUN_TEST(test_pauses);
    RUN_TEST(test_stretches_of_one_direction);
    RUN_TEST(test_what_a_look_begins_with);
    RUN_TEST(test_what_is_an_alarm);
    RUN_TEST(test_the_worst_alarm);
    RUN_TEST(test_a_healthy_value_settles);
    RUN_TEST(test_why_nothing_is_watched);
    RUN_TEST(test_what_stands);
    return UNITY_END();
}
