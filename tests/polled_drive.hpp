// A drive polled a few times a second: means of the voltage equations by quadrature, over currents and speeds in closed
// form.
#ifndef DQW_TESTS_POLLED_DRIVE_HPP
#define DQW_TESTS_POLLED_DRIVE_HPP

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "ref/log/log.hpp"

namespace polled_drive {

struct Drawn {
    double p = 5, R_ohm = 0.31, Ld_H = 0.4e-3, Lq_H = 0.7e-3, psi_Wb = 0.015, lost_V = 0.0;
    double rate_Hz = 20, seconds = 30, noise_rad_s = 0.0, pace = 1.0;
    int queue = 0;
    bool fan = false, i_d_moves = true;
    unsigned seed = 1;
    // What a drive suffers from change_s on, over 20 s, and by how much a winding warms, half of that its magnet.
    double change_s = 0.0, psi_fall = 0.0, R_rise = 0.0, warm_K = 0.0;
    bool measures_heat = false;

    double grown(double t) const { return std::clamp((t - change_s) / 20.0, 0.0, 1.0); }
    double heat_K(double t) const { return warm_K * (1.0 - std::exp(-t / 120.0)); }
    double R_at(double t) const { return R_ohm * (1.0 + 0.0039 * heat_K(t) + R_rise * grown(t)); }
    double psi_at(double t) const { return psi_Wb * (1.0 - 0.0005 * heat_K(t)) * (1.0 - psi_fall * grown(t)); }
};

/// Slow waves whose frequencies have no common period, so that currents and speed go their own ways.
struct Motion {
    double i_d, i_q, w, di_d, di_q;
};

inline Motion at(const Drawn& m, double t)
{
    const double shift = m.seed;
    const auto wave = [&](double size, double f, double& slope) {
        f *= m.pace;
        slope += size * f * std::cos(f * t + shift);
        return size * std::sin(f * t + shift);
    };
    Motion x{};
    double unused = 0.0;
    x.w = 60 + wave(25, 0.9, unused) + wave(12, 0.37, unused);
    x.i_q = 5 + wave(2.5, 1.7, x.di_q) + wave(1.2, 0.53, x.di_q);
    if (m.i_d_moves) x.i_d = wave(1.5, 1.13, x.di_d);
    if (m.fan) {
        double slope = 0.0;
        x.w = 60 + wave(40, 0.9, slope);
        x.i_q = 0.05 * x.w, x.di_q = 0.05 * slope, x.i_d = x.di_d = 0.0;
    }
    return x;
}

inline dqw::Log polled(const Drawn& m)
{
    std::mt19937 random(m.seed);
    std::normal_distribution<double> normal;
    dqw::Log log;
    log.path = "drawn";
    log.regime = dqw::Regime::polled;
    log.machine.pole_pairs = m.p;
    const double T = 1.0 / m.rate_Hz;
    log.dt_s = T;
    const int parts = 100, n = static_cast<int>(m.seconds * m.rate_Hz);
    std::vector<std::array<double, 4>> means;
    for (int k = 0; k < n; ++k) {
        std::array<double, 4> sum{};
        for (int j = 0; j <= parts; ++j) {
            const double weight = (j == 0 || j == parts ? 1.0 : j % 2 == 1 ? 4.0 : 2.0) / (3.0 * parts);
            const double t = (k + static_cast<double>(j) / parts) * T, R = m.R_at(t);
            const Motion x = at(m, t);
            const double w = m.p * x.w, lost = m.lost_V / std::hypot(x.i_d, x.i_q);
            sum[0] += weight * ((R + lost) * x.i_d + m.Ld_H * x.di_d - w * m.Lq_H * x.i_q);
            sum[1] += weight * ((R + lost) * x.i_q + m.Lq_H * x.di_q + w * (m.Ld_H * x.i_d + m.psi_at(t)));
            sum[2] += weight * x.i_d, sum[3] += weight * x.i_q;
        }
        means.push_back(sum);
    }
    for (int k = m.queue; k < n; ++k) {
        const auto& mean = means[static_cast<std::size_t>(k - m.queue)];
        log.t_s.push_back((k + 1) * T + 1e-3 * normal(random));
        log.v_d_V.push_back(mean[0]), log.v_q_V.push_back(mean[1]);
        log.i_d_A.push_back(mean[2]), log.i_q_A.push_back(mean[3]);
        if (m.measures_heat) log.temp_winding_C.push_back(std::round(25.0 + m.heat_K((k + 0.5) * T)));
        log.w_m_rad_s.push_back(at(m, (k + 1) * T).w + m.noise_rad_s * normal(random));
    }
    return log;
}

/// Its log as a file of dqwatch's own columns.
inline std::string csv(const dqw::Log& log)
{
    std::ostringstream out;
    out.precision(9);
    out << "t_s,v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s" << (log.temp_winding_C.empty() ? "\n" : ",temp_winding_C\n");
    for (std::size_t k = 0; k < log.rows(); ++k) {
        out << log.t_s[k] << ',' << log.v_d_V[k] << ',' << log.v_q_V[k] << ',' << log.i_d_A[k] << ',' << log.i_q_A[k]
            << ',' << log.w_m_rad_s[k];
        if (!log.temp_winding_C.empty()) out << ',' << log.temp_winding_C[k];
        out << '\n';
    }
    return out.str();
}

}  // namespace polled_drive
#endif
