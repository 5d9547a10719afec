#include "app/trace/map_plots.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/base/text.hpp"

namespace dqw {
namespace {

struct Prefix {
    double times;
    const char* name;
};

/// Of numbers as large as that one: ticks of H are alike in their first digits.
Prefix prefix_of(double size)
{
    if (!(size > 0.0) || size >= 0.5) return {1.0, ""};
    return size >= 0.5e-3 ? Prefix{1e3, "m"} : Prefix{1e6, "µ"};
}

/// One quantity over one current, at none, half and most of the other that the log saw.
Plot over_current(const FluxMap& map, bool over_d, const char* name, const char* unit, double FluxNode::*value,
                  double FluxNode::*sd)
{
    const std::vector<double>&x = over_d ? map.i_d_A : map.i_q_A, &other = over_d ? map.i_q_A : map.i_d_A;
    const auto node = [&](std::size_t a, std::size_t b) -> const FluxNode& {
        return over_d ? map.at(a, b) : map.at(b, a);
    };
    const auto zero = static_cast<std::size_t>(
        std::min_element(other.begin(), other.end(), [](double a, double b) { return std::abs(a) < std::abs(b); }) -
        other.begin());
    // The farthest of which the log saw some stretch; of two sides alike the upper.
    constexpr int kStretch = 3;
    std::size_t most = zero;
    for (std::size_t b = 0; b < other.size(); ++b) {
        int seen = 0;
        for (std::size_t a = 0; a < x.size(); ++a) seen += node(a, b).seen ? 1 : 0;
        if (seen >= kStretch && std::abs(other[b]) >= std::abs(other[most])) most = b;
    }
    const std::size_t at[3] = {zero, (zero + most) / 2, most};
    Plot plot;
    plot.kind = Plot::Kind::bands;
    plot.title = with_minus(fmt::format("{} over {} at {} = {:.3g} (none), {:.3g} (half), {:.3g} A (most)", name,
                                        over_d ? "i_d" : "i_q", over_d ? "i_q" : "i_d", other[at[0]] + 0.0,
                                        other[at[1]], other[at[2]]));
    plot.x_label = over_d ? "i_d [A]" : "i_q [A]";
    double largest = 0.0;
    for (const FluxNode& n : map.nodes)
        if (n.seen && std::isfinite(n.*value)) largest = std::max(largest, std::abs(n.*value));
    const Prefix prefix = prefix_of(largest);
    plot.y_label = fmt::format("{} [{}{}]", name, prefix.name, unit);
    plot.series = {"none", "half", "most"};
    plot.columns.resize(1 + 3 * plot.series.size());
    for (std::size_t a = 0; a < x.size(); ++a) {
        plot.columns[0].push_back(x[a]);
        for (std::size_t k = 0; k < plot.series.size(); ++k) {
            const FluxNode& n = node(a, at[k]);
            const double v = n.seen ? prefix.times * n.*value : std::nan(""), wide = 2.0 * prefix.times * n.*sd;
            plot.columns[1 + 3 * k].push_back(v);
            plot.columns[2 + 3 * k].push_back(v - wide), plot.columns[3 + 3 * k].push_back(v + wide);
        }
    }
    return plot;
}

/// At the first's nodes; seen where both are.
FluxMap difference(const FluxMap& first, const FluxMap& second)
{
    FluxMap out = first;
    for (std::size_t d = 0; d < out.i_d_A.size(); ++d)
        for (std::size_t q = 0; q < out.i_q_A.size(); ++q) {
            FluxNode& n = out.nodes[d * out.i_q_A.size() + q];
            const FluxNode b = between(second, out.i_d_A[d], out.i_q_A[q]);
            n.psi_d_Wb = b.psi_d_Wb - n.psi_d_Wb, n.psi_q_Wb = b.psi_q_Wb - n.psi_q_Wb;
            n.sd_d_Wb = std::hypot(n.sd_d_Wb, b.sd_d_Wb), n.sd_q_Wb = std::hypot(n.sd_q_Wb, b.sd_q_Wb);
            n.seen = n.seen && b.seen;
        }
    return out;
}

}  // namespace

PlotGroup difference_group(const FluxMap& first, const FluxMap& second)
{
    const FluxMap apart = difference(first, second);
    PlotGroup group{"Where they differ", "Second less first where both logs were, within two deviations.", {}};
    if (std::none_of(apart.nodes.begin(), apart.nodes.end(), [](const FluxNode& n) { return n.seen; })) return group;
    group.plots = {over_current(apart, true, "Δψ_d", "Wb", &FluxNode::psi_d_Wb, &FluxNode::sd_d_Wb),
                   over_current(apart, false, "Δψ_q", "Wb", &FluxNode::psi_q_Wb, &FluxNode::sd_q_Wb)};
    return group;
}

PlotGroup map_group(const FluxMap& map)
{
    PlotGroup group{
        "Flux map",
        "Flux linkage and incremental inductance where the log was, within two deviations. flux_map.csv has "
        "them over the whole plane.",
        {}};
    if (map.empty()) return group;
    group.plots = {over_current(map, true, "ψ_d", "Wb", &FluxNode::psi_d_Wb, &FluxNode::sd_d_Wb),
                   over_current(map, false, "ψ_q", "Wb", &FluxNode::psi_q_Wb, &FluxNode::sd_q_Wb),
                   over_current(map, true, "L_dd", "H", &FluxNode::L_dd_H, &FluxNode::sd_dd_H),
                   over_current(map, false, "L_qq", "H", &FluxNode::L_qq_H, &FluxNode::sd_qq_H)};
    return group;
}

}  // namespace dqw
