#include "app/trace/advice.hpp"

#include <fmt/format.h>

#include "app/base/parameters.hpp"
#include "app/base/quantity.hpp"
#include "app/trace/verdict.hpp"
#include "ref/effect/effect.hpp"
#include "ref/fit/explain.hpp"

namespace dqw {
namespace {

/// "dqwatch sim servo --set …, traced, names it so"; empty where no scenario does.
std::string shown(const TraceEffect& e)
{
    const Effect* row = find_effect(e.name);
    if (!row || !*row->show) return "";
    const std::string call = row->show, scenario = call.substr(0, call.find(' '));
    return fmt::format("; such a log: dqwatch sim {} && dqwatch trace {}.csv", call, scenario);
}

}  // namespace

std::vector<std::string> advice_of(const TraceResult& trace)
{
    std::vector<std::string> out;
    for (const TraceEffect& e : trace.effects)
        if (!e.confusable_with.empty() && !e.separate.empty())
            out.push_back(fmt::format("{} or {}: {}{}", spoken(e.name), look_alikes_of(e), e.separate, shown(e)));
    for (const Estimate& p : trace.after.parameters)
        if (p.times_pole_pairs)
            out.push_back(fmt::format("{}: the pole pairs, --pole-pairs N", symbol(p.name)));
        else if (!p.given && !why_not_usable(p).empty())
            out.push_back(fmt::format("{}: {}", symbol(p.name),
                                      p.observed ? kForObserved : excitation_for(p.name, trace.regime)));
    return out;
}

}  // namespace dqw
