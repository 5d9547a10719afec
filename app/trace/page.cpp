#include "app/trace/page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/base/columns.hpp"
#include "app/base/learnable.hpp"
#include "app/base/quantity.hpp"
#include "app/base/text.hpp"
#include "app/page/html.hpp"
#include "app/page/page.hpp"
#include "app/trace/advice.hpp"
#include "app/trace/plots.hpp"
#include "app/trace/rows.hpp"
#include "app/trace/verdict.hpp"

namespace dqw {
namespace {

/// One row of a table of bars; `size` and `noise` as parts of the widest bar.
std::string bar_row(const std::string& name, const std::string& css, double value, double widest, double noise,
                    const std::string& unit, const std::string& remark)
{
    const auto percent = [&](double x) {
        return std::isfinite(x) && widest > 0 ? std::clamp(100 * x / widest, 0.0, 100.0) : 0.0;
    };
    std::string bar;
    if (std::isfinite(value))
        bar = fmt::format("<span class=\"bar {}\" style=\"width:{:.1f}%\"></span><span class=\"floor\" "
                          "style=\"left:{:.1f}%\"></span>",
                          css, percent(value), percent(noise));
    return fmt::format(
        "<tr><th scope=\"row\">{}</th><td class=\"track\"><div>{}</div></td><td class=\"number\">{}</td>{}</tr>\n",
        escaped(name), bar, escaped(residual_text(value, unit)),
        remark.empty() ? "" : "<td class=\"why\">" + escaped(with_minus(remark)) + "</td>");
}

std::string percents(const TraceFit& fit)
{
    std::string out;
    // An axis without voltage leaves nothing.
    for (const AxisResidual& a : fit.axes)
        if (a.percent > 0) out += fmt::format("{}{} {:.2g} %", out.empty() ? "" : ", ", a.axis, a.percent);
    return out;
}

std::string correlates(const char* heading, const std::vector<TraceCorrelate>& all)
{
    if (all.empty()) return "";
    Rows rows = {{heading, "axis", "share of the variance above noise"}};
    for (const TraceCorrelate& c : all) rows.push_back({c.with, c.axis, fmt::format("{:.0f} %", 100 * c.share)});
    return html_table(rows, "plain");
}

std::string error_card(const TraceReport& report)
{
    const TraceResult& t = report.trace;
    const bool learners = report.learner_before && report.learner_after;
    double widest = std::max({t.before.heldout_rms, t.after.heldout_rms, t.noise_floor});
    if (learners) widest = std::max({widest, report.learner_before->heldout_rms, report.learner_after->heldout_rms});
    std::string out = "<table class=\"bars\"><tbody>\n";
    const auto row = [&](const std::string& name, const char* css, const TraceFit& fit) {
        out += bar_row(name, css, fit.heldout_rms, widest, t.noise_floor, t.unit, percents(fit));
    };
    const bool found = !t.effects.empty();
    row(found ? "before" : "plain model", "before", t.before);
    if (found) row("after", "after", t.after);
    if (learners) row(found ? "learner, before" : "learner", "before", *report.learner_before);
    if (learners && found) row("learner, after", "after", *report.learner_after);
    out += fmt::format("<tr class=\"noise\"><th scope=\"row\">noise floor</th><td class=\"track\"><div><span "
                       "class=\"floor\" style=\"left:{:.1f}%\"></span></div></td>"
                       "<td class=\"number\">{}</td></tr>\n",
                       widest > 0 && std::isfinite(t.noise_floor) ? 100 * t.noise_floor / widest : 0.0,
                       escaped(residual_text(t.noise_floor, t.unit)));
    return card("Error on rows that no fit saw", out + "</tbody></table>");
}

std::string parameter_card(const TraceReport& report)
{
    const Rows rows = parameter_rows(report.trace.before, report.trace.after, !report.trace.effects.empty());
    return rows.size() < 2 ? "" : card("Parameters", html_table(rows, "numbers"));
}

/// What firmware's learners make of the same rows.
std::string learner_section(const TraceReport& report)
{
    if (!report.learner_before || !report.learner_after) return "";
    const Rows rows = parameter_rows(*report.learner_before, *report.learner_after, !report.trace.effects.empty());
    if (rows.size() < 2) return "";
    std::string others;
    for (const std::string& note : notes_on_others(report.trace.inputs)) others += "<p>" + escaped(note) + ".</p>\n";
    return section("The learners in firmware",
                   "<p>The same rows, learned by the C library without and with the effects as Learner inputs.</p>\n" +
                       others + html_table(rows, "numbers effects"));
}

std::string effect_section(const TraceResult& trace)
{
    if (trace.effects.empty()) return "";
    std::string out = html_table(effect_rows(trace), "numbers effects named");
    for (const TraceEffect& e : trace.effects)
        if (!e.confusable_with.empty())
            out += fmt::format("<p class=\"confusable\"><b>{}</b> cannot be told from {} on this log.</p>\n",
                               escaped(spoken(e.name)), escaped(look_alikes_of(e)));
    return section("Effects found", out);
}

std::string advice_section(const TraceResult& trace)
{
    std::string out;
    for (const std::string& text : advice_of(trace)) out += "<li>" + escaped(text) + "</li>\n";
    return out.empty() ? out : section("What would tell more", "<ul class=\"advice\">\n" + out + "</ul>\n");
}

/// What each candidate would leave, as bars, with why those that were not taken were not.
std::string candidate_section(const TraceResult& trace)
{
    if (trace.effects.empty() && trace.rejected.empty()) return "";
    double widest = std::max(trace.before.heldout_rms, trace.noise_floor);
    for (const TraceRejected& r : trace.rejected)
        if (std::isfinite(r.heldout_rms))
            widest = std::max(widest, std::min(r.heldout_rms, 1.5 * trace.before.heldout_rms));
    const auto row = [&](const std::string& name, const char* css, double value, const std::string& why) {
        return bar_row(name, css, value, widest, trace.noise_floor, trace.unit, why);
    };
    std::string out = "<p>Residual on unseen rows: of the effects found, each with those above it; of the others, were "
                      "they alone added to the plain model. The line is the noise floor.</p>\n<div "
                      "class=\"scroll\"><table class=\"bars candidates\"><tbody>\n";
    out += row("plain model", "before", trace.before.heldout_rms, "without any effect");
    for (const TraceEffect& e : trace.effects) out += row(e.name, "after", e.heldout_rms_after, "found");
    std::vector<TraceRejected> rejected = trace.rejected;
    std::stable_sort(rejected.begin(), rejected.end(), [](const TraceRejected& a, const TraceRejected& b) {
        return (std::isfinite(a.heldout_rms) ? a.heldout_rms : HUGE_VAL) <
               (std::isfinite(b.heldout_rms) ? b.heldout_rms : HUGE_VAL);
    });
    for (const TraceRejected& r : rejected) out += row(r.name, "other", r.heldout_rms, r.why);
    return section("What each candidate would leave", out + "</tbody></table></div>");
}

std::string rest_section(const TraceResult& trace)
{
    if (trace.structure.empty() && trace.rest.empty()) return "";
    const std::string before = correlates(trace.effects.empty() ? "plain model" : "before", trace.structure);
    return section("What the residual goes with",
                   trace.effects.empty() ? before : before + correlates("after", trace.rest));
}

std::string notes_section(const TraceReport& report)
{
    std::vector<std::string> notes;
    for (const std::string& note : report.trace.notes) notes.push_back(with_minus(note));
    return lists_section("Logs and notes", report.logs, notes);
}

}  // namespace

std::string report_page(const TraceReport& report, Extent extent)
{
    const TraceResult& trace = report.trace;
    const std::string names = names_of_files(report.logs);
    PagePlots plots;
    std::string body = page_header(fmt::format("{} · {} log, {} rows, {} held out", names, name_of(trace.regime),
                                               grouped(trace.rows), grouped(trace.heldout_rows)),
                                   trace.verdict, spoken(trace.verdict), verdict_line(trace),
                                   unbroken(verdict_remark(trace)));
    body += "<div class=\"first\">\n<div>" + error_card(report) + parameter_card(report) + "</div>\n";
    const Plot key = key_plot(trace);
    if (!key.series.empty()) body += plots.figure(key, "card wide");
    body += fmt::format("</div>\n<p class=\"hint\">{}</p>\n", kPlotHint);
    const std::string title = names + " – dqwatch trace";
    if (extent == Extent::first_screen) return page_around(title, body, plots);
    body += effect_section(trace) + advice_section(trace) + learner_section(report) + candidate_section(trace);
    for (const PlotGroup& group : plot_groups(trace)) body += plots.section(group);
    body += rest_section(trace) + notes_section(report);
    return page_around(title, body, plots);
}

}  // namespace dqw
