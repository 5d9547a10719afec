// Laws of an inverter's loss against quadrature, resting legs and the hexagon against cases made by hand.
#include <cmath>

#include "ref/effect/inverter.hpp"
#include "ref/trace/hexagon.hpp"
#include "unity.h"

using namespace dqw;

void setUp() {}
void tearDown() {}

namespace {

double midpoints(LossLaw law, double x, double y)
{
    constexpr int kPoints = 20000;
    double sum = 0.0;
    for (int n = 0; n < kPoints; ++n) sum += LossAt(law, x + (y - x) * (n + 0.5) / kPoints).value;
    return sum / kPoints;
}

void a_mean_is_that_of_its_points()
{
    for (const LossLaw law : kLossLaws)
        for (const double from : {-2.3, -0.4, 0.0, 0.7, 1.9})
            for (const double to : {-1.2, 0.3, 1.6, 4.0}) {
                TEST_ASSERT_DOUBLE_WITHIN(1e-6, midpoints(law, from, to), MeanLoss(law, from, 0.0, to).mean);
                const double d = 1e-5,
                             by = (MeanLoss(law, from, 0.1, to + d).mean - MeanLoss(law, from, 0.1, to - d).mean) /
                                  (2 * d);
                TEST_ASSERT_DOUBLE_WITHIN(1e-5, by, MeanLoss(law, from, 0.1, to).by_end);
            }
}

void a_law_is_odd_and_ends_at_one()
{
    for (const LossLaw law : kLossLaws) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0, LossAt(law, 0.0).value);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, -LossAt(law, 0.8).value, LossAt(law, -0.8).value);
        TEST_ASSERT_DOUBLE_WITHIN(1e-3, 1.0, LossAt(law, 1e3).value);
        TEST_ASSERT_DOUBLE_WITHIN(2e-3, 4.0 / M_PI, first_harmonic(law, 1e4));
    }
}

void the_leg_that_rests()
{
    const double v[3] = {3.0, -5.0, 2.0}, other[3] = {-1.0, 4.0, -3.0};
    TEST_ASSERT_EQUAL_INT(-1, resting_leg(Modulation::centred, v));
    TEST_ASSERT_EQUAL_INT(1, resting_leg(Modulation::clamped_low, v));
    TEST_ASSERT_EQUAL_INT(0, resting_leg(Modulation::clamped_high, v));
    TEST_ASSERT_EQUAL_INT(1, resting_leg(Modulation::clamped_60, v));
    TEST_ASSERT_EQUAL_INT(2, resting_leg(Modulation::clamped_low, other));
    TEST_ASSERT_EQUAL_INT(1, resting_leg(Modulation::clamped_60, other));
}

/// Along a phase the hexagon ends at 2/3 of the link, between two at 1/sqrt 3.
void rows_beyond_the_hexagon_are_marked()
{
    Log log;
    log.dt_s = 1e-4;
    log.v_d_V = {31.0, 34.0, 27.0, 29.0}, log.v_q_V = log.w_m_rad_s = {0, 0, 0, 0};
    log.theta_e_rad = {0, 0, M_PI / 6, M_PI / 6}, log.v_dc_V = {48, 48, 48, 48};
    TraceColumns columns;
    for (const double angle : log.theta_e_rad)
        columns.cos_e.push_back(std::cos(angle)), columns.sin_e.push_back(std::sin(angle));
    const std::vector<char> beyond = beyond_hexagon(log, columns, 4.0);
    const std::vector<char> expected = {0, 1, 0, 1};
    TEST_ASSERT_TRUE(expected == beyond);
    std::vector<Log> logs{log};
    const std::vector<Piece> pieces = without_marked({{logs.data(), 0, 4, 1e-4}}, logs, {beyond}, 1);
    TEST_ASSERT_EQUAL_size_t(2, pieces.size());
    TEST_ASSERT_EQUAL_size_t(2, pieces[1].begin);
    log.v_dc_V.clear();
    TEST_ASSERT_TRUE(beyond_hexagon(log, columns, 4.0).empty());
}

}  // namespace

int main()
{
    UNITY_BEGIN();
    RUN_TEST(a_mean_is_that_of_its_points);
    RUN_TEST(a_law_is_odd_and_ends_at_one);
    RUN_TEST(the_leg_that_rests);
    RUN_TEST(rows_beyond_the_hexagon_are_marked);
    return UNITY_END();
}
