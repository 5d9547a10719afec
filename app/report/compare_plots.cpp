#include "app/report/compare_plots.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "app/base/parameters.hpp"

namespace dqw {
namespace {

constexpr std::size_t most_rows = 2000;
/// No plot shows less than this part of the value; the start of the log, this part of it, may run out of the picture.
constexpr double least_span = 0.01, settling = 0.1;
constexpr double nothing = std::numeric_limits<double>::quiet_NaN();

double value_of(const Result& result, const char* name)
{
    const Estimate* e = find_estimate(result.parameters, name);
    return e ? e->value : nothing;
}

/// Both learners at each time at which one of them learned; what the other knew then is what it read last.
Columns columns_of(const Comparison& c, std::size_t k, double reference)
{
    Columns out(4);
    const auto& [single, fixed] = c.blocks;
    double now[2] = {nothing, nothing};
    for (std::size_t a = 0, b = 0; a < single.size() || b < fixed.size();) {
        const double t = std::min(a < single.size() ? single[a].t_s : HUGE_VAL,
                                  b < fixed.size() ? fixed[b].t_s : HUGE_VAL);
        if (a < single.size() && single[a].t_s <= t) now[0] = single[a++].value[k];
        if (b < fixed.size() && fixed[b].t_s <= t) now[1] = fixed[b++].value[k];
        out[0].push_back(t);
        // Zero is what was never learned.
        for (std::size_t i = 0; i < 2; ++i) out[i + 1].push_back(now[i] == 0.0 ? nothing : now[i]);
        out[3].push_back(reference);
    }
    return out;
}

std::array<double, 2> range_of(const Columns& c)
{
    double low = HUGE_VAL, high = -HUGE_VAL;
    const std::size_t n = c[0].size();
    for (std::size_t k = static_cast<std::size_t>(settling * static_cast<double>(n)); k < n; ++k)
        for (std::size_t i = 1; i < c.size(); ++i)
            if (std::isfinite(c[i][k])) low = std::min(low, c[i][k]), high = std::max(high, c[i][k]);
    return range_around(low, high, least_span * std::max(std::fabs(low), std::fabs(high)));
}

}  // namespace

std::vector<Plot> compare_plots(const Comparison& c)
{
    std::vector<Plot> plots;
    const Regime regime = c.reference.regime;
    const auto& compared = compared_parameters(regime);
    for (std::size_t k = 0; k < compared.size(); ++k) {
        const auto& [name, symbol] = compared[k];
        const double reference = value_of(c.reference, name);
        if (std::isnan(reference) && std::isnan(value_of(c.single, name)) && std::isnan(value_of(c.fixed, name)))
            continue;
        Columns all = columns_of(c, k, reference);
        if (all[0].empty()) continue;
        Plot plot;
        plot.y_range = range_of(all);
        const std::string unit = scale(all, plot.y_range, name);
        plot.title = symbol;
        plot.x_label = regime == Regime::dynamic || regime == Regime::mechanical ||
                               all[0].back() != static_cast<double>(all[0].size() - 1)
                           ? "time [s]"
                           : "time or row";
        plot.y_label = fmt::format("{} [{}]", symbol, unit);
        plot.series = {"float", "Q15"};
        if (std::isfinite(reference))
            plot.series.emplace_back("reference");
        else
            all.pop_back();
        plot.columns = extremes(all, most_rows);
        plots.push_back(std::move(plot));
    }
    return plots;
}

}  // namespace dqw
