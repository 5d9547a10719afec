#include "app/trace/plots.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "app/trace/map_plots.hpp"
#include "app/trace/plot_axes.hpp"

namespace dqw {
namespace {

constexpr std::size_t most_rows = 2000, most_points = 1500;
/// Blocks in a close-up: few enough to tell lines apart.
constexpr std::size_t close_blocks = 120;

std::string axis_text(const TraceAxisBlocks& axis) { return axis.axis == "torque" ? "torque" : axis.axis + " axis"; }

Columns residuals(const std::vector<double>& x, const TraceAxisBlocks& axis)
{
    Columns columns(3);
    const std::size_t n = std::min({x.size(), axis.residual_before.size(), axis.residual_after.size()});
    for (std::size_t k = 0; k < n; ++k) {
        if (!std::isfinite(x[k]) || !std::isfinite(axis.residual_before[k]) || !std::isfinite(axis.residual_after[k]))
            continue;
        columns[0].push_back(x[k]);
        columns[1].push_back(axis.residual_before[k]);
        columns[2].push_back(axis.residual_after[k]);
    }
    return columns;
}

/// Where nothing was found there is no after: it would only cover what it repeats.
void drop_after(Plot& plot, const TraceResult& trace)
{
    if (!trace.effects.empty()) return;
    plot.series.pop_back();
    plot.series.back() = plot.series.size() > 1 ? "predicted" : "residual";
    if (!plot.columns.empty()) plot.columns.pop_back();
    if (!plot.means.empty()) plot.means.pop_back();
}

/// Bins of a few rows show chance, not the mean; the settled points of a short log are means themselves.
Columns means_of(const Columns& columns)
{
    const std::size_t n = columns[0].size(), bins = n < 200 ? 40 : std::clamp<std::size_t>(n / 16, 8, 48);
    return bin_means(columns, bins, std::min<std::size_t>(4, 1 + n / (4 * bins)));
}

Plot against(const PlotAxis& x, const TraceAxisBlocks& axis, const TraceResult& trace)
{
    Plot plot;
    plot.title = fmt::format("Residual against {}, {}", x.name, axis_text(axis));
    plot.x_label = x.label;
    plot.y_label = fmt::format("residual, {} [{}]", axis_text(axis), trace.unit);
    plot.series = {"before", "after"};
    const Columns columns = residuals(x.values, axis);
    if (x.ordered) {
        plot.columns = extremes(columns, most_rows);
        plot.shaded = heldout_stretches(x, trace.blocks.heldout);
        drop_after(plot, trace);
        return plot;
    }
    plot.kind = Plot::Kind::points;
    plot.columns = sampled(columns, most_points);
    plot.means = means_of(columns);
    drop_after(plot, trace);
    return plot;
}

/// How much of the residual goes with x: variance of the means of as many rows each, in order of x; less of it after
/// than before, or all of it where nothing was found. A few rows far from the others count as the few that they are.
double explained(const Columns& columns, bool effects_found)
{
    const std::size_t n = columns[0].size(), bins = std::clamp<std::size_t>(n / 16, 8, 48);
    if (n < bins) return -HUGE_VAL;
    std::vector<std::size_t> order(n);
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return columns[0][a] < columns[0][b]; });
    const auto variance_of_means = [&](const std::vector<double>& values) {
        double sum = 0.0, squares = 0.0;
        for (std::size_t bin = 0; bin < bins; ++bin) {
            const std::size_t begin = bin * n / bins, end = (bin + 1) * n / bins;
            double mean = 0.0;
            for (std::size_t k = begin; k < end; ++k) mean += values[order[k]] / static_cast<double>(end - begin);
            sum += mean, squares += mean * mean;
        }
        const double count = static_cast<double>(bins);
        return squares / count - sum / count * (sum / count);
    };
    return variance_of_means(columns[1]) - (effects_found ? variance_of_means(columns[2]) : 0.0);
}

Columns measured_and_predicted(const std::vector<double>& x, const TraceAxisBlocks& axis, std::size_t begin,
                               std::size_t end)
{
    Columns columns(4);
    for (std::size_t k = begin; k < end; ++k) {
        columns[0].push_back(x[k]);
        columns[1].push_back(axis.measured[k]);
        columns[2].push_back(axis.measured[k] - axis.residual_before[k]);
        columns[3].push_back(axis.measured[k] - axis.residual_after[k]);
    }
    return columns;
}

/// Where the plain model errs most, among blocks that no fit saw where that is known.
std::size_t worst_stretch(const TraceAxisBlocks& axis, const std::vector<char>& heldout)
{
    const std::size_t n = axis.residual_before.size();
    double sum = 0.0, most = -1.0;
    std::size_t at = 0;
    const auto square = [&](std::size_t k) {
        const bool seen = k < heldout.size() && !heldout[k];
        return seen ? 0.0 : axis.residual_before[k] * axis.residual_before[k];
    };
    for (std::size_t k = 0; k < n; ++k) {
        sum += square(k);
        if (k >= close_blocks) sum -= square(k - close_blocks);
        if (k + 1 >= close_blocks && sum > most) most = sum, at = k + 1 - close_blocks;
    }
    return at;
}

PlotGroup predictions(const TraceResult& trace)
{
    PlotGroup group{"Measured and predicted",
                    "Block means. The close-ups show where the plain model errs most among the rows that no fit saw.",
                    {}};
    const PlotAxis time = time_axis(trace.blocks, trace.regime);
    for (const bool close : {true, false})
        for (const TraceAxisBlocks& axis : trace.blocks.axes) {
            const std::size_t n = std::min(
                {time.values.size(), axis.measured.size(), axis.residual_before.size(), axis.residual_after.size()});
            if (n == 0 || (close && n < 2 * close_blocks)) continue;
            const std::size_t begin = close ? worst_stretch(axis, trace.blocks.heldout) : 0;
            Plot plot;
            plot.title = fmt::format("{}, {}", close ? "Close-up" : "Whole log", axis_text(axis));
            plot.x_label = time.label;
            plot.y_label = fmt::format("{} [{}]", trace.unit == "V" ? "voltage, " + axis_text(axis) : "torque",
                                       trace.unit);
            plot.series = {"measured", "before", "after"};
            plot.columns = extremes(measured_and_predicted(time.values, axis, begin, close ? begin + close_blocks : n),
                                    most_rows);
            if (!close) plot.shaded = heldout_stretches(time, trace.blocks.heldout);
            drop_after(plot, trace);
            group.plots.push_back(plot);
        }
    return group;
}

PlotGroup residual_group(const TraceResult& trace)
{
    PlotGroup group{"Residual",
                    "Dots are blocks, drawn at random where there are many; lines are means of all of them. Shaded: "
                    "rows that no fit saw.",
                    {}};
    for (const PlotAxis& x : plot_axes(trace.blocks, trace.regime))
        for (const TraceAxisBlocks& axis : trace.blocks.axes) group.plots.push_back(against(x, axis, trace));
    return group;
}

Plot spectrum(const std::string& axis, const TraceResult& trace, const char* over, const std::string& x_label,
              const Columns& columns)
{
    Plot plot;
    const std::string text = axis == "torque" ? "torque" : axis + " axis";
    plot.title = fmt::format("Amplitude over {}, {}", over, text);
    plot.x_label = x_label;
    plot.y_label = fmt::format("amplitude, {} [{}]", text, trace.unit);
    plot.series = {"before", "after"};
    plot.kind = columns[0].size() <= 200 ? Plot::Kind::bars : Plot::Kind::lines;
    plot.log_y = plot.kind == Plot::Kind::lines;
    plot.columns = extremes(columns, most_rows);
    drop_after(plot, trace);
    return plot;
}

PlotGroup spectra(const TraceResult& trace)
{
    PlotGroup group{"Spectra of the residual", "", {}};
    const std::string shaft = trace.regime == Regime::mechanical ? "shaft angle" : "electrical angle";
    for (const TraceSpectrum& s : trace.blocks.spectra)
        if (!s.order.empty())
            group.plots.push_back(
                spectrum(s.axis, trace, "order", "order of the " + shaft + " [1]", {s.order, s.before, s.after}));
    for (const TraceSpectrum& s : trace.blocks.spectra)
        if (!s.frequency_Hz.empty())
            group.plots.push_back(
                spectrum(s.axis, trace, "frequency", "frequency [Hz]", {s.frequency_Hz, s.before_at, s.after_at}));
    return group;
}

}  // namespace

Plot key_plot(const TraceResult& trace)
{
    const auto axes = plot_axes(trace.blocks, trace.regime);
    double most = -HUGE_VAL;
    const PlotAxis* best = nullptr;
    const TraceAxisBlocks* best_axis = nullptr;
    for (const PlotAxis& x : axes)
        for (const TraceAxisBlocks& axis : trace.blocks.axes) {
            // All that changes goes with time; that alone shows no cause.
            const double gain = (x.ordered ? 0.5 : 1.0) * explained(residuals(x.values, axis), !trace.effects.empty());
            if (gain > most) most = gain, best = &x, best_axis = &axis;
        }
    return best ? against(*best, *best_axis, trace) : Plot{};
}

std::vector<PlotGroup> plot_groups(const TraceResult& trace)
{
    std::vector<PlotGroup> groups;
    for (PlotGroup& group :
         std::vector<PlotGroup>{map_group(trace.map), predictions(trace), residual_group(trace), spectra(trace)})
        if (!group.plots.empty()) groups.push_back(std::move(group));
    return groups;
}

}  // namespace dqw
