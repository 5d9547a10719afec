// What the fit's values are worth: deviations where the model is wrong, usable or not, pole pairs by the angle.
// Plain only: long, and what it runs others run under the sanitizers.
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

void put_angle(dqw::Log& log)
{
    double theta = 0.0;
    for (std::size_t k = 0; k < log.rows(); ++k) {
        log.theta_e_rad.push_back(std::remainder(theta, 2.0 * M_PI));
        if (k + 1 < log.rows()) theta += 4.0 * 0.5 * (log.w_m_rad_s[k] + log.w_m_rad_s[k + 1]) * log.dt_s;
    }
}

dqw::Result fitted(double dead_time_V, bool angle)
{
    Plant m;
    m.dead_time_V = dead_time_V;
    Run run;
    run.rows = 8000, run.substeps = 4;
    dqw::Log log = machine::simulate(m, run);
    log.machine.pole_pairs = m.p;
    if (angle) put_angle(log);
    machine::add_noise(log.i_d_A, 0.01, 3), machine::add_noise(log.i_q_A, 0.01, 4);
    return dqw::fit({log});
}

bool tells_a_loss(const dqw::Result& r)
{
    for (const std::string& note : r.notes)
        if (note.find("with the sign of their current") != std::string::npos) return true;
    return false;
}

/// A dead time that no one told is read as a resistance: its deviation and a note say so, with an angle in the log and
/// without; and without it the deviation stays what noise makes.
void a_missing_dead_time_is_in_the_deviation_of_R(void)
{
    const double alone = machine::sd(fitted(0.0, true), "R_ohm");
    for (bool angle : {true, false}) {
        const dqw::Result clean = fitted(0.0, angle);
        TEST_ASSERT_DOUBLE_WITHIN(0.2 * alone, alone, machine::sd(clean, "R_ohm"));
        TEST_ASSERT_TRUE(alone < 0.002);
        TEST_ASSERT_FALSE(tells_a_loss(clean));
        for (double loss_V : {-0.1, 0.1, 0.25, 0.5}) {
            const dqw::Result dead = fitted(loss_V, angle);
            const double error = std::abs(machine::value(dead, "R_ohm") - 0.5), sd = machine::sd(dead, "R_ohm");
            std::printf("%g V: R off by %.4f, sd %.4f; clean %.6f\n", loss_V, error, sd, alone);
            TEST_ASSERT_TRUE(error > 3.0 * alone);
            TEST_ASSERT_TRUE(error < 2.0 * sd);
            TEST_ASSERT_TRUE(sd < 2.0 * error);
            TEST_ASSERT_TRUE(tells_a_loss(dead));
        }
    }
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
    put_angle(log);
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
