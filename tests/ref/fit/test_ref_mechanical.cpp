// Mechanical logs against the closed form of a first-order lag.
// Plain only: long, and what it runs others run under the sanitizers.
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

constexpr double kJ = 1.2e-4, kB = 3e-4, kDt_s = 1e-3;

/// Random torques of straight flanks (20 ms) between plateaus; the exact solution of J dw/dt + B w = T on each row.
dqw::Log motion(std::size_t rows, unsigned seed, double J = kJ, double B = kB, double dry_Nm = 0.0)
{
    dqw::Log log;
    log.path = "motion.csv";
    log.regime = dqw::Regime::mechanical;
    log.dt_s = kDt_s;
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> draw(-0.06, 0.06);
    double goal = draw(random), torque = 0.0, step = 0.0, w = 0.0;
    for (std::size_t k = 0; k < rows; ++k) {
        log.t_s.push_back(static_cast<double>(k) * kDt_s);
        log.w_m_rad_s.push_back(w);
        log.torque_Nm.push_back(torque);
        if (k % 300 == 0) goal = draw(random), step = (goal - torque) / 20.0;
        const double next = k % 300 < 20 ? torque + step : torque;
        constexpr int kParts = 20;
        for (int n = 0; n < kParts; ++n) {
            const double h = kDt_s / kParts,
                         mid = torque + (next - torque) * (n + 0.5) / kParts - dry_Nm * std::tanh(w / 2.0);
            w = w * std::exp(-B / J * h) + mid / B * (1.0 - std::exp(-B / J * h));
        }
        torque = next;
    }
    return log;
}

void without_noise(void)
{
    const dqw::Result result = dqw::fit({motion(10000, 1)});
    TEST_ASSERT_DOUBLE_WITHIN(1e-5 * kJ, kJ, value(result, "J_kgm2"));
    TEST_ASSERT_DOUBLE_WITHIN(1e-5 * kB, kB, value(result, "B_Nms_rad"));
    TEST_ASSERT_EQUAL_STRING("Nm", result.residual_unit.c_str());
    TEST_ASSERT_EQUAL_size_t(1, result.axes.size());
    TEST_ASSERT_EQUAL_STRING("torque", result.axes[0].axis.c_str());
    TEST_ASSERT_TRUE(result.residual_rms < 1e-6);
}

/// Output error is the best there is where only the speed is noisy: its bound, with sensitivities by differences.
void noisy_speed_reaches_the_bound(void)
{
    const double step = 1e-4;
    const dqw::Log clean = motion(6000, 2), up_j = motion(6000, 2, kJ * (1 + step)),
                   up_b = motion(6000, 2, kJ, kB * (1 + step));
    double jj = 0.0, jb = 0.0, bb = 0.0;
    for (std::size_t k = 0; k < clean.rows(); ++k) {
        const double j = (up_j.w_m_rad_s[k] - clean.w_m_rad_s[k]) / (step * kJ);
        const double b = (up_b.w_m_rad_s[k] - clean.w_m_rad_s[k]) / (step * kB);
        jj += j * j, jb += j * b, bb += b * b;
    }
    const int seeds = 20;
    double mean_j = 0.0, mean_b = 0.0, squares = 0.0, sigma = 0.0;
    for (int s = 0; s < seeds; ++s) {
        dqw::Log log = clean;
        sigma = machine::add_noise(log.w_m_rad_s, 0.2, static_cast<unsigned>(s + 5));
        const dqw::Result result = dqw::fit({log});
        mean_j += sd(result, "J_kgm2") / seeds, mean_b += sd(result, "B_Nms_rad") / seeds;
        squares += std::pow((value(result, "J_kgm2") - kJ) / sd(result, "J_kgm2"), 2);
        squares += std::pow((value(result, "B_Nms_rad") - kB) / sd(result, "B_Nms_rad"), 2);
    }
    const double determinant = jj * bb - jb * jb;
    const double bound_j = sigma * std::sqrt(bb / determinant), bound_b = sigma * std::sqrt(jj / determinant);
    std::printf("20 %% noise on w_m: sd over bound J %.3f, B %.3f; mean square error over variance %.2f\n",
                mean_j / bound_j, mean_b / bound_b, squares / (2 * seeds));
    TEST_ASSERT_TRUE(mean_j > 0.9 * bound_j && mean_j < 1.3 * bound_j);
    TEST_ASSERT_TRUE(mean_b > 0.9 * bound_b && mean_b < 1.3 * bound_b);
    TEST_ASSERT_TRUE(squares / (2 * seeds) > 0.4);
    TEST_ASSERT_TRUE(squares / (2 * seeds) < 1.8);
}

/// A speed in coarse steps and a torque drowned in noise, as encoders and current sensors give them.
void quantised_speed_and_noisy_torque(void)
{
    for (unsigned seed = 1; seed <= 4; ++seed) {
        dqw::Log log = motion(20000, seed);
        for (double& w : log.w_m_rad_s) w = 0.62831853 * std::round(w / 0.62831853);
        machine::add_noise(log.torque_Nm, 0.6, seed + 40);
        const dqw::Result result = dqw::fit({log});
        std::printf("quantised: J %+.2f %%, B %+.2f %%\n", 100 * (value(result, "J_kgm2") / kJ - 1),
                    100 * (value(result, "B_Nms_rad") / kB - 1));
        TEST_ASSERT_DOUBLE_WITHIN(0.05 * kJ, kJ, value(result, "J_kgm2"));
        TEST_ASSERT_DOUBLE_WITHIN(0.03 * kB, kB, value(result, "B_Nms_rad"));
    }
}

/// Dry friction is not in the model: it ends in B and in the residual.
void dry_friction_remains(void)
{
    const dqw::Result result = dqw::fit({motion(20000, 3, kJ, 1e-4, 0.02)});
    TEST_ASSERT_TRUE(value(result, "B_Nms_rad") > 1.5e-4);
    TEST_ASSERT_TRUE(result.axes[0].percent > 10.0);
    TEST_ASSERT_TRUE(result.axes[0].percent < 60.0);
}

void torque_from_current_and_command(void)
{
    const dqw::Log measured = motion(5000, 4);
    dqw::Log current = measured, command = measured;
    current.i_q_A = measured.torque_Nm;
    for (double& i : current.i_q_A) i /= 0.05;
    current.torque_Nm.clear();
    current.torque_cmd_Nm.assign(5000, 1.0);
    current.machine.torque_constant_Nm_A = 0.05;
    command.torque_cmd_Nm = measured.torque_Nm;
    command.torque_Nm.clear();
    for (const dqw::Log& log : {current, command})
        TEST_ASSERT_DOUBLE_WITHIN(1e-5 * kJ, kJ, value(dqw::fit({log}), "J_kgm2"));
    command.torque_cmd_Nm.clear();
    bool thrown = false;
    try {
        dqw::fit({command});
    } catch (const std::invalid_argument&) {
        thrown = true;
    }
    TEST_ASSERT_TRUE(thrown);
}

void torque_constant_where_asked(void)
{
    dqw::Log log = motion(5000, 5);
    log.i_q_A = log.torque_Nm;
    for (double& i : log.i_q_A) i /= 0.05;
    machine::add_noise(log.torque_Nm, 0.01, 7);
    dqw::FitOptions options;
    options.parameters = {"J_kgm2", "B_Nms_rad", "torque_constant_Nm_A"};
    const dqw::Result result = dqw::fit({log}, options);
    TEST_ASSERT_DOUBLE_WITHIN(5e-5, 0.05, value(result, "torque_constant_Nm_A"));
    TEST_ASSERT_FALSE(machine::has(dqw::fit({log}), "torque_constant_Nm_A"));
    log.i_q_A.clear();
    TEST_ASSERT_NOT_NULL(missing(dqw::fit({log}, options), "torque_constant_Nm_A"));
}

void nothing_moves(void)
{
    dqw::Log rest = motion(2000, 6);
    rest.w_m_rad_s.assign(2000, 0.0);
    const dqw::Result still = dqw::fit({rest});
    TEST_ASSERT_TRUE(still.parameters.empty());
    TEST_ASSERT_EQUAL_size_t(2, still.not_identifiable.size());
    rest.torque_Nm.assign(2000, 0.0);
    TEST_ASSERT_EQUAL_size_t(2, dqw::fit({rest}).not_identifiable.size());
    // One settled speed tells B, and not J.
    dqw::Log even = motion(2000, 6);
    even.w_m_rad_s.assign(2000, 100.0);
    even.torque_Nm.assign(2000, 100.0 * kB);
    const dqw::Result settled = dqw::fit({even});
    TEST_ASSERT_NOT_NULL(missing(settled, "J_kgm2"));
    TEST_ASSERT_FALSE(machine::has(settled, "J_kgm2"));
}

}  // namespace

int main()
{
    UNITY_BEGIN();
    RUN_TEST(without_noise);
    RUN_TEST(noisy_speed_reaches_the_bound);
    RUN_TEST(quantised_speed_and_noisy_torque);
    RUN_TEST(dry_friction_remains);
    RUN_TEST(torque_from_current_and_command);
    RUN_TEST(torque_constant_where_asked);
    RUN_TEST(nothing_moves);
    return UNITY_END();
}
