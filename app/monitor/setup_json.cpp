#include "app/monitor/setup_json.hpp"

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "app/base/modulation.hpp"
#include "app/base/text.hpp"
#include "app/learn/inputs.hpp"
#include "app/learn/parts.hpp"
#include "app/monitor/names.hpp"

namespace dqw {
namespace {

using Json = nlohmann::ordered_json;
using Estimator = dqw_estimator_config;
using Monitor = dqw_monitor_config;

template <class Object, class Value> struct Field {
    const char* name;
    Value Object::*place;
};

constexpr Field<Estimator, float> estimator_numbers[] = {
    {"period_s", &Estimator::dt_s},
    {"v_base_V", &Estimator::v_base_V},
    {"i_base_A", &Estimator::i_base_A},
    {"w_base_rad_s", &Estimator::w_base_rad_s},
    {"R_ohm", &Estimator::R_ohm},
    {"Ld_H", &Estimator::Ld_H},
    {"Lq_H", &Estimator::Lq_H},
    {"psi_Wb", &Estimator::psi_Wb},
    {"v_limit_V", &Estimator::v_limit_V},
    {"i_limit_A", &Estimator::i_limit_A},
    {"excitation_pu", &Estimator::excitation_pu},
    {"dead_time_width_A", &Estimator::dead_time_width_A},
    {"angle_late_s", &Estimator::angle_late_s},
    {"voltage_error_V", &Estimator::voltage_error_V},
};
constexpr Field<Estimator, std::uint16_t> estimator_small[] = {
    {"pole_pairs", &Estimator::pole_pairs},
    {"half_window", &Estimator::half_window},
};
constexpr Field<Estimator, std::uint32_t> estimator_counts[] = {
    {"stale_limit", &Estimator::stale_limit},
    {"threshold_ppm", &Estimator::threshold_ppm},
    {"voltage_scale_ppm", &Estimator::voltage_scale_ppm},
};
constexpr Field<Estimator, bool> estimator_switches[] = {
    {"observed", &Estimator::observed},
    {"angle", &Estimator::angle},
    {"encoder_offset", &Estimator::encoder_offset},
    {"follow", &Estimator::follow},
    {"noise_on_inputs", &Estimator::noise_on_inputs},
    {"voltage_next", &Estimator::voltage_next},
    {"voltage_held", &Estimator::voltage_held},
};
constexpr Field<Monitor, float> monitor_numbers[] = {
    {"alpha_per_K", &Monitor::alpha_per_K},
    {"beta_per_K", &Monitor::beta_per_K},
    {"heating_K_s", &Monitor::heating_K_s},
    {"J_kgm2", &Monitor::J_kgm2},
};

[[noreturn]] void refuse(const std::string& key, const std::string& expected)
{
    throw std::invalid_argument(key + " of a monitor; expected " + expected);
}

double number_of(const std::string& key, const Json& value)
{
    if (!value.is_number() || !std::isfinite(value.get<double>())) refuse(key, "a finite number");
    return value.get<double>();
}

template <class Whole> Whole whole_of(const std::string& key, const Json& value)
{
    const double number = number_of(key, value);
    if (number != std::floor(number) || number < 0.0 || number > static_cast<double>(std::numeric_limits<Whole>::max()))
        refuse(key, "a whole number from 0 to " + std::to_string(std::numeric_limits<Whole>::max()));
    return static_cast<Whole>(number);
}

bool switch_of(const std::string& key, const Json& value)
{
    if (!value.is_boolean()) refuse(key, "true or false");
    return value.get<bool>();
}

template <class Object, class Value, std::size_t n, class Read>
bool take(const Field<Object, Value> (&fields)[n], Object& object, const std::string& key, const Json& value, Read read)
{
    for (const auto& field : fields)
        if (key == field.name) {
            object.*(field.place) = static_cast<Value>(read(key, value));
            return true;
        }
    return false;
}

template <class Object, class Value, std::size_t n>
void put(const Field<Object, Value> (&fields)[n], const Object& object, Json& json)
{
    for (const auto& field : fields) json[field.name] = object.*(field.place);
}

void take_bands(const Json& value, Monitor& config)
{
    if (!value.is_object()) refuse("band", "an object of channels");
    for (const auto& [channel, band] : value.items()) {
        int found = -1;
        for (int c = 0; c < DQW_WATCH_CHANNELS; ++c)
            if (channel == channel_named(c).parameter) found = c;
        if (found < 0) refuse("band." + channel, "a channel such as R_ohm or psi_Wb");
        config.band[found] = static_cast<float>(number_of("band." + channel, band));
    }
}

void take_modulation(const Json& value, Estimator& config)
{
    const auto name = value.is_string() ? modulation_named(value.get<std::string>()) : std::nullopt;
    if (!name) refuse("modulation", "centred, clamped_low, clamped_high or clamped_60");
    config.modulation = *name;
}

/// The inputs as a trace.json has them, and how far a heating state reaches.
void take_inputs(const Json& value, MonitorSetup& setup)
{
    setup.inputs = learn_config_of("inputs", Json{{"inputs", value}}.dump()).inputs;
    for (std::size_t i = 0; i < setup.inputs.size(); ++i)
        if (value[i].contains("reach")) setup.inputs[i].reach = number_of("inputs.reach", value[i]["reach"]);
    check_room(setup.inputs);
}

dqw_nameplate plate_of(const Json& json)
{
    dqw_nameplate plate{};
    const auto take_number = [&](const char* key, float& to) {
        if (json.contains(key)) to = static_cast<float>(number_of(key, json[key]));
    };
    take_number("period_s", plate.dt_s);
    take_number("v_base_V", plate.v_V);
    take_number("i_base_A", plate.i_A);
    take_number("w_base_rad_s", plate.w_m_rad_s);
    if (json.contains("pole_pairs")) plate.pole_pairs = whole_of<std::uint16_t>("pole_pairs", json["pole_pairs"]);
    return plate;
}

}  // namespace

std::string setup_json(const MonitorSetup& setup)
{
    const Estimator& e = setup.config.estimator;
    Json json = Json::object();
    put(estimator_numbers, e, json);
    put(estimator_small, e, json);
    put(estimator_counts, e, json);
    put(estimator_switches, e, json);
    put(monitor_numbers, setup.config, json);
    json["commissioned"] = setup.config.commissioned;
    json["modulation"] = modulation_text(e.modulation);
    Json band = Json::object();
    for (int c = 0; c < DQW_WATCH_CHANNELS; ++c) band[channel_named(c).parameter] = setup.config.band[c];
    json["band"] = band;
    Json inputs = Json::array();
    for (const TraceInput& in : setup.inputs) {
        inputs.push_back({{"effect", in.effect}, {"shape", in.shape}, {"weights", in.weights}, {"reach", in.reach}});
        if (!in.modulation.empty()) inputs.back()["modulation"] = in.modulation;
        if (!in.map.empty()) inputs.back()["map"] = in.map;
    }
    json["inputs"] = inputs;
    return json.dump();
}

MonitorSetup setup_of_json(const std::string& text)
{
    const Json json = Json::parse(text, nullptr, false);
    if (!json.is_object()) throw std::invalid_argument("a monitor's configuration; expected an object of JSON");
    MonitorSetup setup;
    const dqw_nameplate plate = plate_of(json);
    setup.config = dqw_monitor_config_default(&plate);
    Estimator& e = setup.config.estimator;
    for (const auto& [key, value] : json.items()) {
        const bool taken = take(estimator_numbers, e, key, value, number_of) ||
                           take(estimator_small, e, key, value, whole_of<std::uint16_t>) ||
                           take(estimator_counts, e, key, value, whole_of<std::uint32_t>) ||
                           take(estimator_switches, e, key, value, switch_of) ||
                           take(monitor_numbers, setup.config, key, value, number_of);
        if (taken) continue;
        if (key == "commissioned")
            setup.config.commissioned = switch_of(key, value);
        else if (key == "modulation")
            take_modulation(value, e);
        else if (key == "band")
            take_bands(value, setup.config);
        else if (key == "inputs")
            take_inputs(value, setup);
        else
            throw std::invalid_argument("no " + shown(key) + " in a monitor; see help(dqwatch.Monitor)");
    }
    return setup;
}

}  // namespace dqw
