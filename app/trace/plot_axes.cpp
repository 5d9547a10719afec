#include "app/trace/plot_axes.hpp"

#include <algorithm>
#include <cmath>

namespace dqw {
namespace {

constexpr double degrees = 180.0 / 3.14159265358979323846;
constexpr std::size_t most_stretches = 200;

/// Less than this part of the largest value is no range to plot against.
constexpr double least_range = 1e-6;

bool varies(const std::vector<double>& values)
{
    if (values.empty()) return false;
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    return *high - *low > least_range * std::max(std::fabs(*low), std::fabs(*high));
}

}  // namespace

PlotAxis time_axis(const TraceBlocks& blocks, Regime regime)
{
    PlotAxis axis{"time", "time [s]", blocks.t_s, true};
    std::vector<double>& t = axis.values;
    if (!varies(t)) {
        axis.name = "number", axis.label = regime == Regime::steady || regime == Regime::standstill
                                               ? "number of the point [1]"
                                               : "number of the block [1]";
        t.resize(blocks.axes.empty() ? 0 : blocks.axes[0].measured.size());
        for (std::size_t k = 0; k < t.size(); ++k) t[k] = static_cast<double>(k + 1);
        return axis;
    }
    double shift = 0.0, last = t[0];
    bool several = false;
    for (std::size_t k = 1; k < t.size(); ++k) {
        const double step = t[k] - last;
        last = t[k];
        if (step < 0) several = true, shift -= step;
        t[k] += shift;
    }
    if (several) axis.label = "time, logs one after the other [s]";
    // A clock that counts from long ago leaves no digits for what is seen here.
    const double first = t.front(), span = t.back() - first;
    if (std::fabs(first) > 100 * span) {
        axis.label = "time since the first row [s]";
        for (double& value : t) value -= first;
    }
    return axis;
}

std::vector<PlotAxis> plot_axes(const TraceBlocks& blocks, Regime regime)
{
    const bool mechanical = regime == Regime::mechanical;
    std::vector<PlotAxis> all = {{"current i_q", "i_q [A]", blocks.i_q_A, false},
                                 {"current i_d", "i_d [A]", blocks.i_d_A, false},
                                 {mechanical ? "shaft angle" : "electrical angle",
                                  mechanical ? "shaft angle [°]" : "electrical angle [°]", blocks.theta_e_rad, false},
                                 {"speed", "speed w_m [rad/s]", blocks.w_m_rad_s, false},
                                 {"temperature", "temperature [°C]", blocks.temp_C, false},
                                 time_axis(blocks, regime)};
    for (double& angle : all[2].values) {
        angle = std::fmod(angle * degrees, 360.0);
        if (angle < 0) angle += 360.0;
    }
    all.erase(std::remove_if(all.begin(), all.end(), [](const PlotAxis& a) { return !varies(a.values); }), all.end());
    return all;
}

std::vector<std::array<double, 2>> heldout_stretches(const PlotAxis& axis, const std::vector<char>& heldout)
{
    std::vector<std::array<double, 2>> out;
    const std::size_t n = std::min(axis.values.size(), heldout.size());
    for (std::size_t k = 0; k < n; ++k) {
        if (!heldout[k]) continue;
        if (k == 0 || !heldout[k - 1]) out.push_back({axis.values[k], axis.values[k]});
        out.back()[1] = axis.values[std::min(k + 1, n - 1)];
    }
    if (out.size() > most_stretches) out.clear();
    return out;
}

}  // namespace dqw
