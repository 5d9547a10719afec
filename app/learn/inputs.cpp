#include "app/learn/inputs.hpp"
#include "dqw_effect_kind.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "app/base/columns.hpp"
#include "app/base/effect_names.hpp"
#include "app/base/input_error.hpp"
#include "app/base/learnable.hpp"
#include "app/base/modulation.hpp"
#include "app/base/text.hpp"
#include "app/learn/signals.hpp"
#include "app/read/flux_map.hpp"
#include "ref/effect/flux_table.hpp"

namespace dqw {
namespace {

using Json = nlohmann::json;

constexpr double kWidth = 0.02;        // of the largest current or speed
constexpr double kFall = 0.1;          // of the largest speed: where Stribeck's friction has gone
constexpr double kHeatTime = 0.25;     // of the log's length
constexpr double kReference_C = 25.0;  // as the tracer has it
constexpr double kOrder = 6.0;
constexpr std::size_t kMostInputs = 64;

double span_s(const std::vector<Log>& logs)
{
    double longest = 0.0;
    for (const Log& log : logs)
        if (!log.t_s.empty()) longest = std::max(longest, log.t_s.back() - log.t_s.front());
    return longest > 0.0 ? longest : 1.0;
}

std::vector<double> heat_shape(const TraceInput& in, const std::vector<Log>& logs)
{
    const bool winding = in.effect == "winding_temperature";
    const auto measured = [&](const Log& log) {
        return !log.temp_winding_C.empty() || (!winding && !log.temp_magnet_C.empty());
    };
    const double tau_s = std::all_of(logs.begin(), logs.end(), measured) ? 0.0 : kHeatTime * span_s(logs);
    return {kReference_C, tau_s, largest_current(logs)};
}

std::vector<double> usual_shape(const TraceInput& in, Shape shape, const std::vector<Log>& logs, const PlainModel& m)
{
    const auto speed = static_cast<double>(largest(logs, &Log::w_m_rad_s, &Log::w_m_rad_s));
    switch (shape) {
    case Shape::current_width: return {kWidth * largest_current(logs)};
    case Shape::current_unit: return {largest_current(logs)};
    case Shape::heat: return heat_shape(in, logs);
    case Shape::order:
    case Shape::periods_a_turn: return {kOrder};
    case Shape::R_L: return {m.R_ohm, m.Ld_H, m.Lq_H};
    case Shape::L_psi: return {m.Ld_H, m.Lq_H, m.psi_Wb};
    case Shape::speed_width: return {kWidth * speed};
    case Shape::speed_widths: return {kWidth * speed, kFall * speed};
    // Marks seconds, as the tracer does.
    case Shape::seconds:
        return logs.front().regime == Regime::dynamic ? std::vector<double>{} : std::vector<double>{1.0};
    default: return {};
    }
}

[[noreturn]] void refuse(const std::string& path, std::size_t line, const std::string& what)
{
    throw InputError(path, line, what);
}

/// `may_lack`: numbers from that one on may be null, not known, as the time constant of what warms settled rows, or the
/// current that warms what goes with time; -1: none may.
std::vector<double> numbers(const Json& object, const char* key, const std::string& path, int may_lack = -1)
{
    std::vector<double> values;
    const auto found = object.find(key);
    if (found == object.end()) return values;
    if (!found->is_array() || found->size() > 8)
        refuse(path, 1, std::string("\"") + key + "\" is not a short list of numbers");
    for (const Json& x : *found) {
        if (x.is_null() && may_lack >= 0 && may_lack <= static_cast<int>(values.size())) {
            values.push_back(std::nan(""));
            continue;
        }
        if (!x.is_number() || !std::isfinite(static_cast<float>(x.get<double>())))
            refuse(path, 1, std::string("\"") + key + "\" holds something that is no number");
        values.push_back(x.get<double>());
    }
    return values;
}

std::vector<std::int16_t> map_of(const Json& entry, const std::string& path)
{
    const auto found = entry.find("map");
    std::vector<std::int16_t> map;
    if (found == entry.end()) return map;
    const auto is_number = [](const Json& x) {
        return x.is_number_integer() && x.get<std::int64_t>() >= INT16_MIN && x.get<std::int64_t>() <= INT16_MAX;
    };
    if (found->is_array() && found->size() > DQW_EFFECT_MAP_HEAD &&
        std::all_of(found->begin(), found->end(), is_number))
        map = found->get<std::vector<std::int16_t>>();
    if (map.empty() || !dqw_effect_is_map(map.data()) || dqw_effect_map_bytes(map.data()) != sizeof map[0] * map.size())
        refuse(path, 1, "\"map\" is not the table of a flux map");
    return map;
}

TraceInput input_of(const Json& entry, const std::string& path)
{
    if (!entry.is_object() || !entry.contains("effect") || !entry["effect"].is_string())
        refuse(path, 1, "an entry of \"inputs\" names no effect");
    TraceInput in;
    in.effect = entry["effect"].get<std::string>();
    const Effect* effect = find_effect(in.effect);
    if (effect == nullptr)
        refuse(path, 1, "unknown effect " + shown(in.effect) + "; known are " + list(traced_names(), 99));
    in.shape = numbers(entry, "shape", path, effect->shape == Shape::heat ? 1 : -1);
    in.weights = numbers(entry, "weights", path);
    in.map = map_of(entry, path);
    if ((in.effect == "flux_map") != !in.map.empty())
        refuse(path, 1, in.map.empty() ? "flux_map without its \"map\"" : in.effect + " has no \"map\"");
    if (entry.contains("modulation")) {
        if (!entry["modulation"].is_string() || !modulation_named(entry["modulation"].get<std::string>()))
            refuse(path, 1, "\"modulation\" is none of centred, clamped_low, clamped_high, clamped_60");
        in.modulation = entry["modulation"].get<std::string>();
    }
    return in;
}

Machine machine_of(const Json& trace)
{
    Machine machine;
    const std::pair<const char*, std::optional<double> Machine::*> members[] = {
        {"R_ohm", &Machine::R_ohm},
        {"Ld_H", &Machine::Ld_H},
        {"Lq_H", &Machine::Lq_H},
        {"psi_Wb", &Machine::psi_Wb},
        {"pole_pairs", &Machine::pole_pairs},
        {"J_kgm2", &Machine::J_kgm2},
        {"B_Nms_rad", &Machine::B_Nms_rad},
    };
    for (const auto& [name, member] : members) {
        const Json::json_pointer place(std::string("/after/parameters/") + name + "/value");
        if (!trace.contains(place)) continue;
        const Json& value = trace.at(place);
        // Start values only: what no machine has starts nothing.
        if (value.is_number() && value.get<double>() > 0.0 && std::isfinite(static_cast<float>(value.get<double>())))
            machine.*member = value.get<double>();
    }
    if (machine.pole_pairs && (*machine.pole_pairs != std::floor(*machine.pole_pairs) || *machine.pole_pairs > 1000.0))
        machine.pole_pairs.reset();
    return machine;
}

}  // namespace

LearnConfig read_learn_config(const std::string& path)
{
    std::error_code unknown;
    if (std::filesystem::is_directory(path, unknown))
        refuse(path, 0, "is a directory; expected the trace.json of `dqwatch trace`");
    std::ifstream file(path, std::ios::binary);
    if (!file) refuse(path, 0, "cannot be opened; expected the trace.json of `dqwatch trace`");
    const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    if (file.bad() || text.empty())
        refuse(path, 1, "is empty or cannot be read; expected the trace.json of `dqwatch trace`");
    return learn_config_of(path, text);
}

LearnConfig learn_config_of(const std::string& path, const std::string& text)
{
    Json trace;
    try {
        trace = Json::parse(text);
    } catch (const Json::parse_error& error) {
        const auto byte = static_cast<std::ptrdiff_t>(std::min(error.byte, text.size()));
        refuse(path, 1 + static_cast<std::size_t>(std::count(text.begin(), text.begin() + byte, '\n')),
               "no JSON here; expected the trace.json of `dqwatch trace`");
    } catch (const Json::exception&) {
        refuse(path, 1, "holds a number that is out of range");
    }
    if (!trace.is_object() || !trace.contains("inputs") || !trace["inputs"].is_array())
        refuse(path, 1, "no list \"inputs\"; expected the trace.json of `dqwatch trace`");
    if (trace.contains("schema") && trace["schema"] != "dqwatch.trace/1")
        refuse(path, 1, "\"schema\" is not dqwatch.trace/1; expected the trace.json of this release's `dqwatch trace`");
    if (trace["inputs"].size() > kMostInputs) refuse(path, 1, "more than " + std::to_string(kMostInputs) + " inputs");
    LearnConfig config;
    for (const Json& entry : trace["inputs"]) config.inputs.push_back(input_of(entry, path));
    config.start = machine_of(trace);
    return config;
}

void add_effects(LearnConfig& config, const std::vector<std::string>& names)
{
    for (const std::string& name : names) {
        const auto is_it = [&](const TraceInput& in) { return in.effect == name; };
        if (std::none_of(config.inputs.begin(), config.inputs.end(), is_it)) config.inputs.push_back({name, {}, {}});
    }
}

void add_flux_map(LearnConfig& config, const std::vector<Log>& logs)
{
    const std::string& path = logs.front().machine.flux_map;
    if (path.empty() || logs.front().regime == Regime::mechanical) return;
    const auto bends = [](const TraceInput& in) {
        return in.effect == "flux_map" || in.effect == "saturation" || in.effect == "cross_saturation";
    };
    const auto known = std::find_if(config.inputs.begin(), config.inputs.end(), bends);
    if (known != config.inputs.end())
        throw std::invalid_argument("the machine file's flux_map and the effect " + known->effect +
                                    " both say how the iron bends; take one of them");
    FluxRange range;
    for (const Log& log : logs) {
        for (const double i : log.i_d_A)
            range.least_d_A = std::min(range.least_d_A, i), range.most_d_A = std::max(range.most_d_A, i);
        for (const double i : log.i_q_A) range.most_q_A = std::max(range.most_q_A, std::abs(i));
    }
    const FluxMap map = read_flux_map(path);
    try {
        config.inputs.insert(config.inputs.begin(), flux_table(map, range));
    } catch (const std::invalid_argument& error) {
        refuse(path, 0, error.what());
    }
}

void note_flux_map(const std::vector<Log>& logs, Result& result)
{
    const std::string& path = logs.front().machine.flux_map;
    if (path.empty() || logs.front().regime == Regime::mechanical) return;
    constexpr double kOff = 0.05, kDeviations = 4.0;
    const double map_Wb = between(read_flux_map(path), 0.0, 0.0).psi_d_Wb;
    for (const Estimate& e : result.parameters)
        if (e.name == "psi_Wb" && !e.given && std::abs(e.value - map_Wb) > std::max(kOff * map_Wb, kDeviations * e.sd))
            result.notes.push_back(
                fmt::format("warning: ψ is {:.4g} Wb, in the flux map {:.4g} Wb: another magnet, or it has changed",
                            e.value, map_Wb));
}

std::vector<std::string> effects_of(const LearnConfig& config)
{
    std::vector<std::string> names;
    for (const TraceInput& in : config.inputs)
        for (const std::string& name : in.effect == "flux_map"
                                           ? std::vector<std::string>{"saturation", "cross_saturation"}
                                           : std::vector<std::string>{in.effect})
            if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    return names;
}

bool needs_machine(const std::vector<TraceInput>& inputs)
{
    return std::any_of(inputs.begin(), inputs.end(),
                       [](const TraceInput& in) { return in.shape.empty() && shape_needs_machine(in.effect); });
}

std::vector<TraceInput> completed(std::vector<TraceInput> inputs, const std::vector<Log>& logs,
                                  const PlainModel& machine)
{
    const bool mechanical = logs.front().regime == Regime::mechanical;
    for (TraceInput& in : inputs) {
        const auto name = effect_named(in.effect);
        if (!name) throw std::invalid_argument("unknown effect " + in.effect);
        if (dqw_effect_is_mechanical(*name) != mechanical)
            throw std::invalid_argument(in.effect + " is not an effect that a " + name_of(logs.front().regime) +
                                        " log can have");
        for (const Log& log : logs)
            if (log.regime == Regime::steady && log.theta_e_rad.empty() && log.theta_m_rad.empty() &&
                needs_angle(in.effect))
                throw std::invalid_argument(log.path + ": " + in.effect +
                                            " needs an angle column: settled rows do not integrate to one");
        const std::vector<double> usual = usual_shape(in, row_of(*name).shape, logs, machine);
        for (std::size_t i = in.shape.size(); i < usual.size(); ++i) in.shape.push_back(usual[i]);
        in.reach = heat_reach(in, logs);
    }
    return inputs;
}

}  // namespace dqw
