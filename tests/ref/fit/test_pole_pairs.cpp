// Pole pairs that a fit finds: a whole number, none, and what falls with them.
#include "ref/fit/pole_pairs.hpp"

#include <algorithm>
#include <string>

#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

namespace {

dqw::Assessment found(double value, double sd)
{
    dqw::Assessment a;
    a.value = value, a.sd = sd, a.verdict = dqw::Verdict::determined;
    return a;
}

/// What is still asked for once pole pairs of that value and deviation are reported.
std::string left_of(double value, double sd, dqw::Result& result)
{
    const std::vector<dqw::Log> logs(1);
    dqw::Task task{logs, {"R_ohm", "Ld_H", "Lq_H", "psi_Wb", "pole_pairs"}, {}, {}, {}};
    dqw::report_pole_pairs(task, dqw::decide_pole_pairs(found(value, sd)), 0.4, 0.01, result);
    std::string out;
    for (const std::string& name : task.asked) out += name + " ";
    return out;
}

void a_whole_number_stands_out()
{
    dqw::Result result;
    TEST_ASSERT_EQUAL_STRING("R_ohm Ld_H Lq_H psi_Wb pole_pairs ", left_of(4.02, 0.01, result).c_str());
    TEST_ASSERT_EQUAL_size_t(1, result.parameters.size());
    TEST_ASSERT_EQUAL_DOUBLE(4.0, result.parameters[0].value);
}

void a_part_of_a_pole_pair_takes_what_turns_with_it()
{
    dqw::Result result;
    TEST_ASSERT_EQUAL_STRING("R_ohm pole_pairs ", left_of(3.4, 0.05, result).c_str());
    TEST_ASSERT_EQUAL_size_t(0, result.parameters.size());
    TEST_ASSERT_EQUAL_size_t(4, result.not_identifiable.size());
    TEST_ASSERT_EQUAL_STRING("pole_pairs", result.not_identifiable[0].name.c_str());
    TEST_ASSERT_EQUAL_STRING("Ld_H", result.not_identifiable[1].name.c_str());
    TEST_ASSERT_TRUE(result.not_identifiable[1].why.find("3.4, 8 deviations from a whole number") != std::string::npos);
}

void an_uncertain_number_alone_keeps_the_inductances()
{
    dqw::Result result;
    // 3.4 with a deviation of 0.2: 3 and 4 both may be.
    TEST_ASSERT_EQUAL_STRING("R_ohm Ld_H Lq_H psi_Wb pole_pairs ", left_of(3.4, 0.2, result).c_str());
    dqw::Result vague;
    TEST_ASSERT_EQUAL_STRING("R_ohm Ld_H Lq_H pole_pairs ", left_of(3.4, 0.5, vague).c_str());
    TEST_ASSERT_EQUAL_size_t(2, vague.not_identifiable.size());
}

}  // namespace

int main()
{
    UNITY_BEGIN();
    RUN_TEST(a_whole_number_stands_out);
    RUN_TEST(a_part_of_a_pole_pair_takes_what_turns_with_it);
    RUN_TEST(an_uncertain_number_alone_keeps_the_inductances);
    return UNITY_END();
}
