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

double largest_error(double offset)
{
    const std::vector<dqw::Log> logs{points()};
    const auto setup = dqw::trace_setup(logs, {});
    dqw::Point at = setup->starts.front();
    at.base = Eigen::Vector4d(kR, kLd, kLq, kPsi);
    dqw::Term bend{{Law::saturation, {kBase_A}}, {}}, cross{{Law::cross_saturation, {kBase_A}}, {}},
        angle{{Law::angle_offset}, {}};
    std::copy(std::begin(kBend_Wb), std::end(kBend_Wb), bend.weights.begin());
    std::copy(std::begin(kCross_Wb), std::end(kCross_Wb), cross.weights.begin());
    angle.weights[0] = offset;
    at.terms = {bend, cross, angle};
    double most = 0.0;
    for (const dqw::ReportBlock& b : setup->full->report(at, 0))
        most = std::max({most, std::abs(b.residual[0]), std::abs(b.residual[1])});
    return most;
}

/// Iron bends in the rotor's frame: the machine's own numbers leave nothing, whatever the angle is off by.
void iron_bends_in_the_rotors_frame()
{
    TEST_ASSERT_TRUE(largest_error(kOffset) < 1e-12);
    // A tenth of a milliradian takes 0.1 mV per volt.
    TEST_ASSERT_TRUE(largest_error(kOffset + 1e-4) > 1e-3);
}

}  // namespace

int main()
{
    UNITY_BEGIN();
    RUN_TEST(iron_bends_in_the_rotors_frame);
    return UNITY_END();
}
