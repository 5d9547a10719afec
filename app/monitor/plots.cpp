#include "app/monitor/plots.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/monitor/names.hpp"

namespace dqw {
namespace {

constexpr std::size_t most_rows = 1000, most_stretches = 200, most_marks = 50;
constexpr double in_band = 1.96;  // deviations, 95 %
/// No plot shows less than this part of the healthy value, or noise would fill it.
constexpr double least_span = 0.04;

Columns columns_of(const MonitorRun& run, std::size_t channel)
{
    Columns c(5);
    for (const MonitorPoint& p : run.points) {
        const MonitorReading& r = p.readings[channel];
        const double half = std::isfinite(r.sd) ? in_band * r.sd : 0.0;
        // Sizes are not negative.
        const bool size = channel >= DQW_WATCH_OFFSET && channel < DQW_WATCH_FRICTION;
        const double row[] = {p.t_s, r.value, size ? std::max(r.value - half, 0.0) : r.value - half, r.value + half,
                              r.healthy};
        for (std::size_t k = 0; k < 5; ++k) c[k].push_back(row[k]);
    }
    return c;
}

bool any(const std::vector<double>& column)
{
    return std::any_of(column.begin(), column.end(), [](double x) { return std::isfinite(x); });
}

/// What happens in service; all, where it never was.
std::array<double, 2> range_of(const MonitorRun& run, const Columns& c, bool relative)
{
    double low = HUGE_VAL, high = -HUGE_VAL, healthy = 0.0;
    for (std::size_t k = 0; k < run.points.size(); ++k) {
        if (run.served && !run.points[k].in_service) continue;
        for (const std::size_t column : {std::size_t{2}, std::size_t{3}, std::size_t{4}}) {
            const double x = c[column][k];
            if (std::isfinite(x)) low = std::min(low, x), high = std::max(high, x);
        }
        if (std::isfinite(c[4][k])) healthy = std::max(healthy, std::fabs(c[4][k]));
    }
    return range_around(low, high, relative ? least_span * healthy : 0.0);
}

/// Extremes are found column by column: a band still holds its value.
Columns thinned(const Columns& all)
{
    Columns c = extremes(all, most_rows);
    for (std::size_t k = 0; k < c[0].size(); ++k) {
        c[2][k] = std::min(c[2][k], c[1][k]);
        c[3][k] = std::max(c[3][k], c[1][k]);
    }
    return c;
}

std::vector<std::array<double, 2>> out_of_service(const MonitorRun& run)
{
    std::vector<std::array<double, 2>> out;
    for (std::size_t k = 0; k < run.stages.size(); ++k) {
        if (run.stages[k].name == DQW_STAGE_IN_SERVICE) continue;
        const double from = run.stages[k].from_s, to = k + 1 < run.stages.size() ? run.stages[k + 1].from_s : run.end_s;
        if (!out.empty() && out.back()[1] == from)
            out.back()[1] = to;
        else
            out.push_back({from, to});
    }
    if (out.size() > most_stretches) out.clear();
    return out;
}

}  // namespace

std::vector<Plot> monitor_plots(const MonitorRun& run)
{
    std::vector<Plot> plots;
    for (int channel = 0; channel < DQW_WATCH_CHANNELS; ++channel) {
        Columns c = columns_of(run, static_cast<std::size_t>(channel));
        if (!any(c[1])) continue;
        const MonitorChannel& named = channel_named(channel);
        Plot plot;
        plot.kind = Plot::Kind::band;
        plot.title = capital(named.title);
        plot.y_range = range_of(run, c, channel <= DQW_WATCH_PSI);
        if (channel == DQW_WATCH_RESIDUAL) plot.y_range[0] = 0.0;
        const std::string unit = scale(c, plot.y_range, named.parameter);
        plot.x_label = "time [s]";
        plot.y_label = fmt::format("{} [{}]", named.title, unit);
        plot.series = {"learned"};
        if (any(c[4]))
            plot.series.emplace_back("healthy");
        else
            c.pop_back();
        plot.columns = thinned(c);
        plot.shaded = out_of_service(run);
        for (std::size_t k = 0; k < std::min(run.events.size(), most_marks); ++k)
            plot.marks.emplace_back(run.events[k].t_s, std::to_string(k + 1));
        plots.push_back(std::move(plot));
    }
    return plots;
}

}  // namespace dqw
