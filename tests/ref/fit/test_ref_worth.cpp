// What the fit's values are worth: deviations where the model is wrong, usable or not, pole pairs by the angle.
#include <cmath>
#include <cstdio>

#include "ref/fit/fit.hpp"
#include "ref/machine.hpp"
#include "unity.h"

extern "C" void setUp(void) {}
extern "C" void tearDown(void) {}

using machine::Plant;
using machine::Run;

namespace {

dqw::Result fitted(double dead_time_V)
{
    Plant m;
    m.dead_time_V = dead_time_V;
    Run run;
    run.rows = 8000, run.substeps = 4;
    dqw::Log log = machine::simulate(m, run);
    log.machine.pole_pairs = m.p;
    machine::add_noise(log.i_d_A, 0.01, 3), machine::add_noise(log.i_q_A, 0.01, 4);
    return dqw::fit({log});
}

/// A dead time that no one told is read as a resistance: its deviation says so, and without it stays what noise makes.
void a_missing_dead_time_is_in_the_deviation_of_R(void)
{
    const dqw::Result clean = fitted(0.0), dead = fitted(0.5);
    const double error = std::abs(machine::value(dead, "R_ohm") - 0.5), sd = machine::sd(dead, "R_ohm");
    std::printf("R off by %.4f, sd %.4f; clean %.6f\n", error, sd, machine::sd(clean, "R_ohm"));
    TEST_ASSERT_TRUE(sd > 20.0 * machine::sd(clean, "R_ohm"));
    TEST_ASSERT_TRUE(machine::sd(clean, "R_ohm") < 0.002);
    for (const dqw::Estimate& e : dead.parameters)
        if (e.name == "R_ohm") TEST_ASSERT_TRUE(error < 5.0 * sd || !dqw::why_not_usable(e).empty());
}

/// As logged by a controller whose voltages act so much of a period late.
dqw::Result late(double periods)
{
    Run run;
    run.rows = 8000, run.substeps = 4, run.hold = 7;
    dqw::Log log = machine::simulate({}, run);
    log.machine.pole_pairs = 4;
    for (auto* v : {&log.v_d_V, &log.v_q_V})
        for (std::size_t k = 1; k < v->size(); ++k) (*v)[k] = ((*v)[k] - periods * (*v)[k - 1]) / (1.0 - periods);
    machine::add_noise(log.i_d_A, 0.002, 3), machine::add_noise(log.i_q_A, 0.002, 4);
    return dqw::fit({log});
}

/// What is late lasts no two rows, and an inductance takes it up: its deviation says so.
void a_voltage_that_is_late_is_in_the_deviations(void)
{
    const dqw::Result clean = late(0.0), wrong = late(0.4);
    const struct {
        const char* name;
        double truth;
    } table[] = {{"R_ohm", 0.5}, {"Ld_H", 1.0e-3}, {"Lq_H", 1.4e-3}, {"psi_Wb", 0.02}};
    for (const auto& row : table) {
        const double error = std::abs(machine::value(wrong, row.name) - row.truth), sd = machine::sd(wrong, row.name);
        std::printf("%s off by %.3g %%, sd %.3g; clean %.3g\n", row.name, 100.0 * error / row.truth,
                    100.0 * sd / row.truth, 100.0 * machine::sd(clean, row.name) / row.truth);
        TEST_ASSERT_TRUE(error < 2.0 * sd);
        TEST_ASSERT_TRUE(sd < 2.0 * error + 0.001 * row.truth);
        TEST_ASSERT_TRUE(sd > 10.0 * machine::sd(clean, row.name));
        TEST_ASSERT_TRUE(machine::sd(clean, row.name) < 1e-4 * row.truth);
    }
}

void usable_is_known_positive_and_to_a_tenth(void)
{
    TEST_ASSERT_TRUE(dqw::why_not_usable({"R_ohm", 1.0, 0.0333, false}).empty());
    TEST_ASSERT_FALSE(dqw::why_not_usable({"R_ohm", 1.0, 0.0334, false}).empty());
    TEST_ASSERT_FALSE(dqw::why_not_usable({"R_ohm", -1.0, 0.001, false}).empty());
    TEST_ASSERT_FALSE(dqw::why_not_usable({"R_ohm", std::nan(""), 0.001, false}).empty());
    TEST_ASSERT_TRUE(dqw::why_not_usable({"R_ohm", 1.0, 9.0, true}).empty());
}

void the_angle_tells_the_pole_pairs(void)
{
    Run run;
    run.rows = 4000, run.substeps = 4;
    dqw::Log log = machine::simulate({}, run);
    double theta = 0.0;
    for (std::size_t k = 0; k < log.rows(); ++k) {
        log.theta_e_rad.push_back(std::remainder(theta, 2.0 * M_PI));
        if (k + 1 < log.rows()) theta += 4.0 * 0.5 * (log.w_m_rad_s[k] + log.w_m_rad_s[k + 1]) * log.dt_s;
    }
    const dqw::Result result = dqw::fit({log});
    TEST_ASSERT_EQUAL_DOUBLE(4.0, machine::value(result, "pole_pairs"));
    TEST_ASSERT_EQUAL_DOUBLE(0.0, machine::sd(result, "pole_pairs"));
    TEST_ASSERT_DOUBLE_WITHIN(0.002 * 0.02, 0.02, machine::value(result, "psi_Wb"));
}

}  // namespace

int main()
{
    UNITY_BEGIN();
    RUN_TEST(a_missing_dead_time_is_in_the_deviation_of_R);
    RUN_TEST(a_voltage_that_is_late_is_in_the_deviations);
    RUN_TEST(usable_is_known_positive_and_to_a_tenth);
    RUN_TEST(the_angle_tells_the_pole_pairs);
    return UNITY_END();
}
