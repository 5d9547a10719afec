#include "app/report/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/base/columns.hpp"
#include "app/base/quantity.hpp"
#include "app/base/text.hpp"

namespace dqw {

using Json = nlohmann::ordered_json;

std::optional<double> nominal_of(const Machine& machine, const std::string& parameter)
{
    const std::pair<const char*, std::optional<double> Machine::*> members[] = {
        {"R_ohm", &Machine::R_ohm},
        {"Ld_H", &Machine::Ld_H},
        {"Lq_H", &Machine::Lq_H},
        {"psi_Wb", &Machine::psi_Wb},
        {"pole_pairs", &Machine::pole_pairs},
        {"J_kgm2", &Machine::J_kgm2},
        {"B_Nms_rad", &Machine::B_Nms_rad},
        {"torque_constant_Nm_A", &Machine::torque_constant_Nm_A},
    };
    for (const auto& [name, member] : members)
        if (parameter == name) return machine.*member;
    return {};
}

static Json number(double value)
{
    // Pole pairs and the like as integers; a number that is not finite has no JSON form.
    if (!std::isfinite(value)) return nullptr;
    if (value == std::floor(value) && std::fabs(value) < 1e6) return static_cast<long>(value);
    return value;
}

Json result_json(const Result& result, const Machine& nominal)
{
    Json json = {{"schema", "dqwatch.parameters/1"}, {"rows", result.rows}, {"regime", name_of(result.regime)}};
    Json parameters = Json::object();
    for (const Estimate& e : result.parameters) {
        Json entry = {{"value", e.name == "pole_pairs" ? number(e.value) : Json(e.value)}};
        if (e.given)
            entry["given"] = true;
        else
            entry["sd"] = e.sd;
        const auto said = nominal_of(nominal, e.name);
        if (said && !e.given) entry["nominal"] = *said;
        parameters[e.name] = entry;
    }
    json["parameters"] = parameters;
    json["effects"] = Json::array();
    Json missing = Json::array();
    for (const NotIdentifiable& n : result.not_identifiable)
        missing.push_back({{"name", n.name}, {"why", n.why}, {"excitation", n.excitation}});
    json["not_identifiable"] = missing;
    Json axes = Json::array();
    for (const AxisResidual& a : result.axes)
        axes.push_back({{"axis", a.axis}, {"rms", a.rms}, {"percent", a.percent}});
    json["residual"] = {{"rms", result.residual_rms}, {"unit", result.residual_unit}, {"axes", axes}};
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

std::string result_text(const Result& result, const Machine& nominal)
{
    std::string out = fmt::format("{}, {}\n\n", name_of(result.regime), counted(result.rows, "row"));
    bool any_nominal = false;
    for (const Estimate& e : result.parameters) any_nominal = any_nominal || (!e.given && nominal_of(nominal, e.name));
    std::vector<std::vector<std::string>> rows = {{"parameter", "value", "sd", "unit"}};
    if (any_nominal) rows[0].insert(rows[0].end(), {"nominal", "difference"});
    for (const Estimate& e : result.parameters) {
        const Quantity q = quantity(e.name, e.value, e.given ? 0.0 : e.sd);
        std::vector<std::string> row = {e.name, q.value, e.given ? "given" : q.sd, q.unit};
        const auto said = nominal_of(nominal, e.name);
        if (said && !e.given) {
            row.push_back(number_like(q, e.name, *said));
            row.push_back(*said != 0 ? fmt::format("{:+.2f} %", 100 * (e.value - *said) / *said) : "");
        }
        rows.push_back(row);
    }
    if (rows.size() > 1) out += table(rows);
    if (!result.not_identifiable.empty())
        out += rows.size() > 1 ? "\nnot identifiable from this log\n" : "not identifiable from this log\n";
    for (const NotIdentifiable& n : result.not_identifiable) {
        out += fmt::format("  {}: {}\n", n.name, n.why);
        if (!n.excitation.empty()) out += fmt::format("    what would help: {}\n", n.excitation);
    }
    out += fmt::format("\nresidual {:.4g} {}", result.residual_rms, result.residual_unit);
    for (const AxisResidual& a : result.axes)
        out += fmt::format("{} {} {:.4g} {} ({:.3g} %)", &a == &result.axes[0] ? ":" : ",", a.axis, a.rms,
                           result.residual_unit, a.percent);
    return out + "\n";
}

}  // namespace dqw
