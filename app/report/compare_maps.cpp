#include "app/report/compare_maps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "app/base/quantity.hpp"
#include "app/base/text.hpp"

namespace dqw {

namespace {

ShortDifference short_difference(const ShortedTurns& first, const ShortedTurns& second)
{
    const double change = std::hypot(
        second.conductance_S * std::cos(2 * second.axis_rad) - first.conductance_S * std::cos(2 * first.axis_rad),
        second.conductance_S * std::sin(2 * second.axis_rad) - first.conductance_S * std::sin(2 * first.axis_rad));
    const double sd = std::hypot(first.sd_S, second.sd_S);
    return {change, sd > 0 ? change / sd : 0, first, second};
}

/// Empty where no turns are shorted, or alike in both.
std::string short_sentence(const MapComparison& c)
{
    if (!c.shorts()) return "";
    const auto said = [](const ShortedTurns& s) {
        if (!(s.conductance_S > 0)) return std::string("none");
        return fmt::format("as if by {} across a phase, axis {:.0f}°",
                           with_sd(quantity("_ohm", 1 / s.conductance_S, s.sd_S / std::pow(s.conductance_S, 2))),
                           std::round(s.axis_rad * 180 / M_PI) + 0.0);
    };
    return with_minus(fmt::format("Shorted turns differ by {:.1f} sd: first {}, second {}. ", c.shorted.deviations,
                                  said(c.shorted.first), said(c.shorted.second)));
}

}  // namespace

MapComparison compare_maps(const FluxMap& first, const FluxMap& second)
{
    MapComparison c;
    c.shorted = short_difference(first.shorted, second.shorted);
    for (std::size_t d = 0; d < first.i_d_A.size(); ++d)
        for (std::size_t q = 0; q < first.i_q_A.size(); ++q) {
            const FluxNode& a = first.at(d, q);
            const FluxNode b = between(second, first.i_d_A[d], first.i_q_A[q]);
            if (!a.seen || !b.seen) continue;
            ++c.nodes;
            c.flux_Wb = std::max(c.flux_Wb, std::hypot(a.psi_d_Wb, a.psi_q_Wb));
            const double by[2] = {b.psi_d_Wb - a.psi_d_Wb, b.psi_q_Wb - a.psi_q_Wb},
                         sd[2] = {std::hypot(a.sd_d_Wb, b.sd_d_Wb), std::hypot(a.sd_q_Wb, b.sd_q_Wb)};
            for (std::size_t k = 0; k < 2; ++k) {
                AxisDifference& axis = c.axis[k];
                axis.mean_Wb += by[k], axis.rms_percent += by[k] * by[k];
                if (!(sd[k] > 0)) continue;
                c.deviations = true;
                const double z = std::abs(by[k]) / sd[k];
                axis.beyond_two += z > 2 ? 1 : 0, axis.beyond_three += z > 3 ? 1 : 0;
                if (z > axis.most_deviations)
                    axis.most_deviations = z, axis.i_d_A = first.i_d_A[d] + 0.0, axis.i_q_A = first.i_q_A[q] + 0.0;
            }
        }
    const double n = static_cast<double>(std::max<std::size_t>(c.nodes, 1));
    for (AxisDifference& axis : c.axis) {
        axis.mean_Wb /= n, axis.beyond_two /= n, axis.beyond_three /= n;
        axis.rms_percent = c.flux_Wb > 0 ? 100 * std::sqrt(axis.rms_percent / n) / c.flux_Wb : 0;
    }
    return c;
}

nlohmann::ordered_json compare_maps_json(const MapComparison& c)
{
    nlohmann::ordered_json json = {{"schema", "dqwatch.compare_map/1"}, {"nodes", c.nodes}, {"flux_Wb", c.flux_Wb}};
    if (c.deviations) json["differ"] = c.differ();
    if (c.shorted.deviations > 0)
        json["turn_short"] = {{"first_S", c.shorted.first.conductance_S},
                              {"second_S", c.shorted.second.conductance_S},
                              {"change_S", c.shorted.change_S},
                              {"deviations", c.shorted.deviations}};
    for (std::size_t k = 0; k < 2; ++k) {
        const AxisDifference& axis = c.axis[k];
        nlohmann::ordered_json one = {{"mean_Wb", axis.mean_Wb}, {"rms_percent", axis.rms_percent}};
        if (c.deviations) {
            one["beyond_two"] = axis.beyond_two, one["beyond_three"] = axis.beyond_three;
            one["most_deviations"] = axis.most_deviations;
            one["i_d_A"] = axis.i_d_A, one["i_q_A"] = axis.i_q_A;
        }
        json[k == 0 ? "psi_d" : "psi_q"] = one;
    }
    return json;
}

std::string compare_maps_sentence(const MapComparison& c)
{
    const std::string shorted = short_sentence(c);
    if (c.nodes == 0)
        return shorted + "The maps have no current in common that both logs saw: drive both machines alike.";
    const char* verdict = !c.deviations     ? "The maps say nothing of their deviations."
                          : c.bends_apart() ? "The maps differ."
                                            : "The maps do not differ by more than their deviations.";
    return fmt::format("{}{} {} points that both saw, flux up to {}", shorted, verdict, c.nodes,
                       with_sd(quantity("_Wb", c.flux_Wb, 0.0, 3)));
}

std::vector<std::vector<std::string>> compare_maps_rows(const MapComparison& c)
{
    std::vector<std::vector<std::string>> rows = {{"second less first", "mean", "RMS"}};
    if (c.deviations) rows.front().insert(rows.front().end(), {"beyond 2 sd", "beyond 3 sd", "most", "at"});
    for (std::size_t k = 0; k < 2; ++k) {
        const AxisDifference& axis = c.axis[k];
        rows.push_back({k == 0 ? "ψ_d" : "ψ_q", with_sd(quantity("_Wb", axis.mean_Wb, 0.0, 3)),
                        fmt::format("{:.2g} %", axis.rms_percent)});
        if (c.deviations)
            rows.back().insert(rows.back().end(), {fmt::format("{:.0f} %", 100 * axis.beyond_two),
                                                   fmt::format("{:.0f} %", 100 * axis.beyond_three),
                                                   fmt::format("{:.1f} sd", axis.most_deviations),
                                                   fmt::format("i_d {:.3g} A, i_q {:.3g} A", axis.i_d_A, axis.i_q_A)});
    }
    for (auto& row : rows)
        for (auto& cell : row) cell = with_minus(cell);
    return rows;
}

std::string compare_maps_text(const MapComparison& c)
{
    return compare_maps_sentence(c) + "\n" + (c.nodes > 0 ? "\n" + table(compare_maps_rows(c)) : "");
}

}  // namespace dqw
