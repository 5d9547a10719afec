// Deviations beside a friction that warms, against what fits of drawn shafts are off by.
#include <Eigen/LU>
#include <cmath>
#include <cstdio>
#include <random>

#include "ref/model/warming.hpp"
#include "unity.h"

extern "C" void setUp(void) {}
extern "C" void tearDown(void) {}

namespace {

constexpr double kJ = 1.1e-4, kB = 7e-5, kDry_Nm = 0.03, kStep_s = 0.05;
constexpr int kRows = 400;

struct Off {
    Eigen::Vector3d square = Eigen::Vector3d::Zero(), said = Eigen::Vector3d::Zero(), white = Eigen::Vector3d::Zero();
};

/// One shaft: blocks of slope, speed and direction under levels of torque, fitted by least squares; its friction is
/// 1 + phi tau of what it is on average.
void draw(const std::vector<double>& levels_Nm, double phi, double noise_Nm, std::mt19937_64& random, Off& off)
{
    std::normal_distribution<double> noise(0.0, noise_Nm);
    std::vector<dqw::TimedSum> sums;
    Eigen::MatrixXd x(kRows, 3);
    Eigen::VectorXd y(kRows), when(kRows);
    double w = 0.0;
    for (int k = 0; k < kRows; ++k) {
        const double torque = levels_Nm[static_cast<std::size_t>(k) * levels_Nm.size() / kRows];
        when[k] = (k + 0.5) / kRows - 0.5;
        const double part = 1.0 + phi * when[k], B = part * kB, dry = std::copysign(part * kDry_Nm, torque),
                     end = (torque - dry) / B, decay = std::exp(-B / kJ * kStep_s), next = end + (w - end) * decay;
        x.row(k) << (next - w) / kStep_s, end + (w - end) * (1.0 - decay) * kJ / B / kStep_s,
            std::copysign(1.0, torque);
        y[k] = torque + noise(random), w = next;
    }
    const Eigen::Matrix3d inverse = (x.transpose() * x).inverse();
    const Eigen::Vector3d theta = inverse * (x.transpose() * y), truth(kJ, kB, kDry_Nm);
    const Eigen::VectorXd e = y - x * theta;
    const double noise2 = e.squaredNorm() / (kRows - 3);
    for (int k = 0; k < kRows; ++k) {
        Eigen::Vector4d row;
        row << -x.row(k).transpose(), e[k];
        sums.push_back({when[k], row * row.transpose()});
    }
    const Eigen::Vector3d friction(0.0, theta[1], theta[2]);
    const Eigen::VectorXd more = dqw::warming_deviations(sums, friction, noise2);
    off.square += (theta - truth).cwiseAbs2();
    off.white += noise2 * inverse.diagonal();
    off.said += noise2 * inverse.diagonal() + more.cwiseAbs2();
}

Off drawn(const std::vector<double>& levels_Nm, double warms, double noise_Nm)
{
    std::mt19937_64 random(11);
    std::normal_distribution<double> phi(0.0, warms);
    Off off;
    for (int n = 0; n < 1000; ++n) draw(levels_Nm, phi(random), noise_Nm, random, off);
    std::printf("%zu levels, %.2f: off over said", levels_Nm.size(), warms);
    for (int j = 0; j < 3; ++j) std::printf(" %.2f", std::sqrt(off.square[j] / off.said[j]));
    std::printf(", said over white");
    for (int j = 0; j < 3; ++j) std::printf(" %.2f", std::sqrt(off.said[j] / off.white[j]));
    std::printf("\n");
    return off;
}

/// As a posterior's: the mean square that least squares are off by is the one that is said, where a fall is drawn as it
/// is taken to be.
void what_fits_are_off_by()
{
    for (const std::vector<double>& levels :
         {std::vector<double>{0.045, 0.06}, std::vector<double>{0.05, -0.05, 0.04, -0.045, 0.06, -0.04}}) {
        const Off off = drawn(levels, 0.05, 2e-3);
        for (int j = 0; j < 3; ++j) TEST_ASSERT_DOUBLE_WITHIN(0.1, 1.0, std::sqrt(off.square[j] / off.said[j]));
    }
}

/// Two levels one way: B is three times less sure than white noise has it. To and fro it costs next to nothing.
void what_it_costs()
{
    const Off one_way = drawn({0.045, 0.06}, 0.0, 2e-3),
              to_and_fro = drawn({0.05, -0.05, 0.04, -0.045, 0.06, -0.04}, 0.0, 2e-3);
    TEST_ASSERT_TRUE(one_way.said[1] > 9.0 * one_way.white[1]);
    for (int j = 0; j < 3; ++j) TEST_ASSERT_TRUE(to_and_fro.said[j] < 1.1 * to_and_fro.white[j]);
}

/// A friction of nothing, and rows of nothing, move nothing.
void nothing_is_nothing()
{
    Eigen::MatrixXd gram = Eigen::MatrixXd::Identity(4, 4);
    const Eigen::Vector3d friction(0.0, 1.0, 1.0);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, dqw::warming_deviations({{0.1, gram}}, Eigen::Vector3d::Zero(), 1.0).norm());
    TEST_ASSERT_EQUAL_DOUBLE(0.0, dqw::warming_deviations({{0.1, gram}}, friction, 0.0).norm());
    TEST_ASSERT_EQUAL_DOUBLE(0.0, dqw::warming_deviations({}, friction, 1.0).norm());
}

}  // namespace

int main()
{
    UNITY_BEGIN();
    RUN_TEST(what_fits_are_off_by);
    RUN_TEST(what_it_costs);
    RUN_TEST(nothing_is_nothing);
    return UNITY_END();
}
