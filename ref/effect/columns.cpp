#include "ref/effect/columns.hpp"

#include <cmath>

namespace dqw {

TraceColumns trace_columns(const Log& log, double pole_pairs, double i_base_A, double span_s)
{
    TraceColumns c;
    const std::size_t rows = log.rows();
    c.cos_e.resize(rows), c.sin_e.resize(rows);
    double integrated = 0.0;
    for (std::size_t k = 0; k < rows; ++k) {
        if (k > 0 && !log.t_s.empty() && !log.w_m_rad_s.empty())
            integrated += pole_pairs * 0.5 * (log.w_m_rad_s[k] + log.w_m_rad_s[k - 1]) * (log.t_s[k] - log.t_s[k - 1]);
        double angle = integrated;
        if (!log.theta_m_rad.empty()) angle = pole_pairs * log.theta_m_rad[k];
        if (!log.theta_e_rad.empty()) angle = log.theta_e_rad[k];
        c.cos_e[k] = std::cos(angle), c.sin_e[k] = std::sin(angle);
    }
    for (double t : log.temp_winding_C) c.winding_K.push_back(t - kReferenceTemperature_C);
    for (double t : log.temp_magnet_C) c.magnet_K.push_back(t - kReferenceTemperature_C);
    if (log.t_s.empty() || !(span_s > 0.0)) return c;
    for (double part : kHeatTimes) {
        std::vector<double> h(rows);
        const double tau = part * span_s;
        for (std::size_t k = 1; k < rows; ++k) {
            const auto square = [&](const std::vector<double>& i) {
                return i.empty() ? 0.0 : i[k - 1] * i[k - 1] / (i_base_A * i_base_A);
            };
            const double z = (log.t_s[k] - log.t_s[k - 1]) / tau, kept = std::exp(-z);
            h[k] = kept * h[k - 1] + (1.0 - kept) * (square(log.i_d_A) + square(log.i_q_A));
        }
        c.heat.push_back(std::move(h));
    }
    return c;
}

double heat_at(const TraceColumns& columns, const Input& input, std::size_t k)
{
    // The magnet follows the winding where it has no thermometer of its own.
    if (input.heat < 0) return columns.winding_K[k];
    if (input.heat > 0) return columns.heat[static_cast<std::size_t>(input.heat - 1)][k];
    if (input.law == Law::winding_temperature) return columns.winding_K[k];
    if (input.law == Law::magnet_temperature) return columns.magnet_K[k];
    return 0.0;
}

}  // namespace dqw
