// Looks at a slow log, against the drive that was drawn.
#include "ref/fit/polled_looks.hpp"

#include <cmath>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <string>

#include "polled_drive.hpp"
#include "unity.h"

extern "C" void setUp(void) {}
extern "C" void tearDown(void) {}

using polled_drive::Drawn;
using polled_drive::polled;

namespace {

enum { R, Ld, Lq, Psi };

double sd(const dqw::PolledLook& l, std::size_t j) { return std::hypot(l.sd[j], l.lasting[j]); }

double mean(const dqw::PolledLook& l, const Drawn& m, double (Drawn::*of)(double) const)
{
    double sum = 0.0;
    for (int k = 0; k < 50; ++k) sum += (m.*of)(l.from_s + (k + 0.5) / 50 * (l.to_s - l.from_s)) / 50;
    return sum;
}

void what_stays_reads_no_change(void)
{
    int within = 0, all = 0;
    double least = 1.0, most = 0.0, squares = 0.0;
    for (unsigned seed = 1; seed <= 10; ++seed) {
        Drawn m;
        m.seed = seed, m.seconds = 200, m.noise_rad_s = 0.4, m.lost_V = seed % 2 == 0 ? 0.2 : 0.0;
        const dqw::PolledLooks looks = dqw::polled_looks(polled(m), 10.0, 50.0);
        TEST_ASSERT_TRUE(looks.looks.size() >= 15 && looks.looks.size() <= 20);
        const double truth[] = {m.R_ohm, m.Ld_H, m.Lq_H, m.psi_Wb};
        for (const dqw::PolledLook& l : looks.looks)
            for (const std::size_t j : {R, Lq, Psi}) {
                TEST_ASSERT_TRUE(looks.known[j]);
                within += std::abs(looks.head[j] + l.change[j] - truth[j]) < 2 * std::hypot(sd(l, j), looks.head_sd[j]);
                squares += std::pow(l.change[j] / sd(l, j), 2);
                ++all;
                if (j == Psi) least = std::min(least, sd(l, j) / m.psi_Wb), most = std::max(most, sd(l, j) / m.psi_Wb);
            }
    }
    std::printf("%d of %d within two deviations, those of psi %.2f to %.2f %%; changes of %.2f deviations RMS\n",
                within, all, 100 * least, 100 * most, std::sqrt(squares / all));
    TEST_ASSERT_TRUE(within >= 0.9 * all);
    // What may last is in every look's deviation, here where only the speed's noise does not.
    TEST_ASSERT_TRUE(std::sqrt(squares / all) > 0.4 && std::sqrt(squares / all) < 1.2);
    TEST_ASSERT_TRUE(least > 1e-4 && most < 0.01);
}

void what_changes_is_read_look_by_look(void)
{
    Drawn m;
    m.seconds = 200, m.noise_rad_s = 0.3, m.change_s = 100, m.psi_fall = 0.15, m.R_rise = 0.5;
    const dqw::PolledLooks looks = dqw::polled_looks(polled(m), 10.0, 50.0);
    for (const dqw::PolledLook& l : looks.looks) {
        // Inside the ramp a look's mean is that of its own rows.
        if (l.to_s > 100 && l.from_s < 121) continue;
        const double R_off = looks.head[R] + l.change[R] - mean(l, m, &Drawn::R_at),
                     psi_off = looks.head[Psi] + l.change[Psi] - mean(l, m, &Drawn::psi_at);
        TEST_ASSERT_DOUBLE_WITHIN(0.03 * m.R_ohm, 0.0, R_off);
        TEST_ASSERT_DOUBLE_WITHIN(0.01 * m.psi_Wb, 0.0, psi_off);
        TEST_ASSERT_DOUBLE_WITHIN(3 * std::hypot(sd(l, R), looks.head_sd[R]), 0.0, R_off);
        TEST_ASSERT_DOUBLE_WITHIN(3 * std::hypot(sd(l, Psi), looks.head_sd[Psi]), 0.0, psi_off);
    }
}

void settled_points_are_their_own_means(void)
{
    const Drawn m;
    dqw::Log log;
    log.path = "points", log.regime = dqw::Regime::steady, log.machine.pole_pairs = m.p;
    for (int k = 0; k < 400; ++k) {
        const double i_d = 2.0 * std::sin(1.3 * k), i_q = 4.0 + 3.0 * std::sin(0.7 * k),
                     w_m = 60 + 30 * std::sin(0.41 * k), w = m.p * w_m, psi = m.psi_Wb * (k < 200 ? 1.0 : 0.9);
        log.t_s.push_back(k), log.i_d_A.push_back(i_d), log.i_q_A.push_back(i_q), log.w_m_rad_s.push_back(w_m);
        log.v_d_V.push_back(m.R_ohm * i_d - w * m.Lq_H * i_q);
        log.v_q_V.push_back(m.R_ohm * i_q + w * (m.Ld_H * i_d + psi));
    }
    const dqw::PolledLooks looks = dqw::polled_looks(log, 10.0, 100.0);
    TEST_ASSERT_TRUE(looks.known[R] && looks.known[Ld] && looks.known[Lq] && looks.known[Psi]);
    for (const dqw::PolledLook& l : looks.looks) {
        if (l.from_s < 200 && l.to_s >= 200) continue;
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, m.Ld_H, looks.head[Ld] + l.change[Ld]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-7, m.psi_Wb * (l.to_s < 200 ? 1.0 : 0.9), looks.head[Psi] + l.change[Psi]);
    }
}

void where_current_follows_speed_neither_is_known(void)
{
    Drawn m;
    m.fan = true, m.noise_rad_s = 0.5, m.seconds = 100;
    const dqw::PolledLooks looks = dqw::polled_looks(polled(m), 10.0, 50.0);
    TEST_ASSERT_TRUE(looks.follows);
    TEST_ASSERT_FALSE(looks.known[R] || looks.known[Psi]);
}

void a_head_of_a_few_rows_is_refused(void)
{
    Drawn m;
    m.seconds = 100;
    try {
        (void)dqw::polled_looks(polled(m), 10.0, 0.5);
        TEST_FAIL_MESSAGE("expected a refusal");
    } catch (const std::invalid_argument& e) {
        TEST_ASSERT_NOT_NULL(std::strstr(e.what(), "needs at least 12"));
    }
}

}  // namespace

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(what_stays_reads_no_change);
    RUN_TEST(what_changes_is_read_look_by_look);
    RUN_TEST(settled_points_are_their_own_means);
    RUN_TEST(where_current_follows_speed_neither_is_known);
    RUN_TEST(a_head_of_a_few_rows_is_refused);
    return UNITY_END();
}
