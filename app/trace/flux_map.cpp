#include "app/trace/flux_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/base/quantity.hpp"
#include "app/base/text.hpp"
#include "ref/trace/flux_map.hpp"

namespace dqw {

double pole_pairs_of(const TraceResult& trace)
{
    for (const Estimate& e : trace.after.parameters)
        if (e.name == "pole_pairs") return e.value;
    return 0.0;
}

std::string flux_map_csv(const FluxMap& map)
{
    const ShortedTurns& shorted = map.shorted;
    const bool shorts = shorted.conductance_S > 0.0;
    std::string out = "i_d_A,i_q_A,psi_d_Wb,psi_q_Wb,sd_d_Wb,sd_q_Wb,seen";
    out += shorts ? ",short_S,sd_short_S,short_axis_rad\n" : "\n";
    const std::string beside = shorts ? fmt::format(",{:.6g},{:.3g},{:.6g}\n", shorted.conductance_S, shorted.sd_S,
                                                    shorted.axis_rad)
                                      : "\n";
    for (std::size_t d = 0; d < map.i_d_A.size(); ++d)
        for (std::size_t q = 0; q < map.i_q_A.size(); ++q) {
            const FluxNode& n = map.at(d, q);
            out += fmt::format("{:.9g},{:.9g},{:.9g},{:.9g},{:.3g},{:.3g},{}", map.i_d_A[d], map.i_q_A[q], n.psi_d_Wb,
                               n.psi_q_Wb, n.sd_d_Wb, n.sd_q_Wb, n.seen ? 1 : 0) +
                   beside;
        }
    return out;
}

std::string mtpa_csv(const FluxMap& map, double pole_pairs)
{
    std::string out = "torque_Nm,i_d_A,i_q_A,i_A\n";
    for (const LeastCurrent& at : mtpa(map, pole_pairs))
        out += fmt::format("{:.6g},{:.6g},{:.6g},{:.6g}\n", at.torque_Nm, at.i_d_A, at.i_q_A, at.i_A);
    return out;
}

std::string flux_map_text(const TraceResult& trace)
{
    const FluxMap& map = trace.map;
    const bool turns = trace.regime == Regime::dynamic || trace.regime == Regime::steady;
    Vector2 one;
    if (map.empty() && turns && saw_one_current(trace.blocks.i_d_A, trace.blocks.i_q_A, one))
        return with_minus(fmt::format("no flux map: the log saw hardly more than one current (i_d {:.3g} A, i_q {:.3g} "
                                      "A); drive i_d and i_q, each by itself and both at once, at several levels "
                                      "while the machine turns\n",
                                      one.d + 0.0, one.q + 0.0));
    if (map.empty()) {
        const bool bends = std::any_of(trace.effects.begin(), trace.effects.end(), [](const TraceEffect& e) {
            return e.name == "saturation" || e.name == "cross_saturation";
        });
        return bends
                   ? "no flux map: the log does not tell L_d, L_q and ψ beside the saturation; drive i_d and i_q, each "
                     "by itself and both at once, at several levels while the machine turns\n"
                   : "";
    }
    const auto seen = std::count_if(map.nodes.begin(), map.nodes.end(), [](const FluxNode& n) { return n.seen; });
    std::string out = fmt::format(
        "flux map: i_d {:.3g} to {:.3g} A, i_q {:.3g} to {:.3g} A; the log was at {:.0f} % of it\n", map.i_d_A.front(),
        map.i_d_A.back(), map.i_q_A.front(), map.i_q_A.back(),
        100.0 * static_cast<double>(seen) / static_cast<double>(map.nodes.size()));
    const double p = pole_pairs_of(trace);
    if (!(p > 0.0)) return with_minus(out + "no mtpa.csv: the pole pairs are not known (say --pole-pairs)\n");
    const std::vector<LeastCurrent> least = mtpa(map, p);
    if (least.empty())
        return with_minus(out +
                          "no mtpa.csv: the currents of least size for a torque are not among the log's: drive i_d "
                          "and i_q at once\n");
    const LeastCurrent& most = least.back();
    // A hundredth of a percent is no current that is saved, and its i_d none.
    constexpr double kNoMore = 1e-4;
    const double alone = current_without_d(map, p, most.torque_Nm);
    const bool no_d = alone < most.i_A * (1.0 + kNoMore);
    out += fmt::format("{:.3g} Nm takes {:.3g} A at i_d = {:.3g} A, i_q = {:.3g} A", most.torque_Nm, most.i_A,
                       no_d ? 0.0 : most.i_d_A, most.i_q_A);
    if (no_d)
        out += ": i_d = 0 takes no more";
    else if (std::isfinite(alone))
        out += fmt::format("; with i_d = 0 it is {:.3g} A, {:.2g} % more", alone, 100.0 * (alone / most.i_A - 1.0));
    else
        out += "; the log was not where i_d = 0 makes it";
    return with_minus(out + "\n");
}

}  // namespace dqw
