#include "app/trace/page.hpp"

#include <fmt/format.h>

#include "app/base/columns.hpp"
#include "app/page/html.hpp"
#include "app/page/page.hpp"
#include "app/trace/plots.hpp"
#include "app/trace/rows.hpp"
#include "app/trace/sections.hpp"
#include "app/trace/verdict.hpp"

namespace dqw {

std::string report_page(const TraceReport& report)
{
    const TraceResult& trace = report.trace;
    const std::string names = names_of_files(report.logs);
    const std::string remark = verdict_remark(trace);
    PagePlots plots;
    std::string body = fmt::format("<header><p class=\"log\">{} · {} log, {} rows, {} held out</p>\n<p "
                                   "id=\"verdict\"><span class=\"badge {}\">{}</span> {}</p>{}</header>\n<main>\n",
                                   escaped(names), name_of(trace.regime), grouped(trace.rows),
                                   grouped(trace.heldout_rows), escaped(trace.verdict), escaped(spoken(trace.verdict)),
                                   unbroken(verdict_sentence(trace)),
                                   remark.empty() ? "" : "<p class=\"remark\">" + unbroken(remark) + "</p>");
    body += "<div class=\"first\">\n<div>" + error_card(report) + parameter_card(report) + "</div>\n";
    const Plot key = key_plot(trace);
    if (!key.series.empty()) body += plots.figure(key, "card wide");
    body += "</div>\n<p class=\"hint\">Drag over a plot to zoom in, double-click to see all of it again; point at it "
            "for its values.</p>\n";
    body += effect_section(trace) + learner_section(report) + candidate_section(trace);
    for (const PlotGroup& group : plot_groups(trace)) {
        body += fmt::format("<section><h2>{}</h2>{}<div class=\"plots\">\n", escaped(group.title),
                            group.about.empty() ? "" : "<p>" + escaped(group.about) + "</p>");
        for (const Plot& plot : group.plots) body += plots.figure(plot, "card");
        body += "</div></section>\n";
    }
    body += rest_section(trace) + notes_section(report);
    return page_around(names + " – dqwatch trace", body + "</main>\n", plots);
}

}  // namespace dqw
