// An independent machine for the tests of ref/: the stationary frame, Runge-Kutta, many sub-steps. No code of ref/.
#ifndef DQW_TEST_REF_MACHINE_HPP
#define DQW_TEST_REF_MACHINE_HPP

#include <cmath>
#include <complex>
#include <functional>
#include <random>
#include <vector>

#include "ref/log/log.hpp"
#include "ref/log/result.hpp"

namespace machine {

using dqw::Log;
using Complex = std::complex<double>;

struct Plant {
    double R_ohm = 0.5, Ld_H = 1.0e-3, Lq_H = 1.4e-3, psi_Wb = 0.02, p = 4;
    double dead_time_V = 0.0;  ///< lost by each phase against its current, and not logged
};

struct Run {
    std::size_t rows = 20000;
    double dt_s = 1e-4;
    std::function<double(double)> speed_rad_s = [](double t) {
        return 60 + 40 * std::sin(5 * t) + 10 * std::sin(31 * t);
    };
    double v_d_V = 2.0, v_q_V = 3.0;  ///< amplitude of the random reference beside the induced voltage
    std::size_t hold = 37;            ///< rows that a reference is held
    unsigned seed = 1;
    int substeps = 50;
    double uneven = 0.0;       ///< every other period is longer by this fraction
    double induced_Wb = -1.0;  ///< flux linkage that the reference makes up for; negative: the plant's
};

inline Complex turned(double angle) { return {std::cos(angle), std::sin(angle)}; }

/// Currents in the rotor's frame of a stator flux seen from the stator.
inline Complex current(const Plant& m, Complex psi, double theta_e)
{
    const Complex rotor = psi * turned(-theta_e);
    return {(rotor.real() - m.psi_Wb) / m.Ld_H, rotor.imag() / m.Lq_H};
}

/// Stationary-frame vector of a voltage of each phase that opposes its current.
inline Complex dead_time(const Plant& m, Complex i)
{
    Complex sum = 0.0;
    for (double axis : {0.0, 2.0943951023931953, -2.0943951023931953}) {
        const double phase = i.real() * std::cos(axis) + i.imag() * std::sin(axis);
        sum += 2.0 / 3.0 * m.dead_time_V * std::tanh(phase / 0.1) * turned(axis);
    }
    return sum;
}

/// A dynamic log: random voltages about the steady voltage of zero current, held in the stationary frame.
inline Log simulate(const Plant& m, const Run& run)
{
    Log log;
    log.path = "test.csv";
    log.dt_s = run.dt_s;
    std::mt19937_64 random(run.seed);
    std::uniform_real_distribution<double> draw(-1.0, 1.0);
    Complex psi = m.psi_Wb;
    double theta = 0.0, add_d = 0.0, add_q = 0.0;
    // The angle goes by Simpson's rule on half sub-steps: RK4 needs it at the middle of each.
    double t = 0.0;
    for (std::size_t k = 0; k < run.rows; ++k) {
        const double dt = run.dt_s * (k % 2 == 1 ? 1.0 + run.uneven : 1.0);
        const double h = dt / run.substeps;
        const double w = m.p * run.speed_rad_s(t);
        const Complex i = current(m, psi, theta);
        log.t_s.push_back(t);
        log.i_d_A.push_back(i.real());
        log.i_q_A.push_back(i.imag());
        log.w_m_rad_s.push_back(run.speed_rad_s(t));
        if (k % run.hold == 0) add_d = run.v_d_V * draw(random), add_q = run.v_q_V * draw(random);
        const double w_mid = m.p * run.speed_rad_s(t + 0.5 * dt);
        const Complex reference(add_d, add_q + w * (run.induced_Wb < 0.0 ? m.psi_Wb : run.induced_Wb));
        const Complex held = reference * turned(theta + 0.5 * w_mid * dt);
        const Complex lost = dead_time(m, current(m, psi, theta) * turned(theta));
        const auto slope = [&](Complex x, double angle) {
            return held - lost - m.R_ohm * current(m, x, angle) * turned(angle);
        };
        Complex mean = 0.0;
        for (int s = 0; s < run.substeps; ++s) {
            const double t0 = t + s * h;
            const double w0 = m.p * run.speed_rad_s(t0), w1 = m.p * run.speed_rad_s(t0 + 0.25 * h),
                         w2 = m.p * run.speed_rad_s(t0 + 0.5 * h), w3 = m.p * run.speed_rad_s(t0 + 0.75 * h),
                         w4 = m.p * run.speed_rad_s(t0 + h);
            const double half = theta + h / 12.0 * (w0 + 4.0 * w1 + w2);
            const double full = half + h / 12.0 * (w2 + 4.0 * w3 + w4);
            const Complex k1 = slope(psi, theta), k2 = slope(psi + 0.5 * h * k1, half),
                          k3 = slope(psi + 0.5 * h * k2, half), k4 = slope(psi + h * k3, full);
            mean += held * (turned(-theta) + 4.0 * turned(-half) + turned(-full)) / 6.0;
            psi += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
            theta = full;
        }
        t += dt;
        mean /= static_cast<double>(run.substeps);
        log.v_d_V.push_back(mean.real());
        log.v_q_V.push_back(mean.imag());
    }
    return log;
}

inline double standard_deviation(const std::vector<double>& x)
{
    double mean = 0.0, sum = 0.0;
    for (double v : x) mean += v;
    mean /= static_cast<double>(x.size());
    for (double v : x) sum += (v - mean) * (v - mean);
    return std::sqrt(sum / static_cast<double>(x.size()));
}

/// White noise of `fraction` of the column's standard deviation; returns its own.
inline double add_noise(std::vector<double>& x, double fraction, unsigned seed)
{
    const double sigma = fraction * standard_deviation(x);
    std::mt19937_64 random(seed);
    std::normal_distribution<double> draw(0.0, sigma);
    for (double& v : x) v += draw(random);
    return sigma;
}

/// The value of a parameter, or NaN where the result has none.
inline double value(const dqw::Result& result, const char* name)
{
    for (const dqw::Estimate& e : result.parameters)
        if (e.name == name) return e.value;
    return std::nan("");
}

inline double sd(const dqw::Result& result, const char* name)
{
    for (const dqw::Estimate& e : result.parameters)
        if (e.name == name) return e.sd;
    return std::nan("");
}

inline bool has(const dqw::Result& result, const char* name)
{
    for (const dqw::Estimate& e : result.parameters)
        if (e.name == name) return true;
    return false;
}

/// The reason why a parameter has no value; null where it is not listed so.
inline const dqw::NotIdentifiable* missing(const dqw::Result& result, const char* name)
{
    for (const dqw::NotIdentifiable& n : result.not_identifiable)
        if (n.name == name) return &n;
    return nullptr;
}

}  // namespace machine
#endif
