// A speed's lag beside the angle, of filters in closed form, and what is left of it.
#include <cmath>

#include "ref/log/speed_lag.hpp"
#include "unity.h"

extern "C" void setUp(void) {}
extern "C" void tearDown(void) {}

namespace {

using dqw::Log;

constexpr double kPeriod_s = 1e-4, kLag_s = 1.5e-3;

/// A speed of two sines behind a first-order filter in its steady state, the angle exact but for an encoder's steps.
struct Drive {
    double lag_s = kLag_s, step_rad = 0.0, noise_rad_s = 0.0, angle_late_s = 0.0, sense = 1.0;
    static constexpr double kA[] = {60.0, 20.0}, kW[] = {9.0, 70.0};
    double w(double t) const { return 100.0 + kA[0] * std::sin(kW[0] * t) + kA[1] * std::sin(kW[1] * t); }
    double late(double t) const
    {
        double sum = 100.0;
        for (int n = 0; n < 2; ++n) {
            const double x = kW[n] * lag_s;
            sum += kA[n] * (std::sin(kW[n] * t) - x * std::cos(kW[n] * t)) / (1.0 + x * x);
        }
        return sum;
    }
    double theta(double t) const
    {
        return 100.0 * t - kA[0] / kW[0] * std::cos(kW[0] * t) - kA[1] / kW[1] * std::cos(kW[1] * t);
    }
};

Log log_of(const Drive& drive, std::size_t rows, bool electrical = false)
{
    Log log;
    log.path = "drive", log.dt_s = kPeriod_s;
    if (electrical) log.machine.pole_pairs = 7.0;
    unsigned state = 1;
    const auto noise = [&] {
        state = state * 1664525u + 1013904223u;
        return (static_cast<double>(state >> 8) / 16777216.0 - 0.5) * std::sqrt(12.0);
    };
    for (std::size_t k = 0; k < rows; ++k) {
        const double t = static_cast<double>(k) * kPeriod_s;
        log.t_s.push_back(t);
        for (auto column : {&Log::v_d_V, &Log::v_q_V, &Log::i_d_A, &Log::i_q_A}) (log.*column).push_back(0.0);
        log.w_m_rad_s.push_back(drive.late(t) + drive.noise_rad_s * noise());
        double theta = drive.sense * (electrical ? 7.0 : 1.0) * drive.theta(t - drive.angle_late_s);
        if (drive.step_rad > 0.0) theta = drive.step_rad * std::floor(theta / drive.step_rad);
        (electrical ? log.theta_e_rad : log.theta_m_rad).push_back(std::remainder(theta, 2.0 * M_PI));
    }
    return log;
}

/// RMS of what a speed differs by from the shaft's, behind its begin.
double off_rad_s(const Log& log, const Drive& drive)
{
    double sum = 0.0, count = 0.0;
    for (std::size_t k = 100; k < log.rows(); ++k, ++count) sum += std::pow(log.w_m_rad_s[k] - drive.w(log.t_s[k]), 2);
    return std::sqrt(sum / count);
}

void a_filters_lag_is_found(void)
{
    for (const bool electrical : {false, true}) {
        Drive drive;
        Log log = log_of(drive, 40000, electrical);
        const double lag_s = dqw::speed_lag_s({log});
        TEST_ASSERT_DOUBLE_WITHIN(0.01 * kLag_s, kLag_s, lag_s);
        const double before = off_rad_s(log, drive);
        dqw::SpeedForward(lag_s, log.dt_s).over(log);
        // What is left is of second order: 70 rad/s times half the lag and what its slope is late by.
        TEST_ASSERT_TRUE(off_rad_s(log, drive) < 0.1 * before);
    }
}

void steps_and_noise_hardly_move_it(void)
{
    Drive drive;
    drive.step_rad = 2.0 * M_PI / 2000.0, drive.noise_rad_s = 0.2;
    Log log = log_of(drive, 100000);
    const double lag_s = dqw::speed_lag_s({log}), before = off_rad_s(log, drive);
    TEST_ASSERT_DOUBLE_WITHIN(0.03 * kLag_s, kLag_s, lag_s);
    dqw::SpeedForward(lag_s, log.dt_s).over(log);
    TEST_ASSERT_TRUE(off_rad_s(log, drive) < 0.5 * before);
}

void what_is_no_lag_is_left_alone(void)
{
    Drive none, angle_late, turned, unclear;
    none.lag_s = 0.0, none.step_rad = 2.0 * M_PI / 2000.0, none.noise_rad_s = 0.2;
    angle_late.lag_s = 0.0, angle_late.angle_late_s = kPeriod_s;
    turned.sense = -1.0;
    unclear.lag_s = 3e-4, unclear.step_rad = 2.0 * M_PI / 20.0;
    for (const Drive& drive : {none, angle_late, turned, unclear})
        TEST_ASSERT_EQUAL_DOUBLE(0.0, dqw::speed_lag_s({log_of(drive, 20000)}));
    // Nor is a jump of both, as where rows were lost, or another log goes on.
    Log jumps = log_of(none, 20000);
    for (std::size_t k = 12000; k < jumps.rows(); ++k) jumps.w_m_rad_s[k] = jumps.theta_m_rad[k] = 0.0;
    TEST_ASSERT_EQUAL_DOUBLE(0.0, dqw::speed_lag_s({jumps}));
    // An observer's angle comes from the same loop, and a turn of the rotor needs the pole pairs.
    Log observed = log_of({}, 20000), unknown = log_of({}, 20000, true);
    observed.observed = true, unknown.machine.pole_pairs.reset();
    TEST_ASSERT_EQUAL_DOUBLE(0.0, dqw::speed_lag_s({observed}));
    TEST_ASSERT_EQUAL_DOUBLE(0.0, dqw::speed_lag_s({unknown}));
    TEST_ASSERT_EQUAL_DOUBLE(0.0, dqw::speed_lag_s({}));
    // And no lag changes nothing.
    const std::vector<double> before = observed.w_m_rad_s;
    dqw::SpeedForward(0.0, observed.dt_s).over(observed);
    TEST_ASSERT_TRUE(before == observed.w_m_rad_s);
}

void pieces_are_the_whole(void)
{
    Log whole = log_of({}, 1000);
    whole.segments = {0, 400};
    Log pieces[2];
    for (std::size_t k = 0; k < whole.rows(); ++k) pieces[k < 300 ? 0 : 1].w_m_rad_s.push_back(whole.w_m_rad_s[k]);
    pieces[0].segments = {0}, pieces[1].segments = {100};
    const double first = whole.w_m_rad_s[400];
    dqw::SpeedForward(kLag_s, kPeriod_s).over(whole);
    dqw::SpeedForward forward(kLag_s, kPeriod_s);
    for (Log& piece : pieces) forward.over(piece);
    for (std::size_t k = 0; k < whole.rows(); ++k)
        TEST_ASSERT_TRUE(whole.w_m_rad_s[k] == pieces[k < 300 ? 0 : 1].w_m_rad_s[k < 300 ? k : k - 300]);
    // Nothing goes on over a gap.
    TEST_ASSERT_EQUAL_DOUBLE(first, whole.w_m_rad_s[400]);
}

}  // namespace

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_filters_lag_is_found);
    RUN_TEST(steps_and_noise_hardly_move_it);
    RUN_TEST(what_is_no_lag_is_left_alone);
    RUN_TEST(pieces_are_the_whole);
    return UNITY_END();
}
