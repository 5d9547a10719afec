// Means under hats against integrals by hand.
#include <cmath>
#include <random>

#include "ref/model/hat.hpp"
#include "unity.h"

extern "C" void setUp(void) {}
extern "C" void tearDown(void) {}

namespace {

using dqw::Hat;
using dqw::Log;
using dqw::Piece;

Log timed(const std::vector<double>& t_s)
{
    Log log;
    log.path = "hat.csv";
    log.regime = dqw::Regime::mechanical;
    log.t_s = t_s, log.dt_s = t_s[1] - t_s[0];
    return log;
}

/// A straight line's mean is where the hat's middle of gravity lies, (2 a + b)/3 of the way for halves a and b; a bent
/// one is straight from row to row.
void means_and_slopes()
{
    const Log log = timed({0.0, 0.1, 0.3, 0.4, 0.8, 1.0});
    const Piece uneven{&log, 0, 6, 0.0};
    const Hat hat(uneven, 0, 2);
    // Rises over 0.3 s, falls over 0.5 s.
    const double middle = (0.3 + 0.0 + 0.8) / 3.0;
    std::vector<double> ones(5, 1.0), line, bent{0.0, 0.0, 1.0, 0.0, 0.0};
    for (std::size_t r = 0; r < 5; ++r) line.push_back(3.0 * log.t_s[r] - 1.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.0, hat.mean_of(ones.data()));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0, hat.slope_of(ones.data()));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 3.0 * middle - 1.0, hat.mean_of(line.data()));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 3.0, hat.slope_of(line.data()));
    // The integral of two straight lines' product from 0.1 to 0.3 and from 0.3 to 0.4, over the hat's 0.4.
    const double at_1 = 0.1 / 0.3, at_3 = 0.8;
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, (0.2 * (at_1 + 2.0) / 6.0 + 0.1 * (2.0 + at_3) / 6.0) / 0.4,
                              hat.mean_of(bent.data()));
    // Mean of the first half 0.1/0.3, of the second 0.05/0.5; a hat's halves on average 0.4 s apart.
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, (0.05 / 0.5 - 0.1 / 0.3) / 0.4, hat.slope_of(bent.data()));
}

/// Hats follow one another by half of one, and none reaches beyond the end.
void each_from_the_middle_of_the_last()
{
    std::vector<double> t_s;
    for (int k = 0; k < 50; ++k) t_s.push_back(1e-3 * k);
    const Log log = timed(t_s);
    const Piece even{&log, 0, 50, 1e-3};
    std::vector<std::size_t> begun;
    dqw::each_hat(even, 5, 46, 10, [&](std::size_t k, const Hat& hat) {
        begun.push_back(k);
        TEST_ASSERT_EQUAL_size_t(21, hat.mean.size());
    });
    TEST_ASSERT_EQUAL_size_t(3, begun.size());
    TEST_ASSERT_EQUAL_size_t(25, begun.back());
    dqw::each_hat(even, 5, 25, 10, [&](std::size_t, const Hat&) { TEST_FAIL_MESSAGE("a hat beyond the end"); });
}

struct Motion {
    double hertz = 1.0, noise_rad_s = 0.0, coarse_rad = 0.0;
};

/// To and fro at 100 rad/s for 20 s; a speed of angles in coarse steps is a difference of them.
dqw::HatChoice chosen(const Motion& m, double dt_s = 1e-3)
{
    Log log = timed({0.0, dt_s});
    log.t_s.clear();
    std::mt19937_64 random(7);
    std::normal_distribution<double> draw(0.0, 1.0);
    const double w_e = 2.0 * M_PI * m.hertz;
    double last = 0.0;
    for (int k = 0; k < 20.0 / dt_s; ++k) {
        const double t = dt_s * k;
        double w = 100.0 * std::sin(w_e * t);
        if (m.coarse_rad > 0.0) {
            const double angle = m.coarse_rad * std::floor(100.0 / w_e * (1.0 - std::cos(w_e * t)) / m.coarse_rad);
            w = (angle - last) / dt_s, last = angle;
        }
        log.t_s.push_back(t), log.w_m_rad_s.push_back(w + m.noise_rad_s * draw(random));
    }
    return dqw::choose_hat(dqw::pieces_of(log, 2), 1.0);
}

/// White noise of 10 rad/s has 2 (10/0.025)^2/25 of the slopes' (2 pi f 100)^2/2 at 25 ms, 6.5 % at 1 Hz; an eighth at
/// each doubling: 0.8 % at 50 ms, 0.1 % at 100 ms. Coarse angles leave next to none.
void as_long_as_noise_asks()
{
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 25e-3, chosen({1.0, 0.0, 0.0}).half_s);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 25e-3, chosen({1.0, 0.0, 6e-4}).half_s);
    const dqw::HatChoice noisy = chosen({1.0, 10.0, 0.0});
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 100e-3, noisy.half_s);
    TEST_ASSERT_DOUBLE_WITHIN(2e-4, 1e-3, noisy.noise_part);
}

/// A longer hat would lose a motion of 10 Hz: 25 ms stay, and the noise that is left is told, 2 (10/0.025)^2/25 of
/// (2 pi 1000)^2/2 less what the hat itself takes, (sin x/x)^4 at x = 0.25 pi: 0.1 %.
void no_longer_than_motion_allows()
{
    const dqw::HatChoice fast = chosen({10.0, 0.0, 0.0}), noisy = chosen({10.0, 20.0, 0.0});
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 25e-3, fast.half_s);
    TEST_ASSERT_TRUE(fast.noise_part < 1e-3);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 25e-3, noisy.half_s);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 4.0 * 25600.0 / 2.0 / (1.97e7 * 0.656), noisy.noise_part);
}

/// At 10 Hz the shortest hat is one row, and the next two: an eighth of the noise is left in these as well.
void rows_that_are_rare()
{
    const dqw::HatChoice quiet = chosen({0.02, 0.0, 0.0}, 0.1), noisy = chosen({0.02, 1.0, 0.0}, 0.1);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.1, quiet.half_s);
    TEST_ASSERT_TRUE(noisy.half_s >= 0.4 && noisy.noise_part < 0.02);
}

}  // namespace

int main()
{
    UNITY_BEGIN();
    RUN_TEST(means_and_slopes);
    RUN_TEST(each_from_the_middle_of_the_last);
    RUN_TEST(as_long_as_noise_asks);
    RUN_TEST(no_longer_than_motion_allows);
    RUN_TEST(rows_that_are_rare);
    return UNITY_END();
}
