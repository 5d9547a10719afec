#include "app/trace/rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/base/parameters.hpp"
#include "app/base/quantity.hpp"
#include "app/base/text.hpp"

namespace dqw {
namespace {

std::string cell(const Estimate* e, const Quantity& like)
{
    if (!e) return "not determined";
    return with_minus(with_sd(quantity_like(like, e->name, e->value, e->given ? 0.0 : e->sd))) +
           (e->given ? " (given)" : "");
}

std::string change_text(double percent)
{
    return with_minus(std::fabs(percent) < 99.5 ? fmt::format("{:+.2g} %", percent)
                                                : fmt::format("{:+.0f} %", percent));
}

/// The prefix of the larger: a row of them compares.
Quantity larger(const Estimate* a, const Estimate* b)
{
    const Estimate* one = !a || (b && std::fabs(b->value) > std::fabs(a->value)) ? b : a;
    return one ? quantity(one->name, one->value, 0.0) : Quantity{};
}

}  // namespace

Rows parameter_rows(const TraceFit& before, const TraceFit& after, bool effects_found)
{
    std::vector<std::string> names;
    for (const TraceFit* fit : {&after, &before})
        for (const Estimate& e : fit->parameters)
            if (std::find(names.begin(), names.end(), e.name) == names.end()) names.push_back(e.name);
    const auto place = [](const std::string& name) {
        const auto& known = known_parameters();
        return std::find(known.begin(), known.end(), name) - known.begin();
    };
    std::stable_sort(names.begin(), names.end(),
                     [&](const std::string& a, const std::string& b) { return place(a) < place(b); });
    if (!effects_found) {
        Rows rows = {{"", "value"}};
        for (const Estimate& e : before.parameters) rows.push_back({symbol(e.name), cell(&e, larger(&e, nullptr))});
        return rows;
    }
    Rows rows = {{"", "before", "after", "change"}};
    for (const std::string& name : names) {
        const Estimate *b = find_estimate(before.parameters, name), *a = find_estimate(after.parameters, name);
        const bool comparable = a && b && !a->given && a->value != 0 && std::isfinite(b->value);
        const Quantity like = larger(a, b);
        rows.push_back({symbol(name), cell(b, like), cell(a, like),
                        comparable ? change_text(100 * (a->value - b->value) / std::fabs(b->value)) : ""});
    }
    return rows;
}

Rows residual_rows(const TraceReport& report)
{
    const TraceResult& trace = report.trace;
    Rows rows = {{"residual on unseen rows", "before", "after"}};
    rows.push_back({"reference fit", residual_text(trace.before.heldout_rms, trace.unit),
                    residual_text(trace.after.heldout_rms, trace.unit)});
    for (const AxisResidual& b : trace.before.axes)
        for (const AxisResidual& a : trace.after.axes)
            if (a.axis == b.axis)
                rows.push_back({"  " + a.axis, fmt::format("{:.3g} %", b.percent), fmt::format("{:.3g} %", a.percent)});
    if (report.learner_before && report.learner_after)
        rows.push_back({"learners in firmware", residual_text(report.learner_before->heldout_rms, trace.unit),
                        residual_text(report.learner_after->heldout_rms, trace.unit)});
    rows.push_back({"noise floor of the log", residual_text(trace.noise_floor, trace.unit),
                    residual_text(trace.noise_floor, trace.unit)});
    if (!trace.effects.empty()) return rows;
    for (auto& row : rows) row.pop_back();
    rows[0][1] = "plain model";
    return rows;
}

Rows effect_rows(const TraceResult& trace)
{
    Rows rows = {{"effect", "confidence", "parameter", "value"}};
    for (const TraceEffect& e : trace.effects)
        for (const Estimate& p : e.parameters) {
            const bool first = &p == &e.parameters[0];
            rows.push_back(
                {first ? e.name : "", first ? fmt::format("{:.2f}", e.confidence) : "", p.name,
                 with_minus(with_sd(quantity(p.name, p.value, p.given ? 0.0 : p.sd))) + (p.given ? " (assumed)" : "")});
        }
    return rows;
}

std::string residual_text(double rms, const std::string& unit)
{
    if (!std::isfinite(rms)) return "–";
    return number_like({"", "", unit}, "_" + unit, rms, 3) + " " + unit;
}

}  // namespace dqw
