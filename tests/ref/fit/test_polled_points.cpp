// Looks of polled logs: as long as needed for errors of neighbours to have nothing in common.
// Plain only: long, and what it runs others run under the sanitizers.
#include "ref/fit/polled_points.hpp"

#include <cmath>
#include <cstdio>
#include <random>

#include "polled_drive.hpp"
#include "unity.h"

extern "C" void setUp(void) {}
extern "C" void tearDown(void) {}

namespace {

/// Levels of 4 s at 20 rows a second, voltages of the plain equations; errors of a row last for `lasts_s`.
dqw::Log levels(double seconds, double lasts_s, unsigned seed)
{
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> level(-1.0, 1.0);
    dqw::Log log;
    log.path = "drawn", log.regime = dqw::Regime::polled, log.machine.pole_pairs = 5, log.dt_s = 0.05;
    const double keep = lasts_s > 0.0 ? std::exp(-log.dt_s / lasts_s) : 0.0, R = 0.3, L = 5e-4, psi = 0.015;
    double e_d = 0.0, e_q = 0.0, i_d = 0.0, i_q = 0.0, w = 0.0;
    for (int k = 0; k * log.dt_s < seconds; ++k) {
        if (k % 80 == 0) i_d = level(random), i_q = 5 + 3 * level(random), w = 60 + 30 * level(random);
        e_d = keep * e_d + std::sqrt(1 - keep * keep) * 0.05 * normal(random);
        e_q = keep * e_q + std::sqrt(1 - keep * keep) * 0.05 * normal(random);
        log.t_s.push_back(k * log.dt_s), log.w_m_rad_s.push_back(w);
        log.i_d_A.push_back(i_d + 1e-4 * normal(random)), log.i_q_A.push_back(i_q + 1e-4 * normal(random));
        log.v_d_V.push_back(R * i_d - 5 * w * L * i_q + e_d),
            log.v_q_V.push_back(R * i_q + 5 * w * (L * i_d + psi) + e_q);
        log.temp_winding_C.push_back(0.01 * k);
    }
    return log;
}

void looks_grow_with_what_lasts(void)
{
    double white = 0.0, lasting = 0.0;
    for (unsigned seed = 1; seed <= 5; ++seed) {
        const auto a = dqw::polled_points({levels(400, 0.0, seed)}), b = dqw::polled_points({levels(400, 0.5, seed)});
        white += a.look_s / 5, lasting += b.look_s / 5;
        TEST_ASSERT_EQUAL_size_t(a.looks, a.logs.front().rows());
        TEST_ASSERT_TRUE(a.logs.front().regime == dqw::Regime::steady && a.logs.front().of_polled);
    }
    std::printf("looks of %.1f s where errors of rows are their own, of %.1f s where they last for half a second\n",
                white, lasting);
    TEST_ASSERT_TRUE(white < 1.0);
    TEST_ASSERT_TRUE(lasting > 2.0 && lasting < 10.0);
}

void a_look_is_one_operating_point(void)
{
    const dqw::Log log = levels(400, 0.5, 3);
    const auto points = dqw::polled_points({log});
    const dqw::Log& looks = points.logs.front();
    // A hundred levels of 80 rows.
    TEST_ASSERT_TRUE(points.looks >= 95 && points.looks <= 250);
    for (std::size_t k = 0; k < looks.rows(); ++k) {
        const auto level = static_cast<std::size_t>(looks.t_s[k] / 4.0) * 80;
        // Levels that differ by less than 3 % of the largest may be one.
        TEST_ASSERT_DOUBLE_WITHIN(0.03 * 8, log.i_q_A[level], looks.i_q_A[k]);
        TEST_ASSERT_DOUBLE_WITHIN(0.03 * 90, log.w_m_rad_s[level], looks.w_m_rad_s[k]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.2 * looks.t_s[k], looks.temp_winding_C[k]);
    }
}

void a_machine_that_never_settles_has_few(void)
{
    polled_drive::Drawn m;
    m.seconds = 15, m.noise_rad_s = 0.4;
    const auto points = dqw::polled_points({polled_drive::polled(m)});
    std::printf("15 s of waves: %zu looks\n", points.looks);
    TEST_ASSERT_TRUE(points.looks > 0);
}

}  // namespace

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(looks_grow_with_what_lasts);
    RUN_TEST(a_look_is_one_operating_point);
    RUN_TEST(a_machine_that_never_settles_has_few);
    return UNITY_END();
}
