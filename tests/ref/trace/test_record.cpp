// Faults of a record itself, in the simulator's logs.
// Plain only: long, and what it runs others run under the sanitizers.
#include <cmath>
#include <cstdlib>
#include <string>

#include "ref/trace/rest.hpp"
#include "ref/trace/trace.hpp"
#include "simulated.hpp"
#include "unity.h"

extern "C" void setUp(void) {}
extern "C" void tearDown(void) {}

namespace {

std::string fault_of(const char* scenario, std::vector<std::string> settings)
{
    settings.insert(settings.end(), {"seed=90212"});
    return dqw::record_fault({simulated(scenario, settings)});
}

/// Where the encoder stands for a period, a coarse converter's currents repeat by chance; a row that was dropped
/// repeats them while it turns. The steps of a frame that turns are no converter's.
void currents_that_repeat_by_chance_are_no_fault()
{
    for (const char* scenario : {"drive_clamped_joint", "drive_compensated_hub", "drive_clamped_fast"}) {
        TEST_ASSERT_EQUAL_STRING_MESSAGE("", fault_of(scenario, {}).c_str(), scenario);
        const dqw_sim_scenario s = dqw::scenario_named(scenario);
        const std::string fault = fault_of(scenario, {"nonideal.dropped_fraction=0.002"});
        TEST_ASSERT_TRUE_MESSAGE(fault.find("held or dropped") != std::string::npos, scenario);
        // Of N rows pN +- sqrt(pN), less those that are dropped while the current hardly moves.
        const double dropped = 0.002 * s.duration_s / s.drive.dt_s;
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(3.0 * std::sqrt(dropped), dropped, std::strtod(fault.c_str(), nullptr),
                                          scenario);
    }
}

/// Each of its samples stands as long: no chance, and no few of them.
void samples_that_stand_in_rows_are_a_fault()
{
    const dqw::Log whole = simulated("servo", {"duration_s=0.2", "noise=0.01", "seed=90213"});
    for (const std::size_t each : {2u, 3u, 10u, 16u}) {
        dqw::Log log = whole;
        for (std::size_t k = 0; k < log.rows(); ++k)
            log.i_d_A[k] = whole.i_d_A[k - k % each], log.i_q_A[k] = whole.i_q_A[k - k % each];
        const std::string wanted = "the currents of each sample stand in " + std::to_string(each) + " rows";
        TEST_ASSERT_EQUAL_STRING_LEN(wanted.c_str(), dqw::record_fault({log}).c_str(), wanted.size());
        const dqw::TraceResult r = dqw::trace({log});
        TEST_ASSERT_EQUAL_STRING("unexplained", r.verdict.c_str());
        TEST_ASSERT_TRUE(r.effects.empty() && r.rest_signature.find(wanted) == 0);
    }
    TEST_ASSERT_EQUAL_STRING("", dqw::record_fault({whole}).c_str());
    // Of a coarse converter, on which samples often are the same: held in threes, and not.
    for (const std::size_t each : {1u, 3u}) {
        dqw::Log log = whole;
        for (std::size_t k = 0; k < log.rows(); ++k)
            log.i_d_A[k] = std::round(whole.i_d_A[k - k % each]), log.i_q_A[k] = std::round(whole.i_q_A[k - k % each]);
        const std::string fault = dqw::record_fault({whole, log});
        TEST_ASSERT_EQUAL_INT(each > 1, fault.find("the currents of each sample stand in 3 rows") != std::string::npos);
        TEST_ASSERT_EQUAL_INT(each > 1, !fault.empty());
    }
}

/// What the columns make no sense of is said beside the record's fault.
void a_fault_hides_no_turned_columns()
{
    dqw::Log log = simulated("servo", {"duration_s=0.3", "noise=0.01", "seed=90214"});
    std::swap(log.i_d_A, log.i_q_A);
    for (std::size_t k = 100; k < log.rows(); k += 100)
        log.i_d_A[k] = log.i_d_A[k - 1], log.i_q_A[k] = log.i_q_A[k - 1];
    const dqw::TraceResult r = dqw::trace({log});
    TEST_ASSERT_EQUAL_STRING("unexplained", r.verdict.c_str());
    TEST_ASSERT_TRUE(r.rest_signature.find("held or dropped samples; ") != std::string::npos);
    TEST_ASSERT_TRUE(r.rest_signature.find("columns") != std::string::npos);
}

}  // namespace

int main()
{
    UNITY_BEGIN();
    RUN_TEST(currents_that_repeat_by_chance_are_no_fault);
    RUN_TEST(samples_that_stand_in_rows_are_a_fault);
    RUN_TEST(a_fault_hides_no_turned_columns);
    return UNITY_END();
}
