#include "app/base/effect_names.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <stdexcept>

#include "dqw_text.h"

namespace dqw {
namespace {

struct Shapes {
    dqw_effect_name id;
    std::size_t count;
};

/// In the order of the enumerators.
constexpr std::array<Shapes, DQW_EFFECT_NAMES - 1> kShapes{{
    {DQW_EFFECT_DEAD_TIME, 1},
    {DQW_EFFECT_SATURATION, 1},
    {DQW_EFFECT_CROSS_SATURATION, 1},
    {DQW_EFFECT_WINDING_TEMPERATURE, 3},
    {DQW_EFFECT_MAGNET_TEMPERATURE, 3},
    {DQW_EFFECT_IRON_LOSS, 3},
    {DQW_EFFECT_FLUX_HARMONICS, 1},
    {DQW_EFFECT_CURRENT_OFFSET, 3},
    {DQW_EFFECT_CURRENT_GAIN_MISMATCH, 3},
    {DQW_EFFECT_ANGLE_OFFSET, 3},
    {DQW_EFFECT_DELAY, 0},
    {DQW_EFFECT_SKIN_EFFECT, 0},
    {DQW_EFFECT_PHASE_RESISTANCE_IMBALANCE, 0},
    {DQW_EFFECT_VOLTAGE_OFFSET, 0},
    {DQW_EFFECT_COULOMB_FRICTION, 1},
    {DQW_EFFECT_DIRECTION_ASYMMETRY, 1},
    {DQW_EFFECT_STRIBECK_FRICTION, 2},
    {DQW_EFFECT_COGGING_TORQUE, 1},
    {DQW_EFFECT_LOAD_TORQUE, 0},
}};

}  // namespace

const std::vector<std::string>& effect_names()
{
    static const std::vector<std::string> names = [] {
        std::vector<std::string> all;
        for (const Shapes& s : kShapes) all.emplace_back(dqw_effect_text(s.id));
        return all;
    }();
    return names;
}

std::optional<dqw_effect_name> effect_named(const std::string& name)
{
    for (const Shapes& s : kShapes)
        if (name == dqw_effect_text(s.id)) return s.id;
    return {};
}

std::string enumerator_of(const std::string& name)
{
    std::string text = "DQW_EFFECT_";
    for (const char c : name) text += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    return text;
}

bool monitor_watches(const std::string& name)
{
    static const char* const names[] = {"dead_time", "angle_offset", "current_offset", "current_gain_mismatch", "phase_resistance_imbalance"};
    return std::find(std::begin(names), std::end(names), name) != std::end(names);
}

std::size_t shapes_of(dqw_effect_name name)
{
    for (const Shapes& s : kShapes)
        if (name == s.id) return s.count;
    return 0;
}

dqw_effect_config effect_config(const TraceInput& input)
{
    const auto name = effect_named(input.effect);
    if (!name) throw std::invalid_argument("unknown effect " + input.effect);
    dqw_effect_config config{};
    config.effect = *name;
    for (std::size_t i = 0; i < std::min(shapes_of(*name), input.shape.size()); ++i) config.shape[i] = static_cast<float>(input.shape[i]);
    const auto weights = static_cast<std::size_t>(dqw_effect_weights(*name));
    for (std::size_t i = 0; i < std::min(weights, input.weights.size()); ++i) config.start[i] = static_cast<float>(input.weights[i]);
    return config;
}

}  // namespace dqw
