// R, L_d and L_q from the size of a shorted machine's current, against the solution of its two equations; drag by
// speed.
#include <Eigen/Dense>
#include <cmath>
#include <cstdio>
#include <random>
#include <stdexcept>
#include <string>

#include "ref/fit/drag.hpp"
#include "ref/fit/fit.hpp"
#include "ref/trace/trace.hpp"
#include "unity.h"

extern "C" void setUp(void) {}
extern "C" void tearDown(void) {}

namespace {

using dqw::Log;
using dqw::Result;

const double R = 0.02, psi = 0.06, p = 4;

Log points(double Ld, double Lq, bool shorted, unsigned seed, double slowest = 2.0)
{
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    Log log;
    log.path = shorted ? "short" : "open", log.regime = dqw::Regime::steady, log.machine.pole_pairs = p;
    for (int k = 0; k < 24; ++k) {
        const double w_m = slowest * std::pow(1.3, k), w = p * w_m, noise = 1 + 5e-4 * normal(random);
        Eigen::Matrix2d m;
        m << R, -w * Lq, w * Ld, R;
        const Eigen::Vector2d i = m.inverse() * Eigen::Vector2d(0.0, -w * psi);
        log.w_m_rad_s.push_back(w_m);
        log.v_d_V.push_back(0), log.i_d_A.push_back(0);
        log.v_q_V.push_back(shorted ? 0 : w * psi * noise);
        log.i_q_A.push_back(shorted ? i.norm() * noise : 0);
    }
    return log;
}

const dqw::Estimate* find(const Result& r, const char* name)
{
    for (const dqw::Estimate& e : r.parameters)
        if (e.name == name) return &e;
    return nullptr;
}

void the_corner_tells_R_and_L(void)
{
    int within = 0, all = 0, saliencies = 0;
    for (const double ratio : {1.0, 1.5, 3.0, 0.7})
        for (unsigned seed = 1; seed <= 10; ++seed) {
            const double Ld = 2e-4, Lq = ratio * Ld;
            const Result r = dqw::fit({points(Ld, Lq, false, 100 + seed), points(Ld, Lq, true, seed)});
            for (const auto& [name, truth] :
                 {std::pair("R_ohm", R), std::pair("Ld_H", Ld), std::pair("Lq_H", Lq), std::pair("psi_Wb", psi)}) {
                const dqw::Estimate* e = find(r, name);
                // Which of the two is larger shows in the third order alone.
                if (e == nullptr && name == std::string("Lq_H") && ratio < 2) continue;
                TEST_ASSERT_NOT_NULL_MESSAGE(e, name);
                if (name == std::string("Lq_H")) {
                    ++saliencies;
                    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(3 * e->sd, truth, e->value, name);
                    continue;
                }
                TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.02 * truth, truth, e->value, name);
                TEST_ASSERT_TRUE_MESSAGE(e->sd > 5e-5 * truth && e->sd < 0.02 * truth,
                                         (std::string(name) + std::to_string(e->sd / truth)).c_str());
                ++all, within += std::abs(e->value - truth) < 2 * e->sd;
            }
        }
    std::printf("%d of %d within two deviations; L_q told of %d of 40\n", within, all, saliencies);
    TEST_ASSERT_TRUE(within >= 0.9 * all);
    TEST_ASSERT_TRUE(saliencies >= 10);
}

void alone_it_tells_the_current_and_the_corner(void)
{
    const Result r = dqw::fit({points(2e-4, 3e-4, true, 1)});
    for (const char* name : {"R_ohm", "Ld_H", "Lq_H", "psi_Wb"}) TEST_ASSERT_NULL(find(r, name));
    TEST_ASSERT_EQUAL_size_t(4, r.not_identifiable.size());
    double current = 0, sd = 0, corner = 0, corner_sd = 0;
    for (const std::string& note : r.notes)
        std::sscanf(note.c_str(), "short circuit: psi/L_d is %lf ± %lf A, R/L_d %lf ± %lf rad/s", &current, &sd,
                    &corner, &corner_sd);
    TEST_ASSERT_DOUBLE_WITHIN(3 * sd, psi / 2e-4, current);
    TEST_ASSERT_DOUBLE_WITHIN(3 * corner_sd, R / 2e-4 / p, corner);
    TEST_ASSERT_TRUE(sd > 0 && sd < 5 && corner_sd > 0 && corner_sd < 1);
}

/// Speeds on one side of the corner.
void what_the_speeds_do_not_tell_is_not_told(void)
{
    Log slow = points(2e-4, 2e-4, true, 3, 0.1);
    for (auto* column : {&slow.w_m_rad_s, &slow.v_d_V, &slow.v_q_V, &slow.i_d_A, &slow.i_q_A}) column->resize(7);
    const Result r = dqw::fit({points(2e-4, 2e-4, false, 4), slow});
    TEST_ASSERT_NULL(find(r, "Ld_H"));
    TEST_ASSERT_NULL(find(r, "Lq_H"));
    const dqw::Estimate* found = find(r, "R_ohm");
    TEST_ASSERT_TRUE(found && std::abs(found->value - R) < 3 * found->sd);
}

void nothing_else_takes_it(void)
{
    const std::vector<Log> shorted{points(2e-4, 3e-4, true, 1)};
    try {
        dqw::trace(shorted);
        TEST_FAIL();
    } catch (const std::invalid_argument& error) {
        TEST_ASSERT_TRUE(std::string(error.what()).find("a short circuit") != std::string::npos);
    }
    Log driven = points(2e-4, 3e-4, false, 2);
    driven.i_q_A[3] = 1;
    try {
        dqw::fit({driven, shorted[0]});
        TEST_FAIL();
    } catch (const std::invalid_argument& error) {
        TEST_ASSERT_TRUE(std::string(error.what()).find("beside an open") != std::string::npos);
    }
}

/// Whichever way it turns, and whatever sign the sensor has.
void drag_is_told_by_speed(void)
{
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    for (const double sign : {1.0, -1.0}) {
        Log log = points(2e-4, 3e-4, false, 1);
        for (double& w : log.w_m_rad_s) {
            const double size = std::abs(w);
            log.torque_Nm.push_back(sign * (0.4 + 1e-3 * size + 4e-7 * size * size + 1e-3 * normal(random)));
            if (log.torque_Nm.size() % 2 == 0) w = -w, log.torque_Nm.back() *= -1;
        }
        double T0 = 0, T0_sd = 0, B = 0, B_sd = 0, A = 0, A_sd = 0;
        TEST_ASSERT_EQUAL_INT(6, std::sscanf(dqw::drag_of({log}).c_str(),
                                             "without current the shaft takes %lf ± %lf mNm + (%lf ± %lf µNms) w + "
                                             "(%lf ± %lf nNms²)",
                                             &T0, &T0_sd, &B, &B_sd, &A, &A_sd));
        TEST_ASSERT_DOUBLE_WITHIN(3 * T0_sd, 400, T0);
        TEST_ASSERT_DOUBLE_WITHIN(3 * B_sd, 1000, B);
        TEST_ASSERT_DOUBLE_WITHIN(3 * A_sd, 400, A);
        TEST_ASSERT_TRUE(T0_sd > 0.1 && T0_sd < 2 && B_sd < 30 && A_sd < 80);
    }
    TEST_ASSERT_EQUAL_STRING("", dqw::drag_of({points(2e-4, 3e-4, false, 1)}).c_str());
}

}  // namespace

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_corner_tells_R_and_L);
    RUN_TEST(alone_it_tells_the_current_and_the_corner);
    RUN_TEST(what_the_speeds_do_not_tell_is_not_told);
    RUN_TEST(nothing_else_takes_it);
    RUN_TEST(drag_is_told_by_speed);
    return UNITY_END();
}
