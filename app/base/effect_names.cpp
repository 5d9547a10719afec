#include "app/base/effect_names.hpp"

#include <algorithm>
#include <cctype>
#include <iterator>
#include <stdexcept>

#include "dqw_effect_kind.h"
#include "dqw_text.h"

namespace dqw {
namespace {

/// What an effect is to the command, a row each.
struct Row {
    dqw_effect_name id;
    std::size_t shapes;  ///< numbers that the law's shape has
    unsigned needs = 0;  ///< bits of `Needs`
    double order =
        /// times the electrical angle with which it comes and goes on the axes; -1: its shape says; 0: not with the
        /// angle
        0.0;
};
enum Needs : unsigned {
    machine = 1,  ///< R, L_d, L_q or psi in a shape that is not given
    watched = 2   ///< the monitor has an input of its own for it
};

constexpr Row kRows[] = {
    {DQW_EFFECT_DEAD_TIME, 1, watched},
    {DQW_EFFECT_SATURATION, 1},
    {DQW_EFFECT_CROSS_SATURATION, 1},
    {DQW_EFFECT_WINDING_TEMPERATURE, 3},
    {DQW_EFFECT_MAGNET_TEMPERATURE, 3},
    {DQW_EFFECT_IRON_LOSS, 3, machine},
    {DQW_EFFECT_FLUX_HARMONICS, 1, 0, -1.0},
    {DQW_EFFECT_CURRENT_OFFSET, 3, machine | watched, 1.0},
    {DQW_EFFECT_CURRENT_GAIN_MISMATCH, 3, machine | watched, 2.0},
    {DQW_EFFECT_ANGLE_OFFSET, 3, machine | watched},
    {DQW_EFFECT_DELAY, 0},
    {DQW_EFFECT_SKIN_EFFECT, 0},
    {DQW_EFFECT_PHASE_RESISTANCE_IMBALANCE, 0, watched, 2.0},
    {DQW_EFFECT_VOLTAGE_OFFSET, 0},
    {DQW_EFFECT_COULOMB_FRICTION, 1},
    {DQW_EFFECT_DIRECTION_ASYMMETRY, 1},
    {DQW_EFFECT_STRIBECK_FRICTION, 2},
    {DQW_EFFECT_COGGING_TORQUE, 1},
    {DQW_EFFECT_LOAD_TORQUE, 0},
};
static_assert(std::size(kRows) == DQW_EFFECT_NAMES - 1, "an effect lacks its row");

const Row* row_of(const std::string& name)
{
    const auto found = std::find_if(std::begin(kRows), std::end(kRows),
                                    [&](const Row& r) { return name == dqw_effect_text(r.id); });
    return found == std::end(kRows) ? nullptr : found;
}

bool needs(const std::string& name, Needs what)
{
    const Row* row = row_of(name);
    return row != nullptr && (row->needs & what) != 0;
}

}  // namespace

const std::vector<std::string>& effect_names()
{
    static const std::vector<std::string> names = [] {
        std::vector<std::string> all;
        for (const Row& row : kRows) all.emplace_back(dqw_effect_text(row.id));
        return all;
    }();
    return names;
}

std::optional<dqw_effect_name> effect_named(const std::string& name)
{
    const Row* row = row_of(name);
    return row != nullptr ? std::optional(row->id) : std::nullopt;
}

std::string enumerator_of(const std::string& name)
{
    std::string text = "DQW_EFFECT_";
    for (const char c : name) text += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    return text;
}

bool monitor_watches(const std::string& name) { return needs(name, watched); }
bool needs_angle(const std::string& name)
{
    const Row* row = row_of(name);
    return row != nullptr && (dqw_effect_needs(row->id) & DQW_NEEDS_ANGLE) != 0;
}

bool shape_needs_machine(const std::string& name) { return needs(name, machine); }

double angle_order(const TraceInput& in)
{
    const Row* row = row_of(in.effect);
    if (row == nullptr) return 0.0;
    return row->order < 0.0 ? in.shape[0] : row->order;
}

std::size_t shapes_of(dqw_effect_name name)
{
    const auto found = std::find_if(std::begin(kRows), std::end(kRows), [&](const Row& r) { return r.id == name; });
    return found == std::end(kRows) ? 0 : found->shapes;
}

dqw_effect_config effect_config(const TraceInput& input)
{
    const auto name = effect_named(input.effect);
    if (!name) throw std::invalid_argument("unknown effect " + input.effect);
    dqw_effect_config config{};
    config.effect = *name;
    for (std::size_t i = 0; i < std::min(shapes_of(*name), input.shape.size()); ++i)
        config.shape[i] = static_cast<float>(input.shape[i]);
    const auto weights = static_cast<std::size_t>(dqw_effect_weights(*name));
    for (std::size_t i = 0; i < std::min(weights, input.weights.size()); ++i)
        config.start[i] = static_cast<float>(input.weights[i]);
    return config;
}

}  // namespace dqw
