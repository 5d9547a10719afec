// The dynamic fit under white noise: errors, standard deviations and the Cramer-Rao bound.
// Plain only: long, and what it runs others run under the sanitizers.
#include <Eigen/Dense>
#include <cstdio>

#include "ref/fit/fit.hpp"
#include "ref/machine.hpp"
#include "unity.h"

extern "C" void setUp(void) {}
extern "C" void tearDown(void) {}

using machine::Plant;
using machine::Run;

namespace {

const char* const kNames[] = {"R_ohm", "Ld_H", "Lq_H", "psi_Wb"};

double& entry(Plant& m, int j) { return j == 0 ? m.R_ohm : j == 1 ? m.Ld_H : j == 2 ? m.Lq_H : m.psi_Wb; }

/// Smallest standard deviations of any unbiased estimator under white noise on the currents: central differences of the
/// simulated currents, the voltages staying as they are.
Eigen::Vector4d cramer_rao(const Plant& m, Run run, double sigma_d, double sigma_q)
{
    run.induced_Wb = m.psi_Wb;
    Eigen::MatrixXd d(run.rows, 4), q(run.rows, 4);
    for (int j = 0; j < 4; ++j) {
        Plant up = m, down = m;
        const double step = 1e-4 * entry(up, j);
        entry(up, j) += step, entry(down, j) -= step;
        const dqw::Log a = machine::simulate(up, run), b = machine::simulate(down, run);
        for (std::size_t k = 0; k < run.rows; ++k) {
            const auto row = static_cast<Eigen::Index>(k);
            d(row, j) = (a.i_d_A[k] - b.i_d_A[k]) / (2.0 * step * sigma_d);
            q(row, j) = (a.i_q_A[k] - b.i_q_A[k]) / (2.0 * step * sigma_q);
        }
    }
    const Eigen::Matrix4d information = d.transpose() * d + q.transpose() * q;
    return information.inverse().diagonal().cwiseSqrt();
}

/// Fits `seeds` noisy copies; checks each error against 3 sd, the mean sd against the bound (within 30 %), and that the
/// errors scatter as the sd says.
void check(const Plant& m, const Run& run, double fraction, int seeds, double most)
{
    const dqw::Log clean = machine::simulate(m, run);
    Plant truth = m;
    Eigen::Vector4d sum_sd = Eigen::Vector4d::Zero(), worst = sum_sd, bound = sum_sd;
    double squares = 0.0;
    for (int s = 0; s < seeds; ++s) {
        dqw::Log log = clean;
        log.machine.pole_pairs = m.p;
        const auto seed = static_cast<unsigned>(100 * s + 11);
        const double sigma_d = machine::add_noise(log.i_d_A, fraction, seed);
        const double sigma_q = machine::add_noise(log.i_q_A, fraction, seed + 1);
        if (s == 0) bound = cramer_rao(m, run, sigma_d, sigma_q);
        const dqw::Result result = dqw::fit({log});
        for (int j = 0; j < 4; ++j) {
            const double sd = machine::sd(result, kNames[j]);
            const double z = (machine::value(result, kNames[j]) - entry(truth, j)) / sd;
            TEST_ASSERT_TRUE(sd > 0.0);
            sum_sd[j] += sd / seeds;
            worst[j] = std::max(worst[j], std::abs(z));
            squares += z * z;
        }
    }
    for (int j = 0; j < 4; ++j) {
        std::printf("%.0f %% noise, %s: sd %.4g = %.3f times the bound, worst error %.2f sd\n", 100 * fraction,
                    kNames[j], sum_sd[j], sum_sd[j] / bound[j], worst[j]);
        TEST_ASSERT_TRUE(sum_sd[j] > 0.9 * bound[j]);
        TEST_ASSERT_TRUE(sum_sd[j] < most * bound[j]);
        TEST_ASSERT_TRUE(worst[j] < 3.0);
    }
    const double scatter = squares / (4.0 * seeds);
    std::printf("mean square error over variance: %.3f\n", scatter);
    // The mean of 4 x seeds squares of unit variance; those of one fit are correlated.
    TEST_ASSERT_TRUE(scatter > 0.6);
    TEST_ASSERT_TRUE(scatter < 1.5);
}

void twenty_percent_on_currents(void)
{
    Run run;
    run.rows = 20000, run.substeps = 4;
    check({}, run, 0.2, 24, 1.3);
}

void twenty_percent_on_a_short_log(void)
{
    Run run;
    run.rows = 3000, run.substeps = 4;
    check({0.37, 0.326e-3, 0.5e-3, 0.02, 4}, run, 0.2, 24, 1.3);
}

void one_percent_on_every_channel(void)
{
    Run run;
    run.rows = 10000, run.substeps = 4;
    const dqw::Log clean = machine::simulate({}, run);
    Plant truth;
    for (unsigned seed = 1; seed <= 8u; ++seed) {
        dqw::Log log = clean;
        unsigned channel = 0;
        for (auto* column : {&log.v_d_V, &log.v_q_V, &log.i_d_A, &log.i_q_A, &log.w_m_rad_s})
            machine::add_noise(*column, 0.01, 50 * seed + ++channel);
        const dqw::Result result = dqw::fit({log});
        TEST_ASSERT_EQUAL_DOUBLE(4.0, machine::value(result, "pole_pairs"));
        for (int j = 0; j < 4; ++j) {
            const double error = machine::value(result, kNames[j]) - entry(truth, j);
            TEST_ASSERT_TRUE(std::abs(error) < 0.002 * entry(truth, j));
            TEST_ASSERT_TRUE(std::abs(error) < 4.0 * machine::sd(result, kNames[j]));
        }
    }
}

/// A tenth on the voltages, the speed, and all at once with the currents: the mean of some logs shows a bias. Least
/// squares alone has one of 3 % of L_q there.
void noise_of_the_voltage_and_the_speed_is_no_bias(void)
{
    Run run;
    run.rows = 10000, run.substeps = 4;
    const dqw::Log clean = machine::simulate({}, run);
    Plant truth;
    const unsigned seeds = 6;
    for (int which : {1, 2, 3}) {
        double error[4] = {}, sd[4] = {};
        for (unsigned seed = 1; seed <= seeds; ++seed) {
            dqw::Log log = clean;
            log.machine.pole_pairs = truth.p;
            if (which & 1)
                machine::add_noise(log.v_d_V, 0.1, 10 * seed), machine::add_noise(log.v_q_V, 0.1, 10 * seed + 1);
            if (which & 2) machine::add_noise(log.w_m_rad_s, 0.1, 10 * seed + 2);
            if (which == 3)
                machine::add_noise(log.i_d_A, 0.1, 10 * seed + 3), machine::add_noise(log.i_q_A, 0.1, 10 * seed + 4);
            const dqw::Result result = dqw::fit({log});
            for (int j = 0; j < 4; ++j)
                error[j] += (machine::value(result, kNames[j]) - entry(truth, j)) / seeds,
                    sd[j] += machine::sd(result, kNames[j]) / seeds;
        }
        for (int j = 0; j < 4; ++j) {
            std::printf("noise %d, %s: mean error %.3f %%, sd of one %.3f %%\n", which, kNames[j],
                        100.0 * error[j] / entry(truth, j), 100.0 * sd[j] / entry(truth, j));
            TEST_ASSERT_TRUE(std::abs(error[j]) < 3.0 * sd[j] / std::sqrt(seeds) + 0.002 * entry(truth, j));
        }
    }
}

/// The pole pairs as a real number: their own scatter.
void pole_pairs_with_their_sd(void)
{
    Run run;
    run.rows = 4000, run.substeps = 4;
    const dqw::Log clean = machine::simulate({}, run);
    for (unsigned seed = 1; seed <= 8u; ++seed) {
        dqw::Log log = clean;
        machine::add_noise(log.i_d_A, 0.2, seed);
        machine::add_noise(log.i_q_A, 0.2, seed + 70);
        const dqw::Result result = dqw::fit({log});
        TEST_ASSERT_EQUAL_DOUBLE(4.0, machine::value(result, "pole_pairs"));
        TEST_ASSERT_TRUE(machine::sd(result, "pole_pairs") > 0.005);
        TEST_ASSERT_TRUE(machine::sd(result, "pole_pairs") < 0.05);
    }
}

}  // namespace

int main()
{
    UNITY_BEGIN();
    RUN_TEST(twenty_percent_on_currents);
    RUN_TEST(twenty_percent_on_a_short_log);
    RUN_TEST(one_percent_on_every_channel);
    RUN_TEST(noise_of_the_voltage_and_the_speed_is_no_bias);
    RUN_TEST(pole_pairs_with_their_sd);
    return UNITY_END();
}
