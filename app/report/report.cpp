#include "app/report/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "app/base/columns.hpp"
#include "app/base/parameters.hpp"
#include "app/base/quantity.hpp"
#include "app/base/text.hpp"

namespace dqw {

using Json = nlohmann::ordered_json;

static Json number(double value)
{
    // Pole pairs as an integer; a number that is not finite has no JSON form.
    if (!std::isfinite(value)) return nullptr;
    if (value == std::floor(value) && std::fabs(value) < 1e6) return static_cast<long>(value);
    return value;
}

Json parameters_json(const std::vector<Estimate>& parameters)
{
    Json json = Json::object();
    for (const Estimate& e : parameters) {
        Json& entry = json[e.name];
        entry["value"] = e.name == "pole_pairs" ? number(e.value) : Json(e.value);
        if (e.given)
            entry["given"] = true;
        else
            entry["sd"] = e.sd;
        const auto& machine = known_parameters();
        if (std::find(machine.begin(), machine.end(), e.name) == machine.end()) continue;
        const std::string why = why_not_usable(e);
        entry["usable"] = why.empty();
        if (!why.empty()) entry["why"] = why;
    }
    return json;
}

std::string not_usable_text(const std::vector<Estimate>& parameters)
{
    std::string out;
    for (const Estimate& e : parameters)
        if (!why_not_usable(e).empty()) out += (out.empty() ? "not usable: " : ", ") + symbol(e.name);
    return out;
}

Json axes_json(const std::vector<AxisResidual>& axes)
{
    Json json = Json::array();
    for (const AxisResidual& a : axes) json.push_back({{"axis", a.axis}, {"rms", a.rms}, {"percent", a.percent}});
    return json;
}

Json result_json(const Result& result, const Machine& nominal, const std::vector<TraceEffect>& effects)
{
    Json json = {{"schema", "dqwatch.parameters/1"}, {"rows", result.rows}, {"regime", name_of(result.regime)}};
    Json& parameters = json["parameters"] = parameters_json(result.parameters);
    for (const Estimate& e : result.parameters)
        if (const auto said = nominal_of(nominal, e.name); said && !e.given) parameters[e.name]["nominal"] = *said;
    Json& found = json["effects"] = Json::array();
    for (const TraceEffect& e : effects)
        found.push_back({{"name", e.name}, {"parameters", parameters_json(e.parameters)}});
    Json& missing = json["not_identifiable"] = Json::array();
    for (const NotIdentifiable& n : result.not_identifiable)
        missing.push_back({{"name", n.name}, {"why", n.why}, {"excitation", n.excitation}});
    json["residual"] = {{"rms", result.residual_rms}, {"unit", result.residual_unit}, {"axes", axes_json(result.axes)}};
    json["notes"] = result.notes;
    return json;
}

void name_what_was_left_out(Result& result, const std::vector<std::string>& asked)
{
    for (const std::string& name : asked) {
        const auto is_it = [&](const auto& entry) { return entry.name == name; };
        if (std::any_of(result.parameters.begin(), result.parameters.end(), is_it)) continue;
        if (std::any_of(result.not_identifiable.begin(), result.not_identifiable.end(), is_it)) continue;
        const bool mechanical = result.regime == Regime::mechanical;
        result.not_identifiable.push_back({name, fmt::format("not estimated from a {} log", name_of(result.regime)),
                                           mechanical ? "a log with voltages" : "a log of another regime"});
    }
}

std::string json_text(const Json& json) { return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n"; }

static std::string parameter_table(const std::vector<Estimate>& parameters, const Machine& nominal)
{
    const bool any_nominal = std::any_of(parameters.begin(), parameters.end(),
                                         [&](const Estimate& e) { return !e.given && nominal_of(nominal, e.name); });
    std::vector<std::vector<std::string>> rows = {{"parameter", "value", "sd", "unit"}};
    if (any_nominal) rows[0].insert(rows[0].end(), {"nominal", "difference"});
    for (const Estimate& e : parameters) {
        const Quantity q = quantity(e.name, e.value, e.given ? 0.0 : e.sd);
        std::vector<std::string> row = {e.name, q.value, e.given ? "given" : q.sd, q.unit};
        const auto said = nominal_of(nominal, e.name);
        if (said && !e.given) {
            row.push_back(number_like(q, e.name, *said));
            row.push_back(*said != 0 ? fmt::format("{:+.2f} %", 100 * (e.value - *said) / *said) : "");
        }
        rows.push_back(row);
    }
    return rows.size() > 1 ? table(rows) : "";
}

static std::string effect_table(const std::vector<TraceEffect>& effects)
{
    if (effects.empty()) return "";
    std::vector<std::vector<std::string>> rows = {{"effect", "parameter", "value", "sd", "unit"}};
    for (const TraceEffect& effect : effects)
        for (const Estimate& e : effect.parameters) {
            const Quantity q = quantity(e.name, e.value, e.given ? 0.0 : e.sd);
            rows.push_back({&e == &effect.parameters.front() ? effect.name : "", e.name, q.value,
                            e.given ? "given" : q.sd, q.unit});
        }
    return "\n" + table(rows);
}

std::string result_text(const Result& result, const Machine& nominal, const std::vector<TraceEffect>& effects)
{
    const std::string doubtful = not_usable_text(result.parameters);
    std::string out = fmt::format("{}, {}{}\n\n", name_of(result.regime), counted(result.rows, "row"),
                                  doubtful.empty() ? "" : "; " + doubtful);
    const std::string parameters = parameter_table(result.parameters, nominal);
    out += parameters;
    if (!result.not_identifiable.empty())
        out += parameters.empty() ? "not identifiable from this log\n" : "\nnot identifiable from this log\n";
    for (const NotIdentifiable& n : result.not_identifiable) {
        out += fmt::format("  {}: {}\n", n.name, n.why);
        if (!n.excitation.empty()) out += fmt::format("    what would help: {}\n", n.excitation);
    }
    out += fmt::format("\nresidual {:.4g} {}", result.residual_rms, result.residual_unit);
    for (const AxisResidual& a : result.axes)
        out += fmt::format("{} {} {:.4g} {} ({:.3g} %)", &a == &result.axes[0] ? ":" : ",", a.axis, a.rms,
                           result.residual_unit, a.percent);
    return out + "\n" + effect_table(effects);
}

}  // namespace dqw
