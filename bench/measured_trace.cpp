// What the tracer makes of every measured log: before and after.
#include <fmt/format.h>

#include <algorithm>

#include "app/base/columns.hpp"
#include "app/base/parameters.hpp"
#include "app/base/quantity.hpp"
#include "app/base/text.hpp"
#include "app/learn/trace.hpp"
#include "app/trace/rows.hpp"
#include "app/trace/verdict.hpp"
#include "measured.hpp"

namespace measured {
namespace {

constexpr const char* kNone = "–";
constexpr const char* kTo = " → ";

bool mechanical(const Entry& e) { return e.report->trace.regime == dqw::Regime::mechanical; }

std::string rms(const dqw::TraceFit& fit, const std::string& unit) { return dqw::residual_text(fit.heldout_rms, unit); }

std::string percents(const dqw::TraceResult& t, const std::string& axis)
{
    std::string out = kNone;
    for (std::size_t k = 0; k < t.before.axes.size() && k < t.after.axes.size(); ++k)
        if (t.before.axes[k].axis == axis && t.before.axes[k].percent > 0)
            out = fmt::format("{:.3g}{}{:.3g} %", t.before.axes[k].percent, kTo, t.after.axes[k].percent);
    return out;
}

std::string effects(const dqw::TraceResult& t)
{
    std::string out;
    for (const dqw::TraceEffect& e : t.effects) {
        out += (out.empty() ? "`" : ", `") + e.name + "`";
        if (!e.confusable_with.empty()) out += " (or " + dqw::list(e.confusable_with) + ")";
    }
    return out.empty() ? kNone : out;
}

std::string residual_row(const Entry& e)
{
    const dqw::TraceResult& t = e.report->trace;
    const std::string& unit = t.unit;
    std::vector<std::string> cells = {e.name, t.verdict, effects(t), rms(t.before, unit) + kTo + rms(t.after, unit)};
    if (mechanical(e))
        cells.push_back(percents(t, "torque"));
    else
        for (const char* axis : {"d", "q"}) cells.push_back(percents(t, axis));
    cells.push_back(dqw::residual_text(t.noise_floor, unit));
    const auto &before = e.report->learner_before, &after = e.report->learner_after;
    cells.push_back(before && after ? rms(*before, unit) + kTo + rms(*after, unit) : kNone);
    return row(cells);
}

std::string parameter_row(const Entry& e)
{
    std::vector<std::string> cells = {e.name};
    const dqw::Rows rows = dqw::parameter_rows(e.report->trace.before, e.report->trace.after, true);
    const std::vector<const char*> names = mechanical(e) ? std::vector<const char*>{"J_kgm2", "B_Nms_rad"}
                                                         : std::vector<const char*>{"R_ohm", "Ld_H", "Lq_H", "psi_Wb"};
    for (const char* name : names) {
        std::string text = kNone;
        for (const auto& r : rows)
            if (r[0] == dqw::symbol(name)) text = (r[1].empty() ? kNone : r[1]) + kTo + (r[2].empty() ? kNone : r[2]);
        cells.push_back(text);
    }
    return row(cells);
}

}  // namespace

dqw::TraceReport traced(const std::vector<dqw::Log>& logs)
{
    dqw::TraceReport report;
    for (const dqw::Log& log : logs) report.logs.push_back(log.path);
    report.trace = dqw::trace(logs);
    try {
        report.learner_before = dqw::learn_fit(logs, report.trace, false);
        report.learner_after = dqw::learn_fit(logs, report.trace, true);
    } catch (const std::invalid_argument& error) {
        report.learner_before.reset();
        report.trace.notes.push_back(std::string("no learners: ") + error.what());
    }
    return report;
}

std::string traced_tables(const std::vector<Entry>& entries)
{
    std::string out = "\n## Traced: before and after, on rows that no fit saw\n\nThe tracer is told nothing but the "
                      "log and the pole pairs. Before: the plain "
                      "model; after: with the effects found. Learners: the\nsame for the float learners of `lib/`. "
                      "Noise floor: what the log's own noise would "
                      "leave.\n";
    for (const bool wanted : {false, true}) {
        std::string residuals, parameters;
        for (const Entry& e : entries)
            if (e.report && mechanical(e) == wanted) residuals += residual_row(e), parameters += parameter_row(e);
        if (residuals.empty()) continue;
        out += wanted
                   ? "\n### Mechanical\n\n| log | verdict | effects | residual | torque | noise floor | learners |\n| "
                     "--- | --- | --- | --: | --: | --: | --: |\n"
                   : "\n### Electrical\n\n| log | verdict | effects | residual | v_d | v_q | noise floor | learners |\n"
                     "| --- | --- | --- | --: | --: | --: | --: | --: |\n";
        out += residuals;
        out += wanted ? "\n| log | J | B |\n| --- | --: | --: |\n"
                      : "\n| log | R | L_d | L_q | ψ |\n| --- | --: | --: | --: | --: |\n";
        out += parameters;
    }
    return out;
}

std::string traced_lines(const Entry& entry)
{
    if (!entry.report) return "";
    const dqw::TraceResult& t = entry.report->trace;
    std::string out = "- **" + dqw::verdict_sentence(t) + "**\n";
    const std::string remark = dqw::verdict_remark(t);
    if (!remark.empty()) out += "- " + remark + "\n";
    for (const dqw::TraceEffect& e : t.effects) {
        out += "- Effect `" + e.name + "`:";
        for (const dqw::Estimate& p : e.parameters)
            out += fmt::format("{} `{}` {}{}", &p == &e.parameters.front() ? "" : ",", p.name,
                               dqw::with_sd(dqw::quantity(p.name, p.value, p.given ? 0.0 : p.sd)),
                               p.given ? " (assumed)" : "");
        out += fmt::format("; {} on unseen rows", dqw::residual_text(e.heldout_rms_after, t.unit));
        if (!e.confusable_with.empty())
            out += fmt::format(". Not told from {} here; what would: {}", dqw::list(e.confusable_with), e.separate);
        out += "\n";
    }
    std::string refused;
    for (const dqw::TraceRejected& r : t.rejected)
        if (r.why.find("would be") != r.why.npos)
            refused += (refused.empty() ? "" : "; ") + fmt::format("`{}`: {}", r.name, r.why);
    if (!refused.empty()) out += "- Without physical sense: " + refused + "\n";
    const std::vector<std::string>& known = entry.result.notes;
    for (const std::string& note : t.notes)
        if (std::find(known.begin(), known.end(), note) == known.end()) out += "- Note on the trace: " + note + "\n";
    if (!entry.picture.empty())
        out += fmt::format("\n![{}: first screen of the report](pictures/{})\n\n", entry.name, entry.picture);
    return out;
}

}  // namespace measured
