// Steady and standstill logs against closed forms.
// Plain only: long, and what it runs others run under the sanitizers.
#include <Eigen/Dense>
#include <cstdio>
#include <stdexcept>

#include "ref/fit/fit.hpp"
#include "ref/machine.hpp"
#include "unity.h"

extern "C" void setUp(void) {}
extern "C" void tearDown(void) {}

using machine::missing;
using machine::sd;
using machine::value;

namespace {

struct Grid {
    std::vector<double> i_d_A{-4, -2, 0, 2}, i_q_A{-6, -3, 0, 3, 6}, w_m_rad_s{50, 150, 300};
};

/// v_d = R i_d - p w Lq i_q, v_q = R i_q + p w (Ld i_d + psi) on every point of a grid.
dqw::Log steady(const Grid& grid, const machine::Plant& m = {})
{
    dqw::Log log;
    log.path = "steady.csv";
    log.regime = dqw::Regime::steady;
    for (double w : grid.w_m_rad_s)
        for (double i_d : grid.i_d_A)
            for (double i_q : grid.i_q_A) {
                log.i_d_A.push_back(i_d), log.i_q_A.push_back(i_q), log.w_m_rad_s.push_back(w);
                log.v_d_V.push_back(m.R_ohm * i_d - m.p * w * m.Lq_H * i_q);
                log.v_q_V.push_back(m.R_ohm * i_q + m.p * w * (m.Ld_H * i_d + m.psi_Wb));
            }
    return log;
}

void steady_grid_without_noise(void)
{
    dqw::Log log = steady({});
    log.machine.pole_pairs = 4;
    const dqw::Result result = dqw::fit({log});
    TEST_ASSERT_DOUBLE_WITHIN(5e-10, 0.5, value(result, "R_ohm"));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.0e-3, value(result, "Ld_H"));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.4e-3, value(result, "Lq_H"));
    TEST_ASSERT_DOUBLE_WITHIN(2e-11, 0.02, value(result, "psi_Wb"));
    TEST_ASSERT_TRUE(result.residual_rms < 1e-9);
    TEST_ASSERT_TRUE(result.not_identifiable.empty());
}

/// With white noise on the voltages the standard deviations are those of textbook least squares, weights being equal.
void steady_standard_deviations(void)
{
    const dqw::Log clean = steady({});
    const double sigma[2] = {0.05, 0.2};
    Eigen::Matrix4d inner = Eigen::Matrix4d::Zero(), middle = inner;
    for (std::size_t k = 0; k < clean.rows(); ++k) {
        const double w = 4 * clean.w_m_rad_s[k];
        const Eigen::Vector4d x[2] = {{clean.i_d_A[k], 0, -w * clean.i_q_A[k], 0},
                                      {clean.i_q_A[k], w * clean.i_d_A[k], 0, w}};
        for (int c = 0; c < 2; ++c) {
            inner += x[c] * x[c].transpose();
            middle += sigma[c] * sigma[c] * x[c] * x[c].transpose();
        }
    }
    const Eigen::Vector4d theory = (inner.inverse() * middle * inner.inverse()).diagonal().cwiseSqrt();
    const char* const names[] = {"R_ohm", "Ld_H", "Lq_H", "psi_Wb"};
    const double truth[] = {0.5, 1.0e-3, 1.4e-3, 0.02};
    constexpr int kSeeds = 40;
    double mean_sd[4] = {}, squares = 0.0;
    for (unsigned seed = 0; seed < kSeeds; ++seed) {
        dqw::Log log = clean;
        log.machine.pole_pairs = 4;
        std::mt19937_64 random(seed);
        std::normal_distribution<double> draw;
        for (double& v : log.v_d_V) v += sigma[0] * draw(random);
        for (double& v : log.v_q_V) v += sigma[1] * draw(random);
        const dqw::Result result = dqw::fit({log});
        for (int j = 0; j < 4; ++j) {
            mean_sd[j] += sd(result, names[j]) / kSeeds;
            squares += std::pow((value(result, names[j]) - truth[j]) / sd(result, names[j]), 2);
        }
    }
    for (int j = 0; j < 4; ++j) TEST_ASSERT_DOUBLE_WITHIN(0.15 * theory[j], theory[j], mean_sd[j]);
    TEST_ASSERT_DOUBLE_WITHIN(0.4, 1.0, squares / (4 * kSeeds));
}

void steady_without_pole_pairs(void)
{
    const dqw::Result result = dqw::fit({steady({})});
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.5, value(result, "R_ohm"));
    for (const char* name : {"Ld_H", "Lq_H", "psi_Wb", "pole_pairs"}) {
        TEST_ASSERT_NOT_NULL(missing(result, name));
        TEST_ASSERT_FALSE(machine::has(result, name));
        TEST_ASSERT_FALSE(missing(result, name)->excitation.empty());
    }
    TEST_ASSERT_TRUE(missing(result, "Ld_H")->why.find("pole_pairs * Ld_H = 0.004") != std::string::npos);
    TEST_ASSERT_TRUE(result.residual_rms < 1e-9);
}

/// One speed and one i_d: w Ld i_d and w psi are one column.
void steady_at_one_speed_and_one_i_d(void)
{
    Grid grid;
    grid.w_m_rad_s = {200};
    grid.i_d_A = {-3};
    dqw::Log log = steady(grid);
    log.machine.pole_pairs = 4;
    const dqw::Result result = dqw::fit({log});
    for (const char* name : {"Ld_H", "psi_Wb"}) {
        TEST_ASSERT_NOT_NULL(missing(result, name));
        TEST_ASSERT_FALSE(machine::has(result, name));
    }
    TEST_ASSERT_TRUE(missing(result, "Ld_H")->why.find("psi_Wb") != std::string::npos);
    TEST_ASSERT_DOUBLE_WITHIN(1e-8, 0.5, value(result, "R_ohm"));
    TEST_ASSERT_DOUBLE_WITHIN(1e-11, 1.4e-3, value(result, "Lq_H"));
    TEST_ASSERT_TRUE(result.residual_rms < 1e-8);
}

void steady_without_i_d(void)
{
    Grid grid;
    grid.i_d_A = {0};
    dqw::Log log = steady(grid);
    log.machine.pole_pairs = 4;
    const dqw::Result result = dqw::fit({log});
    TEST_ASSERT_NOT_NULL(missing(result, "Ld_H"));
    TEST_ASSERT_TRUE(missing(result, "Ld_H")->why.find("0 A RMS") != std::string::npos);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.02, value(result, "psi_Wb"));
    TEST_ASSERT_EQUAL_size_t(1, result.not_identifiable.size());
}

void steady_at_rest_and_of_zeros(void)
{
    Grid grid;
    grid.w_m_rad_s = {0};
    dqw::Log log = steady(grid);
    log.machine.pole_pairs = 4;
    const dqw::Result rest = dqw::fit({log});
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.5, value(rest, "R_ohm"));
    TEST_ASSERT_EQUAL_size_t(3, rest.not_identifiable.size());
    grid.i_d_A = grid.i_q_A = {0, 0, 0};
    dqw::Log zeros = steady(grid);
    zeros.machine.pole_pairs = 4;
    const dqw::Result nothing = dqw::fit({zeros});
    TEST_ASSERT_EQUAL_size_t(4, nothing.not_identifiable.size());
    TEST_ASSERT_EQUAL_size_t(1, nothing.parameters.size());
    TEST_ASSERT_EQUAL_DOUBLE(0.0, nothing.residual_rms);
}

dqw::Log standstill(std::size_t rows, double R_ohm, double i_d_A, double i_q_A)
{
    dqw::Log log;
    log.path = "standstill.csv";
    log.regime = dqw::Regime::standstill;
    for (std::size_t k = 0; k < rows; ++k) {
        const double share = 2.0 * static_cast<double>(k) / static_cast<double>(rows - 1) - 1.0;
        log.i_d_A.push_back(i_d_A * share), log.i_q_A.push_back(i_q_A * share);
        log.v_d_V.push_back(R_ohm * i_d_A * share), log.v_q_V.push_back(R_ohm * i_q_A * share);
    }
    return log;
}

void standstill_resistance(void)
{
    const dqw::Result both = dqw::fit({standstill(30, 1.1, 4, 2)});
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.1, value(both, "R_ohm"));
    TEST_ASSERT_EQUAL_size_t(1, both.parameters.size());
    TEST_ASSERT_TRUE(both.not_identifiable.empty());
    dqw::Log one = standstill(30, 1.1, 0, 2);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.1, value(dqw::fit({one}), "R_ohm"));
    one.i_d_A.clear(), one.v_d_V.clear();
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.1, value(dqw::fit({one}), "R_ohm"));
    const dqw::Result none = dqw::fit({standstill(30, 1.1, 0, 0)});
    TEST_ASSERT_NOT_NULL(missing(none, "R_ohm"));
    TEST_ASSERT_TRUE(none.parameters.empty());
    dqw::FitOptions options;
    options.parameters = {"R_ohm", "Ld_H"};
    TEST_ASSERT_NOT_NULL(missing(dqw::fit({standstill(30, 1.1, 4, 2)}, options), "Ld_H"));
}

/// A structured residual (an inverter's voltage) must widen the standard deviation beyond that of white noise.
void standstill_structured_residual(void)
{
    dqw::Log log = standstill(400, 1.1, 4, 0);
    for (std::size_t k = 0; k < log.rows(); ++k) log.v_d_V[k] += 1.5 * std::tanh(log.i_d_A[k] / 0.3);
    const dqw::Result result = dqw::fit({log});
    double xx = 0.0, xy = 0.0, ee = 0.0;
    for (std::size_t k = 0; k < log.rows(); ++k) xx += log.i_d_A[k] * log.i_d_A[k], xy += log.i_d_A[k] * log.v_d_V[k];
    for (std::size_t k = 0; k < log.rows(); ++k) ee += std::pow(log.v_d_V[k] - xy / xx * log.i_d_A[k], 2);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, xy / xx, value(result, "R_ohm"));
    std::printf("structured: sd %.2f times that of white noise\n", sd(result, "R_ohm") / std::sqrt(ee / 400 / xx));
    TEST_ASSERT_TRUE(sd(result, "R_ohm") > 1.4 * std::sqrt(ee / 400 / xx));
    TEST_ASSERT_TRUE(sd(result, "R_ohm") < 4.0 * std::sqrt(ee / 400 / xx));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, std::sqrt(ee / 400), result.axes[0].rms);
}

void too_few_points_throw(void)
{
    for (const dqw::Log& log : {standstill(2, 1.1, 4, 2)}) {
        bool thrown = false;
        try {
            dqw::fit({log});
        } catch (const std::invalid_argument&) {
            thrown = true;
        }
        TEST_ASSERT_TRUE(thrown);
    }
}

}  // namespace

int main()
{
    UNITY_BEGIN();
    RUN_TEST(steady_grid_without_noise);
    RUN_TEST(steady_standard_deviations);
    RUN_TEST(steady_without_pole_pairs);
    RUN_TEST(steady_at_one_speed_and_one_i_d);
    RUN_TEST(steady_without_i_d);
    RUN_TEST(steady_at_rest_and_of_zeros);
    RUN_TEST(standstill_resistance);
    RUN_TEST(standstill_structured_residual);
    RUN_TEST(too_few_points_throw);
    return UNITY_END();
}
