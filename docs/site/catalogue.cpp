// The site's pages of effects and of faults, as the code's own tables have them: `catalogue effects`, `catalogue
// faults`.
#include <fmt/format.h>

#include <cstring>
#include <string>

#include "app/monitor/names.hpp"
#include "dqw_fault_kind.h"
#include "dqw_text.h"
#include "ref/effect/effect.hpp"

namespace {

using namespace dqw;

std::string asks_of(unsigned bits)
{
    static const struct {
        unsigned bit;
        const char* text;
    } names[] = {{asks_turns, "the machine turns"},      {asks_sweep, "its angle covers a turn"},
                 {asks_currents, "the currents change"}, {asks_points, "currents or speed change"},
                 {asks_speeds, "the speed changes"},     {asks_shaft, "the shaft's angle is known over a turn"}};
    std::string out;
    for (const auto& name : names)
        if (bits & name.bit) out += (out.empty() ? "" : ", ") + std::string(name.text);
    return out.empty() ? "nothing more" : out;
}

bool is_alike(const Effect& a, const Effect& b)
{
    if (&a == &b || a.mechanical() != b.mechanical()) return false;
    if (a.mechanical()) return true;
    if (a.order != 0.0) return a.order == b.order;
    return (a.is & is_like_turning_v) && (b.is & is_like_turning_v);
}

/// Effects that one operating point shows alike: a ripple of the same order; a voltage that turns with the rotor.
std::string alike(const Effect& effect)
{
    std::string out;
    for (const Effect& other : effects())
        if (is_alike(effect, other)) out += fmt::format("{}[`{}`](#{})", out.empty() ? "" : ", ", other.name, other.name);
    return out.empty() ? "what goes with the same currents and speeds in that log" : out;
}

const char* turns_of(const Effect& effect)
{
    if (effect.mechanical()) return "torque";
    if (effect.order == 0.0) return "a voltage that goes with currents and speed";
    if (effect.order < 0.0) return "ripples of its own order of the electrical angle";
    return effect.order == 1.0 ? "a ripple once an electrical turn" : "a ripple twice an electrical turn";
}

void tell(const Effect& e)
{
    std::string title = e.name, parameters;
    for (char& c : title)
        if (c == '_') c = ' ';
    for (const EffectParameter& p : e.parameters)
        parameters += fmt::format("{}`{}` ({:g} to {:g})", parameters.empty() ? "" : ", ", p.name, p.least, p.most);
    fmt::print("### {} {{#{}}}\n\n{}.\n\n", capital(title), e.name, capital(e.law));
    fmt::print("| | |\n| --- | --- |\n");
    fmt::print("| name | `{}` |\n| parameters, and where they are believed | {} |\n", e.name, parameters);
    fmt::print("| leaves | {} |\n", turns_of(e));
    fmt::print("| tested where | {} |\n", e.asks.moving == e.asks.settled
                                              ? asks_of(e.asks.moving)
                                              : asks_of(e.asks.moving) + "; settled rows: " + asks_of(e.asks.settled));
    fmt::print("| may look like | {} |\n", alike(e));
    fmt::print("| what tells it from them | {} |\n", e.separate);
    fmt::print("| firmware | {} |\n", *e.not_learned ? "not learned: " + std::string(e.not_learned) : "learned");
    if (*e.show) fmt::print("| simulate one | `dqwatch sim {}` |\n", e.show);
    fmt::print("\n");
}

void tell_effects()
{
    fmt::print("# Effects\n\nWhat `dqwatch trace` tries beside the plain machine, as its catalogue has it. The laws are (E50) to (E55) and "
               "(E113) to (E121) in the [equations](equations.md). Which effects one log cannot tell apart the trace finds for "
               "that log, and lists; here, under `may look like`, are those that leave the same kind of trace.\n\n## Electrical\n\n");
    for (const Effect& e : effects())
        if (!e.mechanical()) tell(e);
    fmt::print("## Of the shaft\n\n");
    for (const Effect& e : effects())
        if (e.mechanical()) tell(e);
}

void tell_faults()
{
    fmt::print("# Faults\n\nWhat the condition monitor names, as its tables have it. What to do about each: [events](integration.md#events). "
               "How a name is chosen: (E63), (E64) in the [equations](equations.md).\n\n"
               "| fault | it says | the phase | either sign | moves R | by a ripple twice a turn |\n"
               "| --- | --- | --- | --- | --- | --- |\n");
    for (int n = DQW_FAULT_NONE + 1; n < DQW_FAULT_NAMES; ++n) {
        const auto name = static_cast<dqw_fault_name>(n);
        const dqw_fault_verdict a{name, 1.0f, 0};
        const auto yes = [](bool is) { return is ? "yes" : ""; };
        fmt::print("| `{}` | {} | {} | {} | {} | {} |\n", dqw_fault_text(name), capital(fault_told(a)), yes(*phase_of(a) != 0),
                   yes(dqw_fault_either_sign(name)), yes(dqw_fault_moves_R(name)), yes(dqw_fault_ripples(name)));
    }
    fmt::print("\nWhere a fault has a phase, it is named; the sentences here are of phase a.\n\n## What is watched\n\n| channel | name |\n| --- | --- |\n");
    for (int channel = 0; channel < DQW_WATCH_CHANNELS; ++channel)
        fmt::print("| {} | `{}` |\n", channel_named(channel).title, channel_named(channel).parameter);
}

}  // namespace

int main(int argc, char** argv)
{
    if (argc == 2 && !std::strcmp(argv[1], "effects")) return tell_effects(), 0;
    if (argc == 2 && !std::strcmp(argv[1], "faults")) return tell_faults(), 0;
    fmt::print(stderr, "usage: catalogue effects|faults\n");
    return 2;
}
