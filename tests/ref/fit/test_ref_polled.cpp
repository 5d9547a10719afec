// Polled logs: means of the voltage equations by quadrature, over currents and speeds in closed form.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "ref/fit/fit.hpp"
#include "ref/fit/polled_logs.hpp"
#include "polled_drive.hpp"
#include "ref/machine.hpp"
#include "unity.h"

extern "C" void setUp(void) {}
extern "C" void tearDown(void) {}

using machine::sd;
using machine::value;
using polled_drive::Drawn;
using polled_drive::polled;

namespace {

double error(const dqw::Result& r, const char* name, double truth) { return value(r, name) / truth - 1.0; }

bool refused(const dqw::Result& r, const std::string& name, const std::string& why)
{
    return std::any_of(r.not_identifiable.begin(), r.not_identifiable.end(), [&](const dqw::NotIdentifiable& n) {
        return n.name == name && n.why.find(why) != std::string::npos;
    });
}

bool notes(const dqw::Result& r, const std::string& part)
{
    return std::any_of(r.notes.begin(), r.notes.end(),
                       [&](const std::string& n) { return n.find(part) != std::string::npos; });
}

void means_over_an_interval_are_taken_as_such(void)
{
    for (const double rate : {10.0, 20.0, 50.0}) {
        Drawn m;
        m.rate_Hz = rate;
        const dqw::Result r = dqw::fit({polled(m)});
        const double worst = std::max({std::abs(error(r, "R_ohm", m.R_ohm)), std::abs(error(r, "Ld_H", m.Ld_H)),
                                       std::abs(error(r, "Lq_H", m.Lq_H)), std::abs(error(r, "psi_Wb", m.psi_Wb))});
        std::printf("no noise, %g Hz: worst error %.2e\n", rate, worst);
        TEST_ASSERT_TRUE(worst > 1e-7 && worst < (rate < 20.0 ? 6e-3 : 3e-3));
        TEST_ASSERT_TRUE(dqw::Regime::polled == r.regime);
    }
}

void noise_of_the_speed_is_in_the_deviations(void)
{
    int within = 0, all = 0;
    double worst_R = 0.0, worst_psi = 0.0;
    for (unsigned seed = 1; seed <= 20; ++seed) {
        Drawn m;
        m.seed = seed, m.noise_rad_s = 0.5, m.lost_V = seed % 2 == 0 ? 0.3 : 0.0;
        const dqw::Result r = dqw::fit({polled(m)});
        worst_R = std::max(worst_R, std::abs(error(r, "R_ohm", m.R_ohm)));
        worst_psi = std::max(worst_psi, std::abs(error(r, "psi_Wb", m.psi_Wb)));
        within += std::abs(value(r, "R_ohm") - m.R_ohm) < 2 * sd(r, "R_ohm");
        within += std::abs(value(r, "psi_Wb") - m.psi_Wb) < 2 * sd(r, "psi_Wb");
        all += 2;
        if (m.lost_V > 0.0) {
            TEST_ASSERT_EQUAL_size_t(1, r.dead_time.size());
            TEST_ASSERT_DOUBLE_WITHIN(0.05, 0.25 * M_PI * m.lost_V, r.dead_time[0].value);
        }
    }
    std::printf("20 draws: R within %.2f %%, psi within %.3f %%; %d of %d within two deviations\n", 100 * worst_R,
                100 * worst_psi, within, all);
    TEST_ASSERT_TRUE(worst_R > 0.002 && worst_R < 0.02);
    TEST_ASSERT_TRUE(worst_psi > 1e-4 && worst_psi < 0.003);
    TEST_ASSERT_TRUE(within >= 36);
}

/// Waves of under a second, where the mean of two speeds is off by (f T)^2 / 12 of the wave.
void speeds_that_bend_within_a_row_are_followed(void)
{
    Drawn m;
    m.pace = 9.0, m.noise_rad_s = 0.05;
    const dqw::Result r = dqw::fit({polled(m)});
    const double off = std::abs(error(r, "psi_Wb", m.psi_Wb)), off_R = std::abs(error(r, "R_ohm", m.R_ohm));
    std::printf("waves of 0.8 s: psi within %.3f %%, R within %.2f %%\n", 100 * off, 100 * off_R);
    TEST_ASSERT_TRUE(off > 2e-4 && off < 3e-3);
    TEST_ASSERT_TRUE(off_R < 0.01);
}

void a_slow_links_queue_is_found(void)
{
    Drawn m;
    m.queue = 6, m.noise_rad_s = 0.3;
    const dqw::Result r = dqw::fit({polled(m)});
    TEST_ASSERT_TRUE(notes(r, "come 6 rows after the speed (0.3 s)"));
    TEST_ASSERT_TRUE(std::abs(error(r, "psi_Wb", m.psi_Wb)) < 0.01);
    m.queue = 0;
    TEST_ASSERT_FALSE(notes(dqw::fit({polled(m)}), "the speed ("));
}

void where_current_follows_speed_both_are_refused(void)
{
    Drawn m;
    m.fan = true, m.noise_rad_s = 0.5;
    const dqw::Result r = dqw::fit({polled(m)});
    TEST_ASSERT_TRUE(refused(r, "R_ohm", "current follows the speed"));
    TEST_ASSERT_TRUE(refused(r, "psi_Wb", "current follows the speed"));
}

void without_i_d_the_inductances_are_one(void)
{
    Drawn m;
    m.i_d_moves = false;
    const dqw::Result r = dqw::fit({polled(m)});
    TEST_ASSERT_TRUE(refused(r, "Ld_H", "i_d hardly moves"));
    TEST_ASSERT_TRUE(std::abs(error(r, "Lq_H", m.Lq_H)) < 0.01);
}

void settled_rows_are_settled_points(void)
{
    Drawn m;
    m.noise_rad_s = 0.3;
    const dqw::Log log = polled(m);
    const auto settled = dqw::settled_logs({log});
    TEST_ASSERT_EQUAL_size_t(1, settled.size());
    TEST_ASSERT_TRUE(dqw::Regime::steady == settled[0].regime);
    TEST_ASSERT_TRUE(settled[0].rows() > log.rows() / 2 && settled[0].rows() < log.rows());
    const dqw::Result r = dqw::fit(settled);
    TEST_ASSERT_TRUE(std::abs(error(r, "psi_Wb", m.psi_Wb)) < 0.01);
    TEST_ASSERT_EQUAL_size_t(1, dqw::settled_logs(settled).size());
}

/// A log without v_d and i_d: v_q alone, or by a duty the size of the voltage; i_d is taken as zero, as here it is.
void half_a_log_tells_flux_and_resistance(void)
{
    for (const bool size : {false, true}) {
        int within = 0;
        double worst_R = 0.0, worst_psi = 0.0;
        for (unsigned seed = 1; seed <= 10; ++seed) {
            Drawn m;
            m.seed = seed, m.noise_rad_s = 0.4, m.i_d_moves = false, m.seconds = 60;
            dqw::Log log = polled(m);
            if (size) {
                // As a tool gives it: a duty in thousandths of 48 V.
                const double step = 1e-3 * 48 / std::sqrt(3.0);
                for (std::size_t k = 0; k < log.rows(); ++k)
                    log.v_q_V[k] = step * std::round(std::hypot(log.v_d_V[k], log.v_q_V[k]) / step);
            }
            log.v_d_V.clear(), log.i_d_A.clear(), log.v_q_is_size = size;
            const dqw::Result r = dqw::fit({log});
            TEST_ASSERT_TRUE(notes(r, "it is taken as zero"));
            TEST_ASSERT_TRUE(notes(r, size ? "only its size" : "the q axis alone"));
            TEST_ASSERT_EQUAL_size_t(1, r.axes.size());
            TEST_ASSERT_TRUE(refused(r, "Ld_H", ""));
            worst_R = std::max(worst_R, std::abs(error(r, "R_ohm", m.R_ohm)));
            worst_psi = std::max(worst_psi, std::abs(error(r, "psi_Wb", m.psi_Wb)));
            within += std::abs(value(r, "R_ohm") - m.R_ohm) < 2 * sd(r, "R_ohm");
            within += std::abs(value(r, "psi_Wb") - m.psi_Wb) < 2 * sd(r, "psi_Wb");
        }
        std::printf("%s: R within %.2f %%, psi within %.3f %%, %d of 20 within two deviations\n",
                    size ? "size by duty" : "v_q alone", 100 * worst_R, 100 * worst_psi, within);
        TEST_ASSERT_TRUE(worst_R > 1e-4 && worst_R < 0.03);
        TEST_ASSERT_TRUE(worst_psi > 1e-5 && worst_psi < 0.005);
        TEST_ASSERT_TRUE(within >= 18);
    }
}

void one_operating_point_tells_nothing(void)
{
    dqw::Log log = polled({});
    for (auto* column : {&log.v_d_V, &log.v_q_V, &log.i_d_A, &log.i_q_A, &log.w_m_rad_s})
        std::fill(column->begin(), column->end(), 3.0);
    const dqw::Result r = dqw::fit({log});
    for (const char* name : {"R_ohm", "Ld_H", "Lq_H", "psi_Wb"}) TEST_ASSERT_TRUE(refused(r, name, "all of one kind"));
    TEST_ASSERT_EQUAL_size_t(0, r.parameters.size());
}

void too_few_rows_are_refused(void)
{
    Drawn m;
    m.seconds = 0.6;
    try {
        (void)dqw::fit({polled(m)});
        TEST_FAIL_MESSAGE("expected a refusal");
    } catch (const std::invalid_argument& e) {
        TEST_ASSERT_NOT_NULL(std::strstr(e.what(), "needs at least 12"));
    }
}

}  // namespace

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(means_over_an_interval_are_taken_as_such);
    RUN_TEST(noise_of_the_speed_is_in_the_deviations);
    RUN_TEST(speeds_that_bend_within_a_row_are_followed);
    RUN_TEST(a_slow_links_queue_is_found);
    RUN_TEST(where_current_follows_speed_both_are_refused);
    RUN_TEST(without_i_d_the_inductances_are_one);
    RUN_TEST(settled_rows_are_settled_points);
    RUN_TEST(half_a_log_tells_flux_and_resistance);
    RUN_TEST(one_operating_point_tells_nothing);
    RUN_TEST(too_few_rows_are_refused);
    return UNITY_END();
}
