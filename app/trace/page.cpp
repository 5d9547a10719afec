#include "app/trace/page.hpp"

#include <fmt/format.h>

#include "app/base/columns.hpp"
#include "app/page/html.hpp"
#include "app/page/page.hpp"
#include "app/trace/plots.hpp"
#include "app/trace/sections.hpp"
#include "app/trace/verdict.hpp"

namespace dqw {

std::string report_page(const TraceReport& report)
{
    const TraceResult& trace = report.trace;
    const std::string names = names_of_files(report.logs);
    PagePlots plots;
    std::string body = page_header(fmt::format("{} · {} log, {} rows, {} held out", names, name_of(trace.regime),
                                               grouped(trace.rows), grouped(trace.heldout_rows)),
                                   trace.verdict, spoken(trace.verdict), verdict_sentence(trace),
                                   unbroken(verdict_remark(trace)));
    body += "<div class=\"first\">\n<div>" + error_card(report) + parameter_card(report) + "</div>\n";
    const Plot key = key_plot(trace);
    if (!key.series.empty()) body += plots.figure(key, "card wide");
    body += fmt::format("</div>\n<p class=\"hint\">{}</p>\n", kPlotHint);
    body += effect_section(trace) + learner_section(report) + candidate_section(trace);
    for (const PlotGroup& group : plot_groups(trace)) body += plots.section(group);
    body += rest_section(trace) + notes_section(report);
    return page_around(names + " – dqwatch trace", body, plots);
}

}  // namespace dqw
