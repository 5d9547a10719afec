#include "app/read/join.hpp"

#include <algorithm>
#include <cmath>

#include "app/base/columns.hpp"
#include "app/read/time_base.hpp"

namespace dqw {
namespace {

std::size_t keep(Log& log, const std::vector<bool>& kept)
{
    const std::size_t rows = kept.size();
    for (const ColumnInfo& column : columns) {
        auto& values = log.*(column.values);
        if (values.empty()) continue;
        std::size_t to = 0;
        for (std::size_t k = 0; k < rows; ++k)
            if (kept[k]) values[to++] = values[k];
        values.resize(to);
    }
    log.segments = {0};
    return rows - static_cast<std::size_t>(std::count(kept.begin(), kept.end(), true));
}

double rms(const std::vector<double>& x)
{
    double sum = 0;
    for (const double v : x) sum += v * v;
    return x.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(x.size()));
}

}  // namespace

std::size_t join_voltages(Log& stats, const Log& control)
{
    const double longest_s = std::max(time_base_of(stats.t_s, Clock::host).median_s,
                                      time_base_of(control.t_s, Clock::host).median_s);
    const std::size_t rows = stats.t_s.size();
    std::vector<bool> kept(rows, false);
    stats.v_d_V.assign(rows, 0.0), stats.v_q_V.assign(rows, 0.0);
    std::size_t near = 0;
    for (std::size_t k = 0; k < rows; ++k) {
        const auto apart = [&](std::size_t j) { return std::fabs(control.t_s[j] - stats.t_s[k]); };
        while (near + 1 < control.t_s.size() && apart(near + 1) <= apart(near)) ++near;
        kept[k] = apart(near) <= longest_s;
        stats.v_d_V[k] = control.v_d_V[near], stats.v_q_V[k] = control.v_q_V[near];
    }
    return keep(stats, kept);
}

std::size_t keep_settled(Log& log)
{
    constexpr double of_speed = 0.02, of_voltage = 0.03;
    const std::size_t rows = log.t_s.size();
    if (log.w_m_rad_s.size() != rows || log.v_d_V.size() != rows || log.v_q_V.size() != rows) return 0;
    const double w = of_speed * rms(log.w_m_rad_s), v = of_voltage * std::hypot(rms(log.v_d_V), rms(log.v_q_V));
    std::vector<bool> kept(rows, true);
    for (std::size_t k = 1; k < rows; ++k) {
        const bool alike = std::fabs(log.w_m_rad_s[k] - log.w_m_rad_s[k - 1]) <= w &&
                           std::hypot(log.v_d_V[k] - log.v_d_V[k - 1], log.v_q_V[k] - log.v_q_V[k - 1]) <= v;
        if (!alike) kept[k] = kept[k - 1] = false;
    }
    return keep(log, kept);
}

}  // namespace dqw
