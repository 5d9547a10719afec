#include "app/monitor/page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/base/text.hpp"
#include "app/monitor/names.hpp"
#include "app/page/html.hpp"
#include "app/page/page.hpp"
#include "dqw_text.h"

namespace dqw {
namespace {

constexpr std::size_t most_events = 200, most_stages = 500;

const char* badge(const MonitorRun& run)
{
    return !run.watched || (run.events.empty() && !run.relearned.empty()) ? "part"
           : run.events.empty()                                           ? "clean"
                                                                          : "unexplained";
}

std::string badge_text(const MonitorRun& run)
{
    if (!run.served) return "not in service";
    if (!run.watched) return "not watched";
    if (run.events.empty() && !run.relearned.empty()) return "learned anew";
    return run.events.empty() ? "healthy" : counted(run.event_count, "event");
}

std::string remark(const MonitorRun& run)
{
    std::string out;
    if (run.events.size() > 1) out = fmt::format("The first of {} events; the others stand below.", run.event_count);
    if (run.end.stage.times_back > 0)
        out += fmt::format("{}The monitor went back to stage 1 {} and learned anew.", out.empty() ? "" : " ",
                           run.end.stage.times_back == 1 ? "once" : fmt::format("{} times", run.end.stage.times_back));
    return escaped(out);
}

/// Steps of 1, 2 or 5 times a power of ten, about eight of them.
double tick_step(double span)
{
    const double raw = span / 8.0, power = std::pow(10.0, std::floor(std::log10(raw)));
    for (const double m : {1.0, 2.0, 5.0})
        if (m * power >= raw) return m * power;
    return 10.0 * power;
}

double span_of(const MonitorRun& run) { return std::max(run.end_s - run.begin_s, 1e-9); }

double percent_of(const MonitorRun& run, double t_s)
{
    return std::clamp(100.0 * (t_s - run.begin_s) / span_of(run), 0.0, 100.0);
}

const char* css_of(dqw_stage_name stage)
{
    switch (stage) {
    case DQW_STAGE_DOMAIN: return "domain";
    case DQW_STAGE_RANDOM: return "random";
    case DQW_STAGE_ORDINAL: return "ordinal";
    case DQW_STAGE_IN_SERVICE: break;
    }
    return "service";
}

/// The log's time as a bar: stages as its colours, events as its pins.
std::string timeline(const MonitorRun& run)
{
    const auto percent = [&](double t_s) { return percent_of(run, t_s); };
    std::string out = "<div class=\"timeline\">";
    for (std::size_t k = 0; k < std::min(run.stages.size(), most_stages); ++k) {
        const double from = run.stages[k].from_s, to = k + 1 < run.stages.size() ? run.stages[k + 1].from_s : run.end_s;
        if (!(to > from)) continue;
        out += fmt::format(
            "<span class=\"stage {}\" style=\"left:{:.2f}%;width:{:.2f}%\" title=\"{}, {:.3f} s to {:.3f} s\"></span>",
            css_of(run.stages[k].name), percent(from), percent(to) - percent(from),
            escaped(dqw_stage_text(run.stages[k].name)), from, to);
    }
    for (std::size_t k = 0; k < std::min(run.events.size(), most_events); ++k)
        out += fmt::format(
            "<span class=\"pin\" style=\"left:{:.2f}%\" title=\"{}\"><b>{}</b></span>", percent(run.events[k].t_s),
            escaped(fmt::format("{}, {:.3f} s", fault_spoken(run.events[k].fault), run.events[k].t_s)), k + 1);
    return out + "</div>\n";
}

std::string ticks(const MonitorRun& run)
{
    const double span = span_of(run), step = tick_step(span);
    std::string out = "<div class=\"ticks\">";
    for (double t = step * std::ceil(run.begin_s / step); t <= run.end_s + 1e-3 * span; t += step)
        out += fmt::format("<span style=\"left:{:.2f}%\">{:.6g}</span>", percent_of(run, t),
                           std::fabs(t) < 1e-9 * step ? 0.0 : t);
    return out + "</div>\n";
}

std::string legend()
{
    std::string out = "<p class=\"legend\">time [s] ";
    for (const dqw_stage_name name : {DQW_STAGE_RANDOM, DQW_STAGE_ORDINAL, DQW_STAGE_IN_SERVICE})
        out += fmt::format("<span><i class=\"stage {}\"></i> {}</span> ", css_of(name), escaped(stage_spoken(name)));
    return out + "</p>";
}

std::string event_card(const MonitorRun& run)
{
    if (run.events.empty()) return "";
    std::string out = html_table(event_rows(run, most_events), "numbers events");
    if (run.event_count > most_events) out += fmt::format("<p>and {} more</p>\n", run.event_count - most_events);
    return card("Events", out);
}

std::string summary_card(const MonitorRun& run)
{
    std::string out = "<table class=\"plain\"><tbody>\n";
    for (const auto& row : summary_rows(run))
        out += fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td></tr>\n", escaped(row[0]), escaped(row[1]));
    return card("Summary", out + "</tbody></table>");
}

std::string value_card(const MonitorRun& run)
{
    const MonitorRows rows = value_rows(run, true);
    return rows.size() < 2 ? "" : card("Healthy and last values", html_table(rows, "numbers"));
}

std::string unwatched_card(const MonitorRun& run)
{
    const MonitorRows rows = unwatched_rows(run, true);
    if (!run.watched || rows.empty()) return "";
    std::string out = "<table class=\"plain\"><tbody>\n";
    for (const auto& row : rows)
        out += fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td></tr>\n", escaped(capital(row[0])),
                           escaped(row[1]));
    return card(fmt::format("Not watched at {:.3f} s", run.sights_s), out + "</tbody></table>");
}

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

/// Each channel over time with its 95 % band, its healthy value and the events; what was never known is left out.
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
        plot.y_range = range_of(run, c, dqw_watch_is_part(channel));
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

/// Of the first event, or the residual where there is none.
const Plot* key_plot(const MonitorRun& run, const std::vector<Plot>& all)
{
    const std::string title =
        channel_named(run.events.empty() ? DQW_WATCH_RESIDUAL : run.events.front().parameter).title;
    const auto found = std::find_if(all.begin(), all.end(),
                                    [&](const Plot& p) { return p.y_label.rfind(title, 0) == 0; });
    return found == all.end() ? nullptr : &*found;
}

}  // namespace

std::string monitor_page(const MonitorReport& report, Extent extent)
{
    const MonitorRun& run = report.run;
    const std::string name = names_of_files({report.log});
    PagePlots plots;
    std::string body = page_header(
        fmt::format("{} · condition monitor, {} rows, {:.4g} s", name, grouped(run.rows), run.end_s - run.begin_s),
        badge(run), badge_text(run), monitor_outcome(run), remark(run));
    body += "<div class=\"stack\">\n" + card("Stages and events", timeline(run) + ticks(run) + legend()) +
            event_card(run) + "</div>\n";
    const std::vector<Plot> all = monitor_plots(run);
    body += "<div class=\"first watched\">\n<div>" + summary_card(run) + value_card(run) + unwatched_card(run) +
            "</div>\n";
    if (const Plot* key = key_plot(run, all)) body += plots.figure(*key, "card wide");
    body += "</div>\n";
    const std::string title = name + " – dqwatch monitor";
    if (extent == Extent::first_screen) return page_around(title, body, plots);
    body += plots.section({"Parameters over time",
                           "Lines: what is learned, within its 95 % band where there is one. Dashed: healthy values. "
                           "Shaded: not in service. Upright: events. " +
                               std::string(kPlotHint),
                           all});
    std::vector<std::string> notes;
    for (const std::string& note : report.notes) notes.push_back(with_minus(note));
    body += lists_section("Log and notes", {report.log}, notes);
    return page_around(title, body, plots);
}

}  // namespace dqw
