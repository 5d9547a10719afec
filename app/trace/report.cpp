#include "app/trace/report.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "app/base/columns.hpp"
#include "app/base/learnable.hpp"
#include "app/base/quantity.hpp"
#include "app/base/text.hpp"
#include "app/report/report.hpp"
#include "app/trace/advice.hpp"
#include "app/trace/flux_map.hpp"
#include "app/trace/rows.hpp"
#include "app/trace/verdict.hpp"
#include "ref/trace/rules.hpp"

namespace dqw {
namespace {

using Json = nlohmann::ordered_json;

Json fit_json(const TraceFit& fit)
{
    return {{"parameters", parameters_json(fit.parameters)},
            {"heldout_rms", fit.heldout_rms},
            {"axes", axes_json(fit.axes)}};
}

Json correlates_json(const std::vector<TraceCorrelate>& correlates)
{
    Json json = Json::array();
    for (const TraceCorrelate& c : correlates) json.push_back({{"with", c.with}, {"axis", c.axis}, {"share", c.share}});
    return json;
}

Json partial_json(const TracePartial& partial)
{
    Json effects = Json::array();
    for (const TraceEffect& e : partial.effects) {
        effects.push_back({{"name", e.name}, {"parameters", parameters_json(e.parameters)}});
        if (!e.modulation.empty()) effects.back()["modulation"] = e.modulation, effects.back()["law"] = e.law;
    }
    return {
        {"effects", effects}, {"share", partial.share}, {"heldout_rms", partial.heldout_rms}, {"rest", partial.rest}};
}

std::string correlates_text(const std::vector<TraceCorrelate>& correlates)
{
    std::string out;
    for (std::size_t i = 0; i < correlates.size() && i < 3; ++i)
        out += fmt::format("{}{} ({}, {:.0f} %)", i ? "; " : "", correlates[i].with, correlates[i].axis,
                           100 * correlates[i].share);
    return out;
}

/// What the ratio of the last residual to the noise says.
std::string ratio_text(const TraceResult& trace)
{
    const double ratio = trace.after.heldout_rms / trace.noise_floor;
    if (!std::isfinite(ratio)) return "";
    return fmt::format(
        "{:.{}f} times the floor (1: noise alone; above {}: something is left; clearly below 1: rows are "
        "filtered or repeated)\n",
        ratio, ratio < 9.95 ? 2 : 0, kStructured);
}

}  // namespace

Json trace_json(const TraceReport& report)
{
    const TraceResult& trace = report.trace;
    Json json = {{"schema", "dqwatch.trace/1"},        {"verdict", trace.verdict},
                 {"sentence", verdict_line(trace)},    {"logs", report.logs},
                 {"regime", name_of(trace.regime)},    {"rows", trace.rows},
                 {"heldout_rows", trace.heldout_rows}, {"unit", trace.unit},
                 {"noise_floor", trace.noise_floor},   {"before", fit_json(trace.before)},
                 {"after", fit_json(trace.after)}};
    Json learner = Json::object();
    if (report.learner_before) learner["before"] = fit_json(*report.learner_before);
    if (report.learner_after) learner["after"] = fit_json(*report.learner_after);
    json["learner"] = learner;
    Json effects = Json::array(), rejected = Json::array(), inputs = Json::array();
    for (const TraceEffect& e : trace.effects) {
        effects.push_back({{"name", e.name},
                           {"parameters", parameters_json(e.parameters)},
                           {"heldout_rms_after", e.heldout_rms_after},
                           {"confidence", e.confidence},
                           {"confusable_with", e.confusable_with},
                           {"separate", e.separate}});
        if (!e.modulation.empty()) effects.back()["modulation"] = e.modulation, effects.back()["law"] = e.law;
        if (!e.channel.empty()) effects.back()["channel"] = e.channel;
        if (e.turned) effects.back()["turned"] = true;
    }
    for (const TraceRejected& r : trace.rejected)
        rejected.push_back({{"name", r.name}, {"why", r.why}, {"heldout_rms", r.heldout_rms}});
    for (const TraceInput& i : trace.inputs) {
        inputs.push_back({{"effect", i.effect}, {"shape", i.shape}, {"weights", i.weights}});
        if (!i.modulation.empty()) inputs.back()["modulation"] = i.modulation;
        if (!i.map.empty()) inputs.back()["map"] = i.map;
    }
    json["effects"] = effects;
    if (!trace.partial.effects.empty()) json["best_partial_match"] = partial_json(trace.partial);
    if (trace.beyond_hexagon > 0) json["beyond_hexagon_rows"] = trace.beyond_hexagon;
    json["rejected"] = rejected;
    json["advice"] = advice_of(trace);
    json["structure"] = correlates_json(trace.structure);
    json["rest"] = {{"signature", trace.rest_signature}, {"correlates", correlates_json(trace.rest)}};
    json["doubt"] = trace.doubt.empty() ? Json::array() : Json::array({trace.doubt});
    json["inputs"] = inputs;
    json["notes"] = trace.notes;
    return json;
}

std::string trace_text(const TraceReport& report)
{
    const TraceResult& trace = report.trace;
    std::string out = verdict_line(trace) + "\n";
    const std::string remark = verdict_remark(trace);
    out += remark + (remark.empty() ? "\n" : "\n\n");
    out += fmt::format("{}: {}, {}, {} held out\n\n", trace.verdict, name_of(trace.regime), counted(trace.rows, "row"),
                       trace.heldout_rows);
    const bool found = !trace.effects.empty();
    const auto parameters = [&](const std::string& heading, const TraceFit& before, const TraceFit& after) {
        const Rows rows = parameter_rows(before, after, found);
        return rows.size() < 2 ? "" : "\n" + heading + table(rows);
    };
    out += table(residual_rows(report)) + ratio_text(trace) + parameters("", trace.before, trace.after);
    if (found) out += "\n" + table(effect_rows(trace));
    const std::string map = flux_map_text(trace);
    if (!map.empty()) out += "\n" + map;
    if (report.learner_before && report.learner_after)
        out += parameters("learners in firmware\n", *report.learner_before, *report.learner_after);
    for (const std::string& note : notes_on_others(trace.inputs)) out += "  " + note + "\n";
    const std::vector<std::string> advice = advice_of(trace);
    if (!advice.empty()) out += "\nwhat would tell more\n";
    for (const std::string& text : advice) out += "  " + text + "\n";
    if (!trace.structure.empty())
        out += fmt::format("\nthe residual {}goes with: {}\n", found ? "before " : "",
                           correlates_text(trace.structure));
    if (found && !trace.rest.empty()) out += "the residual after goes with: " + correlates_text(trace.rest) + "\n";
    if (trace.rejected.empty()) return out;
    // The reason is a sentence, so it stands behind the table, not in it.
    Rows rows;
    for (const TraceRejected& r : trace.rejected)
        rows.push_back({"  " + r.name, std::isfinite(r.heldout_rms) ? residual_text(r.heldout_rms, trace.unit) : ""});
    const std::string padded = table(rows);
    out += "\nnot taken\n";
    std::size_t at = 0;
    for (const TraceRejected& r : trace.rejected) {
        const std::size_t end = padded.find('\n', at);
        out += padded.substr(at, end - at) + ": " + with_minus(r.why) + "\n";
        at = end + 1;
    }
    return out;
}

}  // namespace dqw
