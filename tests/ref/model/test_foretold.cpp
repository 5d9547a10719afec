// What of single rows the rows before foretell: nothing of noise, of what follows from the voltage all of it.
#include <cmath>
#include <random>

#include "ref/model/foretold.hpp"
#include "unity.h"

extern "C" void setUp(void) {}
extern "C" void tearDown(void) {}

namespace {

/// Rows whose voltage is white, of 1 V; the residual is white noise of 0.1 V of the voltage, another of a current at
/// both of a row's ends, and `late` of the voltage's last step.
dqw::Foretold::Part part_of(double late, std::size_t apart)
{
    std::mt19937_64 bits(5);
    std::normal_distribution<double> normal;
    const dqw::Log log;
    dqw::RowsBefore rows;
    dqw::Foretold foretold;
    dqw::Foretelling line;
    double before = 0.0, last = 0.0, current[2] = {};
    for (std::size_t k = 0; k < 20000; ++k) {
        // A gap before every row so far apart.
        const std::size_t at = apart > 0 ? k + k / apart : k;
        dqw::ReportBlock b{&log, at, at + 1, {}, {}};
        const double v = normal(bits);
        for (int c : {0, 1}) {
            const double i = 0.1 * normal(bits);
            b.measured[c] = c == 0 ? v : -v;
            b.residual[c] = 0.1 * normal(bits) + i - current[c] + (c == 0 ? late * (last - before) : 0.0);
            current[c] = i;
        }
        before = last, last = v;
        if (rows.add(b, line)) foretold.add(line, b);
    }
    return foretold.solve();
}

void noise_is_not_foretold()
{
    const dqw::Foretold::Part found = part_of(0.0, 0);
    for (int c : {0, 1}) {
        TEST_ASSERT_DOUBLE_WITHIN(0.007, 0.0, found.part[c]);
        // 0.1 V once, and twice the current's.
        TEST_ASSERT_DOUBLE_WITHIN(0.0015, 0.03, found.square[c]);
    }
}

void what_is_late_is_foretold()
{
    for (double late : {0.05, 0.2, 1.0}) {
        const dqw::Foretold::Part found = part_of(late, 0);
        const double power = 2.0 * late * late;
        TEST_ASSERT_DOUBLE_WITHIN(0.02, power / (power + 0.03), found.part[0]);
        TEST_ASSERT_DOUBLE_WITHIN(0.007, 0.0, found.part[1]);
        TEST_ASSERT_DOUBLE_WITHIN(0.05 * (power + 0.03), power + 0.03, found.square[0]);
    }
}

void a_gap_ends_what_is_known()
{
    TEST_ASSERT_DOUBLE_WITHIN(0.03, 0.08 / 0.11, part_of(0.2, 100).part[0]);
    // Of pieces of 24 rows none has enough before it.
    TEST_ASSERT_EQUAL_DOUBLE(0.0, part_of(0.2, 24).square[0]);
}

}  // namespace

int main()
{
    UNITY_BEGIN();
    RUN_TEST(noise_is_not_foretold);
    RUN_TEST(what_is_late_is_foretold);
    RUN_TEST(a_gap_ends_what_is_known);
    return UNITY_END();
}
