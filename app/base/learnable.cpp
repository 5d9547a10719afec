#include "app/base/learnable.hpp"

#include <algorithm>

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

std::string not_learned(const std::string& name)
{
    const Effect* effect = find_effect(name);
    if (effect == nullptr || effect->not_learned[0] == '\0') return "";
    return name + " is not learned: " + effect->not_learned;
}

std::vector<TraceInput> learnable(const std::vector<TraceInput>& inputs)
{
    std::vector<TraceInput> out;
    for (const TraceInput& in : inputs)
        if (not_learned(in.effect).empty()) out.push_back(in);
    return out;
}

std::vector<std::string> notes_on_others(const std::vector<TraceInput>& inputs)
{
    std::vector<std::string> out;
    for (const TraceInput& in : inputs) {
        const std::string why = not_learned(in.effect);
        if (!why.empty() && std::find(out.begin(), out.end(), why) == out.end()) out.push_back(why);
    }
    return out;
}

}  // namespace dqw
