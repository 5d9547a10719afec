#include "app/base/effect_names.hpp"

#include <algorithm>
#include <cctype>
#include <iterator>
#include <stdexcept>

#include "dqw_effect_kind.h"
#include "dqw_text.h"

namespace dqw {
namespace {

/// What the monitor has an input of its own for.
constexpr Law kWatched[] = {Law::dead_time, Law::current_offset, Law::current_gain_mismatch, Law::angle_offset,
                            Law::phase_resistance_imbalance};

}  // namespace

const std::vector<std::string>& effect_names()
{
    static const std::vector<std::string> names = [] {
        std::vector<std::string> all;
        for (int id = 1; id < DQW_EFFECT_NAMES; ++id)
            all.emplace_back(dqw_effect_text(static_cast<dqw_effect_name>(id)));
        return all;
    }();
    return names;
}

std::optional<dqw_effect_name> effect_named(const std::string& name)
{
    const auto& names = effect_names();
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) return std::nullopt;
    return static_cast<dqw_effect_name>(found - names.begin() + 1);
}

std::string enumerator_of(const std::string& name)
{
    std::string text = "DQW_EFFECT_";
    for (const char c : name) text += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    return text;
}

const Effect& row_of(dqw_effect_name name)
{
    const Effect* effect = find_effect(dqw_effect_text(name));
    if (effect == nullptr) throw std::invalid_argument(std::string("unknown effect ") + dqw_effect_text(name));
    return *effect;
}

bool monitor_watches(const std::string& name)
{
    const Effect* effect = find_effect(name);
    return effect != nullptr && std::count(std::begin(kWatched), std::end(kWatched), effect->id) > 0;
}

bool needs_angle(const std::string& name)
{
    const auto id = effect_named(name);
    return id && (dqw_effect_needs(*id) & DQW_NEEDS_ANGLE) != 0;
}

bool shape_needs_machine(const std::string& name)
{
    const Effect* effect = find_effect(name);
    return effect != nullptr && (effect->shape == Shape::R_L || effect->shape == Shape::L_psi);
}

double angle_order(const TraceInput& in)
{
    const Effect* effect = find_effect(in.effect);
    if (effect == nullptr) return 0.0;
    return effect->order < 0.0 ? in.shape[0] : effect->order;
}

dqw_effect_config effect_config(const TraceInput& input)
{
    const auto name = effect_named(input.effect);
    if (!name) throw std::invalid_argument("unknown effect " + input.effect);
    dqw_effect_config config{};
    config.effect = *name;
    const auto shapes = static_cast<std::size_t>(numbers_of(row_of(*name).shape));
    for (std::size_t i = 0; i < std::min(shapes, input.shape.size()); ++i)
        config.shape[i] = static_cast<float>(input.shape[i]);
    const auto weights = static_cast<std::size_t>(dqw_effect_weights(*name));
    for (std::size_t i = 0; i < std::min(weights, input.weights.size()); ++i)
        config.start[i] = static_cast<float>(input.weights[i]);
    if (!input.map.empty()) config.map = input.map.data();
    return config;
}

}  // namespace dqw
