// The rules of a trace's verdict, each at its edge.
#include "ref/trace/rules.hpp"

#include <cmath>

#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

using dqw::Finding;
using dqw::Rest;

static void effects_are_named_where_they_explain(void)
{
    const struct {
        const char* what;
        Finding f;
        bool named;
    } table[] = {
        {"all of it", {1.0, 0.1, 0.1, false, false, false}, true},
        {"all of it, by what is exact", {1.0, 0.5, 0.1, false, true, false}, true},
        {"a little above the noise", {1.0, 0.129, 0.1, false, false, false}, true},
        {"half of it, nearly", {1.0, 0.715, 0.1, false, false, false}, false},
        {"half of it, just", {1.0, 0.70, 0.1, false, false, false}, true},
        {"nothing, all of it noise", {0.1, 0.1, 0.1, false, false, false}, true},
        {"less than nothing", {1.0, 1.021, 1.0, false, false, false}, false},
        {"as good as nothing", {1.0, 1.019, 1.0, false, false, false}, true},
        {"a residual that was the sampling's own", {1.0, 0.1, 0.1, true, false, false}, false},
        {"a fault of the record", {1.0, 0.1, 0.1, false, false, true}, false},
    };
    for (const auto& row : table) TEST_ASSERT_EQUAL_INT_MESSAGE(row.named, dqw::explains(row.f), row.what);
}

static void one_of_several_takes_more_than_what_has_no_name(void)
{
    const struct {
        const char* what;
        Finding f;
        double without;
        bool named;
    } table[] = {
        {"as much as what stays, and a little", {1.0, 0.30, 0.1, false, false, false}, 0.413, true},
        {"a little less than what stays", {1.0, 0.30, 0.1, false, false, false}, 0.412, false},
        {"little, but what stays is noise", {1.0, 0.129, 0.1, false, false, false}, 0.131, true},
        {"little, but what stays is the sampling's own", {1.0, 0.30, 0.1, false, true, false}, 0.31, true},
        {"nothing", {1.0, 0.30, 0.1, false, false, false}, 0.30, false},
    };
    for (const auto& row : table)
        TEST_ASSERT_EQUAL_INT_MESSAGE(row.named, dqw::carries(row.f, row.f.after, row.without), row.what);
    // Others are gone already: what they took is not what stays.
    const Finding all{1.0, 0.30, 0.1, false, false, false};
    TEST_ASSERT_TRUE(dqw::carries(all, 0.40, 0.491));
    TEST_ASSERT_FALSE(dqw::carries(all, 0.40, 0.489));
}

static void what_looks_like_another_and_leaves_noise_is_idle(void)
{
    TEST_ASSERT_TRUE(dqw::is_idle(0.129, 0.1, 1));
    TEST_ASSERT_FALSE(dqw::is_idle(0.131, 0.1, 1));
    TEST_ASSERT_FALSE(dqw::is_idle(0.05, 0.1, 0));
}

static void what_takes_most_is_named_by_a_wide_value_but_not_by_any(void)
{
    const Finding f{1.0, 0.5, 0.1, false, false, false};
    TEST_ASSERT_TRUE(dqw::carries_most(f, 0.87, 0.51));
    TEST_ASSERT_FALSE(dqw::carries_most(f, 0.86, HUGE_VAL));
    TEST_ASSERT_FALSE(dqw::carries_most(f, 0.87, 0.49));
    TEST_ASSERT_TRUE(dqw::carries_most({0.131, 0.1, 0.1, false, false, false}, 0.131, 1.0));
    TEST_ASSERT_FALSE(dqw::carries_most({0.129, 0.1, 0.1, false, false, false}, 0.129, 1.0));
}

static void what_leaves_noise_alone_is_named_whatever_its_deviation(void)
{
    const Finding noise{1.0, 0.129, 0.1, false, false, false}, rest{1.0, 0.131, 0.1, false, false, false};
    TEST_ASSERT_TRUE(dqw::carries_all(noise, 0.5));
    TEST_ASSERT_FALSE(dqw::carries_all(rest, 0.5));
    TEST_ASSERT_TRUE(dqw::carries_all({1.0, 0.131, 0.1, false, true, false}, 0.5));
    TEST_ASSERT_TRUE(dqw::carries_all({1.0, 0.1, 0.1, false, false, false}, 0.201));
    TEST_ASSERT_FALSE(dqw::carries_all({1.0, 0.1, 0.1, false, false, false}, 0.199));
    TEST_ASSERT_FALSE(dqw::carries_all(noise, 0.21));
}

static void what_leaves_next_to_nothing_completes(void)
{
    // 0.9 of what is above a floor of 0.1 is gone at sqrt(0.01 + 0.1 * 0.03) = 0.1140.
    TEST_ASSERT_TRUE(dqw::completes(0.2, 0.1139, 0.1));
    TEST_ASSERT_FALSE(dqw::completes(0.2, 0.1141, 0.1));
    TEST_ASSERT_TRUE(dqw::completes(0.131, 0.1, 0.1));
    TEST_ASSERT_FALSE(dqw::completes(0.129, 0.1, 0.1));
}

static void another_frame_is_better_or_plainer_and_needs_no_effect_more(void)
{
    const struct {
        const char* what;
        double t;
        std::size_t here, there;
        bool noise, stands;
    } table[] = {
        {"better", 3.1, 1, 1, true, true},
        {"no better", 2.9, 1, 1, true, false},
        {"plainer", -2.9, 2, 1, true, true},
        {"plainer and worse", -3.1, 2, 1, true, false},
        {"better by an effect more, where noise is left", 9.0, 1, 2, true, false},
        {"better by an effect more, where more is left", 3.1, 1, 2, false, true},
    };
    for (const auto& row : table)
        TEST_ASSERT_EQUAL_INT_MESSAGE(row.stands, dqw::turns_with_rotor(row.t, row.here, row.there, row.noise),
                                      row.what);
}

static void what_is_left_is_structured_or_noise(void)
{
    const struct {
        const char* what;
        Rest rest;
        bool structured;
    } table[] = {
        {"noise", {{1.0, 0.129, 0.1, false, false, false}, true, false}, false},
        {"more than noise", {{1.0, 0.131, 0.1, false, false, false}, true, false}, true},
        {"more than noise, but exact", {{1.0, 0.131, 0.1, false, true, false}, true, false}, false},
        {"a fault", {{1.0, 0.1, 0.1, false, true, true}, false, false}, true},
        {"effects taken back, a floor that contains the model's error",
         {{1.0, 1.0, 1.31, false, false, false}, false, true},
         true},
        {"effects taken back, a floor that does not", {{1.0, 1.0, 1.29, false, false, false}, false, true}, false},
        {"such a floor, and effects named", {{1.0, 1.0, 1.31, false, false, false}, true, false}, false},
        {"such a floor, and nothing ever found", {{1.0, 1.0, 1.31, false, false, false}, false, false}, false},
    };
    for (const auto& row : table) TEST_ASSERT_EQUAL_INT_MESSAGE(row.structured, dqw::is_structured(row.rest), row.what);
}

static void rows_of_the_record_are_held_against_all_that_was_found(void)
{
    // A shift of up to a row has a name, and stands as one whatever was found beside it.
    for (const int rows : {-1, 0, 1}) TEST_ASSERT_EQUAL_size_t(1, dqw::against_reading(3, true, rows));
    for (const int rows : {-3, -2, 2, 3}) TEST_ASSERT_EQUAL_size_t(3, dqw::against_reading(3, true, rows));
    TEST_ASSERT_EQUAL_size_t(3, dqw::against_reading(3, false, 1));
    // What that makes of a reading that leaves as much as they do.
    const dqw::Finding is{1.0, 0.1, 0.1, false, false, false};
    TEST_ASSERT_TRUE(dqw::reads_better(is, 0.1, dqw::against_reading(2, true, 2)));
    TEST_ASSERT_FALSE(dqw::reads_better(is, 0.1, dqw::against_reading(2, true, 1)));
}

static void nothing_above_the_noise_is_explained_whole(void)
{
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, dqw::share_of(1.0, 0.5, 0.1), dqw::part_of_rest(1.0, 0.5, 0.1));
    TEST_ASSERT_TRUE(dqw::part_of_rest(1.0, 0.5, 0.1) < 0.8);
    TEST_ASSERT_EQUAL_DOUBLE(1.0, dqw::part_of_rest(0.09, 0.05, 0.1));
}

static void verdicts_are_four(void)
{
    const char* const words[] = {"clean",     "unexplained", "unexplained",      "unexplained",
                                 "explained", "explained",   "partly_explained", "partly_explained"};
    for (int i = 0; i < 8; i++)
        TEST_ASSERT_EQUAL_STRING(words[i], dqw::verdict_of((i & 4) != 0, (i & 2) != 0, (i & 1) != 0).c_str());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(effects_are_named_where_they_explain);
    RUN_TEST(one_of_several_takes_more_than_what_has_no_name);
    RUN_TEST(what_looks_like_another_and_leaves_noise_is_idle);
    RUN_TEST(what_takes_most_is_named_by_a_wide_value_but_not_by_any);
    RUN_TEST(what_leaves_noise_alone_is_named_whatever_its_deviation);
    RUN_TEST(what_leaves_next_to_nothing_completes);
    RUN_TEST(another_frame_is_better_or_plainer_and_needs_no_effect_more);
    RUN_TEST(what_is_left_is_structured_or_noise);
    RUN_TEST(rows_of_the_record_are_held_against_all_that_was_found);
    RUN_TEST(nothing_above_the_noise_is_explained_whole);
    RUN_TEST(verdicts_are_four);
    return UNITY_END();
}
