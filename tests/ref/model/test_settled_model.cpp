// The settled model against machines in closed form.
#include <algorithm>
#include <cmath>
#include <complex>

#include "ref/model/settled.hpp"
#include "ref/trace/setup.hpp"
#include "unity.h"

extern "C" void setUp(void) {}
extern "C" void tearDown(void) {}

namespace {

using dqw::Law;
using Complex = std::complex<double>;

constexpr double kR = 0.25, kLd = 0.6e-3, kLq = 0.9e-3, kPsi = 0.016, kSpeed = 300.0, kOffset = 0.05, kBase_A = 8.0;
constexpr int kPolePairs = 4;
constexpr double kBend_Wb[] = {-3e-4, 1e-4, 0.0, -5e-4, 2e-4}, kCross_Wb[] = {-2e-4, 1e-4, 0.0};

/// Of the rotor's currents: the polynomials of (E52), written anew.
Complex flux(Complex i)
{
    const double x = i.real() / kBase_A, y = i.imag() / kBase_A;
    return {kPsi + kLd * i.real() + kBend_Wb[0] * x * x + kBend_Wb[1] * x * x * x + kCross_Wb[0] * y * y +
                2.0 * kCross_Wb[1] * x * y * y,
            kLq * i.imag() + kBend_Wb[3] * y * y * y + kBend_Wb[4] * y * y * y * y * y + 2.0 * kCross_Wb[0] * x * y +
                2.0 * kCross_Wb[1] * x * x * y};
}

/// Settled points as a drive logs them whose angle is ahead of the rotor's by kOffset.
dqw::Log points()
{
    dqw::Log log;
    log.path = "points", log.regime = dqw::Regime::steady, log.machine.pole_pairs = kPolePairs;
    for (int d = -4; d <= 2; ++d)
        for (int q = -4; q <= 4; ++q) {
            const Complex i(d, q), v = kR * i + Complex(0.0, kPolePairs * kSpeed) * flux(i),
                                   ahead = std::polar(1.0, -kOffset);
            log.i_d_A.push_back((i * ahead).real()), log.i_q_A.push_back((i * ahead).imag());
            log.v_d_V.push_back((v * ahead).real()), log.v_q_V.push_back((v * ahead).imag());
            log.w_m_rad_s.push_back(kSpeed);
        }
    return log;
}

/// The machine, its angle off by `offset`, and 0.3 V of an offset more.
dqw::Point point_of(const dqw::TraceSetup& setup, double offset, double more_V)
{
    dqw::Point at = setup.starts.front();
    at.base = Eigen::Vector4d(kR, kLd, kLq, kPsi);
    dqw::Term bend{{Law::saturation, {kBase_A}}, {}}, cross{{Law::cross_saturation, {kBase_A}}, {}},
        angle{{Law::angle_offset}, {}}, more{{Law::voltage_offset}, {}};
    std::copy(std::begin(kBend_Wb), std::end(kBend_Wb), bend.weights.begin());
    std::copy(std::begin(kCross_Wb), std::end(kCross_Wb), cross.weights.begin());
    angle.weights[0] = offset, more.weights[0] = more_V;
    at.terms = {bend, cross, angle, more};
    return at;
}

std::vector<double> left_of(const dqw::TraceSetup& setup, const dqw::Point& at)
{
    std::vector<double> out;
    for (const dqw::ReportBlock& b : setup.full->report(at, 0)) out.insert(out.end(), b.residual, b.residual + 2);
    return out;
}

double largest_error(double offset)
{
    const std::vector<dqw::Log> logs{points()};
    const auto setup = dqw::trace_setup(logs, {});
    double most = 0.0;
    for (double e : left_of(*setup, point_of(*setup, offset, 0.0))) most = std::max(most, std::abs(e));
    return most;
}

/// Iron bends in the rotor's frame: the machine's own numbers leave nothing, whatever the angle is off by.
void iron_bends_in_the_rotors_frame()
{
    TEST_ASSERT_TRUE(largest_error(kOffset) < 1e-12);
    // A tenth of a milliradian takes 0.1 mV per volt.
    TEST_ASSERT_TRUE(largest_error(kOffset + 1e-4) > 1e-3);
}

/// What a step of each number takes of what is left, by differences, is its column.
void columns_are_the_errors_slopes()
{
    const std::vector<dqw::Log> logs{points()};
    const auto setup = dqw::trace_setup(logs, {});
    for (const double offset : {0.0, 0.2}) {
        const dqw::Point at = point_of(*setup, offset, 0.3);
        std::vector<dqw::BlockSum> sums;
        TEST_ASSERT_TRUE(setup->full->pass(at, {}, sums));
        const Eigen::VectorXd values = at.values();
        const Eigen::Index n = values.size();
        Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(n + 1, n + 1), columns;
        for (const dqw::BlockSum& b : sums) gram += b.gram[0] + b.gram[1];
        for (Eigen::Index j = 0; j <= n; ++j) {
            std::vector<double> e = left_of(*setup, at);
            if (j < n) {
                const double step = std::max(1e-5 * std::abs(values[j]), 1e-8);
                dqw::Point more = at, less = at;
                more.set(values + step * Eigen::VectorXd::Unit(n, j)),
                    less.set(values - step * Eigen::VectorXd::Unit(n, j));
                const std::vector<double> up = left_of(*setup, more), down = left_of(*setup, less);
                for (std::size_t k = 0; k < e.size(); ++k) e[k] = (up[k] - down[k]) / (2.0 * step);
            }
            if (j == 0) columns.resize(static_cast<Eigen::Index>(e.size()), n + 1);
            columns.col(j) = Eigen::Map<const Eigen::VectorXd>(e.data(), static_cast<Eigen::Index>(e.size()));
        }
        const Eigen::MatrixXd wanted = columns.transpose() * columns;
        for (Eigen::Index a = 0; a <= n; ++a)
            for (Eigen::Index b = 0; b <= n; ++b)
                TEST_ASSERT_DOUBLE_WITHIN(1e-5 * std::sqrt(wanted(a, a) * wanted(b, b)), wanted(a, b), gram(a, b));
    }
}

}  // namespace

int main()
{
    UNITY_BEGIN();
    RUN_TEST(iron_bends_in_the_rotors_frame);
    RUN_TEST(columns_are_the_errors_slopes);
    return UNITY_END();
}
