#include "report_page.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "assets.hpp"
#include "columns.hpp"
#include "html.hpp"
#include "report_sections.hpp"
#include "text.hpp"
#include "trace_plots.hpp"
#include "trace_rows.hpp"
#include "verdict.hpp"

namespace dqw {
namespace {

std::string plot_data(const Plot& plot)
{
    const char* const kinds[] = {"lines", "points", "bars"};
    std::string out = fmt::format("{{\"kind\":\"{}\",\"x\":{},\"y\":{},\"log\":{},\"series\":[", kinds[static_cast<int>(plot.kind)],
                                  script_string(plot.x_label), script_string(plot.y_label), plot.log_y);
    for (std::size_t i = 0; i < plot.series.size(); ++i) out += (i ? "," : "") + script_string(plot.series[i]);
    Columns shaded(2);
    for (const auto& [from, to] : plot.shaded) {
        shaded[0].push_back(from);
        shaded[1].push_back(to);
    }
    return out + "],\"rows\":" + script_rows(plot.columns) + ",\"means\":" + script_rows(plot.means) + ",\"shaded\":" + script_rows(shaded) + "}";
}

/// A place for a plot; its data go to `data`, and the page's script draws it.
std::string figure(const Plot& plot, const char* css, std::string& data)
{
    data += (data.empty() ? "" : ",\n") + plot_data(plot);
    return fmt::format("<figure class=\"{0}\"><figcaption>{1}<span class=\"key\"></span></figcaption>"
                       "<div class=\"plot\" role=\"img\" aria-label=\"{1}: {2} over {3}\"></div></figure>\n",
                       css, escaped(plot.title), escaped(plot.y_label), escaped(plot.x_label));
}

/// 1 000 000 with narrow spaces.
std::string grouped(std::size_t n)
{
    std::string out = std::to_string(n);
    for (std::size_t at = out.size(); at > 3;) out.insert(at -= 3, "\u202f");
    return out;
}

std::string names_of(const std::vector<std::string>& logs)
{
    std::vector<std::string> names;
    for (const std::string& log : logs) names.push_back(std::filesystem::path(log).filename().string());
    return list(names, 4);
}

}  // namespace

std::string report_page(const TraceReport& report)
{
    const TraceResult& trace = report.trace;
    const std::string names = names_of(report.logs);
    const std::string remark = verdict_remark(trace);
    std::string data;
    std::string body = fmt::format(
        "<header><p class=\"log\">{} · {} log, {} rows, {} held out</p>\n<p id=\"verdict\"><span class=\"badge {}\">{}</span> {}</p>{}</header>\n<main>\n",
        escaped(names), name_of(trace.regime), grouped(trace.rows), grouped(trace.heldout_rows), escaped(trace.verdict), escaped(spoken(trace.verdict)),
        unbroken(verdict_sentence(trace)), remark.empty() ? "" : "<p class=\"remark\">" + unbroken(remark) + "</p>");
    body += "<div class=\"first\">\n<div>" + error_card(report) + parameter_card(report) + "</div>\n";
    const Plot key = key_plot(trace);
    if (!key.series.empty()) body += figure(key, "card wide", data);
    body += "</div>\n<p class=\"hint\">Drag over a plot to zoom in, double-click to see all of it again; point at it for its values.</p>\n";
    body += effect_section(trace) + learner_section(report) + candidate_section(trace);
    for (const PlotGroup& group : plot_groups(trace)) {
        body += fmt::format("<section><h2>{}</h2>{}<div class=\"plots\">\n", escaped(group.title),
                            group.about.empty() ? "" : "<p>" + escaped(group.about) + "</p>");
        for (const Plot& plot : group.plots) body += figure(plot, "card", data);
        body += "</div></section>\n";
    }
    body += rest_section(trace) + notes_section(report);
    std::string page = "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
                       "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
                       "base-uri 'none'; form-action 'none'\">\n"
                       "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<meta name=\"color-scheme\" content=\"light dark\">\n";
    page += "<title>" + escaped(names) + " – dqwatch trace</title>\n<style>\n";
    page.append(dygraphs_css()).append("\n").append(report_css()).append("</style>\n</head>\n<body>\n");
    page += body + "</main>\n<footer><details><summary>Plots by dygraphs</summary><pre>" + escaped(dygraphs_licence()) + "</pre></details></footer>\n";
    page += "<script type=\"application/json\" id=\"plots\">[" + data + "]</script>\n<script>\n";
    page.append(dygraphs_js()).append("\n</script>\n<script>\n").append(report_js()).append("</script>\n</body>\n</html>\n");
    return page;
}

}  // namespace dqw
