// How sure a name is, and what is said where there is none.
#include <cmath>

#include "ref/trace/clue.hpp"
#include "ref/trace/confidence.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

using dqw::Better;
using dqw::confidence_of;
using dqw::Found;

namespace {

/// Far better than nothing, and than each of these.
Found over(std::vector<Better> rivals)
{
    Found f;
    f.name = "delay", f.over = {1e4, 30.0, 100.0};
    for (const Better& b : rivals) f.rivals.push_back({"iron_loss", b});
    return f;
}

void rivals_as_good_share_the_name()
{
    const double alone = confidence_of(over({}), 1.0);
    TEST_ASSERT_TRUE(alone > 0.9 && alone < 1.0);
    // Odds of 1 each.
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, alone / 2.0, confidence_of(over({{0.0, 0.0, 0.0}}), 1.0));
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, alone / 3.0, confidence_of(over({{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}}), 1.0));
    // A normal is above 1.2816 in one of ten: nine to one; the nats are no objection.
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0.9 * alone, confidence_of(over({{1e3, 1.281552, 50.0}}), 1.0));
    // Alike in all blocks, and worth no more than the sampling's own error: t of 14 proves nothing.
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, alone / (1.0 + std::exp(-0.84)), confidence_of(over({{46.0, 13.9, 0.84}}), 1.0));
    // Nor for a rival that is hardly better; one that is by both is.
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, alone / (1.0 + std::exp(0.1)), confidence_of(over({{-7.0, -6.0, -0.1}}), 1.0));
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0.1 * alone, confidence_of(over({{-1e3, -1.281552, -50.0}}), 1.0));
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, alone / 2.0, confidence_of(over({{-2.0, 1.5, -0.3}}), 1.0));
}

void what_is_left_is_against_it()
{
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.6, confidence_of(over({}), 0.6) / confidence_of(over({}), 1.0));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, confidence_of(over({}), -0.2));
    Found weak = over({});
    weak.over = {12.0, 4.2, 0.7};
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, 1.0 / (1.0 + std::exp(-0.7)),
                              confidence_of(weak, 1.0) / confidence_of(over({}), 1.0));
}

void a_residual_without_a_name_has_a_clue()
{
    const std::string three = dqw::clue_of({{"angle, order 3", "q", 0.4}, {"time", "d", 0.1}}, dqw::Regime::dynamic);
    TEST_ASSERT_EQUAL_STRING(
        "what remains goes with three times the electrical angle (axis q, 40 % of it), time (axis d, "
        "10 % of it); what does that is most often an inverter of which the lowest or highest leg "
        "rests",
        three.c_str());
    // A tenth of it is no cause.
    TEST_ASSERT_EQUAL_STRING("what remains goes with time (axis d, 10 % of it)",
                             dqw::clue_of({{"time", "d", 0.1}}, dqw::Regime::dynamic).c_str());
    TEST_ASSERT_TRUE(dqw::clue_of({{"a line at 37 Hz", "torque", 0.9}}, dqw::Regime::mechanical).find("resonates") !=
                     std::string::npos);
    // Of a shaft's angle none of the motor's meanings is told.
    TEST_ASSERT_EQUAL_STRING("what remains goes with angle, order 6 (axis torque, 90 % of it)",
                             dqw::clue_of({{"angle, order 6", "torque", 0.9}}, dqw::Regime::mechanical).c_str());
    TEST_ASSERT_EQUAL_STRING("what remains goes with nothing that was tested",
                             dqw::clue_of({}, dqw::Regime::steady).c_str());
}

}  // namespace

int main()
{
    UNITY_BEGIN();
    RUN_TEST(rivals_as_good_share_the_name);
    RUN_TEST(what_is_left_is_against_it);
    RUN_TEST(a_residual_without_a_name_has_a_clue);
    return UNITY_END();
}
