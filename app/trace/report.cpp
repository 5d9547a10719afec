#include "app/trace/report.hpp"

#include <cmath>

#include "app/base/columns.hpp"
#include "app/trace/verdict.hpp"

namespace dqw {

using Json = nlohmann::ordered_json;

static Json parameters_json(const std::vector<Estimate>& parameters)
{
    Json json = Json::object();
    for (const Estimate& e : parameters) {
        Json& entry = json[e.name];
        const bool integer = e.name == "pole_pairs" && e.value == std::floor(e.value);
        entry["value"] = integer ? Json(static_cast<long>(e.value)) : Json(e.value);
        if (e.given)
            entry["given"] = true;
        else
            entry["sd"] = e.sd;
    }
    return json;
}

static Json fit_json(const TraceFit& fit)
{
    Json axes = Json::array();
    for (const AxisResidual& a : fit.axes) axes.push_back({{"axis", a.axis}, {"rms", a.rms}, {"percent", a.percent}});
    return {{"parameters", parameters_json(fit.parameters)}, {"heldout_rms", fit.heldout_rms}, {"axes", axes}};
}

static Json correlates_json(const std::vector<TraceCorrelate>& correlates)
{
    Json json = Json::array();
    for (const TraceCorrelate& c : correlates) json.push_back({{"with", c.with}, {"axis", c.axis}, {"share", c.share}});
    return json;
}

Json trace_json(const TraceReport& report)
{
    const TraceResult& trace = report.trace;
    Json json = {{"schema", "dqwatch.trace/1"},         {"verdict", trace.verdict},
                 {"sentence", verdict_sentence(trace)}, {"logs", report.logs},
                 {"regime", name_of(trace.regime)},     {"rows", trace.rows},
                 {"heldout_rows", trace.heldout_rows},  {"unit", trace.unit},
                 {"noise_floor", trace.noise_floor},    {"before", fit_json(trace.before)},
                 {"after", fit_json(trace.after)}};
    Json learner = Json::object();
    if (report.learner_before) learner["before"] = fit_json(*report.learner_before);
    if (report.learner_after) learner["after"] = fit_json(*report.learner_after);
    json["learner"] = learner;
    Json effects = Json::array(), rejected = Json::array(), inputs = Json::array();
    for (const TraceEffect& e : trace.effects)
        effects.push_back({{"name", e.name},
                           {"parameters", parameters_json(e.parameters)},
                           {"heldout_rms_after", e.heldout_rms_after},
                           {"confusable_with", e.confusable_with},
                           {"separate", e.separate}});
    for (const TraceRejected& r : trace.rejected)
        rejected.push_back({{"name", r.name}, {"why", r.why}, {"heldout_rms", r.heldout_rms}});
    for (const TraceInput& i : trace.inputs)
        inputs.push_back({{"effect", i.effect}, {"shape", i.shape}, {"weights", i.weights}});
    json["effects"] = effects;
    json["rejected"] = rejected;
    json["structure"] = correlates_json(trace.structure);
    json["rest"] = {{"signature", trace.rest_signature}, {"correlates", correlates_json(trace.rest)}};
    json["inputs"] = inputs;
    json["notes"] = trace.notes;
    return json;
}

}  // namespace dqw
