#include "app/base/learnable.hpp"

#include <algorithm>
#include <cmath>

#include "ref/effect/effect.hpp"

namespace dqw {

const std::vector<std::string>& traced_names()
{
    static const std::vector<std::string> names = [] {
        std::vector<std::string> all;
        for (const Effect& e : effects()) all.emplace_back(e.name);
        return all;
    }();
    return names;
}

std::string not_learned(const TraceInput& in)
{
    const Effect* effect = find_effect(in.effect);
    if (effect == nullptr) return "";
    std::string why = effect->not_learned;
    if (effect->shape == Shape::heat && in.shape.size() > 1 && !std::isfinite(in.shape[1]))
        why = "settled rows do not tell its time constant";
    else if (effect->shape == Shape::heat && in.shape.size() > 2 && !std::isfinite(in.shape[2]))
        why = "its heat goes with time, not with the currents, and no thermometer shows it";
    return why.empty() ? "" : in.effect + " is not learned: " + why;
}

std::vector<TraceInput> learnable(const std::vector<TraceInput>& inputs)
{
    std::vector<TraceInput> out;
    for (const TraceInput& in : inputs)
        if (not_learned(in).empty()) out.push_back(in);
    return out;
}

std::vector<std::string> notes_on_others(const std::vector<TraceInput>& inputs)
{
    std::vector<std::string> out;
    for (const TraceInput& in : inputs) {
        const std::string why = not_learned(in);
        if (!why.empty() && std::find(out.begin(), out.end(), why) == out.end()) out.push_back(why);
    }
    return out;
}

}  // namespace dqw
