#include "ref/trace/clue.hpp"

#include <algorithm>
#include <cmath>

namespace dqw {
namespace {

/// What is said of a thing that a residual goes with.
struct Meaning {
    const char* with;      ///< as a correlate says it; one that ends in a space is the beginning of it
    const char* spoken;    ///< empty: as it is
    const char* in_motor;  ///< what does that in a drive's voltage; empty: too much does
    const char* in_shaft;  ///< and in its torque
};

constexpr Meaning kMeanings[] = {
    {"angle, order 1", "the electrical angle, once a turn", "an offset of the current sensors or of the inverter", ""},
    {"angle, order 2", "twice the electrical angle",
     "phases that are unlike: a sensor's gain, a resistance, shorted turns", ""},
    {"angle, order 3", "three times the electrical angle", "an inverter of which the lowest or highest leg rests", ""},
    {"angle, order 6", "six times the electrical angle", "an inverter's dead time, or harmonics of the magnet's flux",
     ""},
    {"angle, order 12", "twelve times the electrical angle",
     "an inverter's dead time, or harmonics of the magnet's flux", ""},
    {"signs of the phase currents", "", "an inverter: its dead time and what its switches drop", ""},
    {"time", "", "something that drifts or changed once: heat, the link's voltage, a sensor",
     "a load or a friction that changes"},
    {"speed", "", "what grows with speed: losses in the iron, an angle or a row of another instant",
     "friction of another law, or a load that goes with speed"},
    {"temperature", "", "a resistance or a magnet that warms otherwise than the column says", "a lubricant that warms"},
    {"i_d", "", "iron that saturates, or a sensor that is not straight", ""},
    {"i_q", "", "iron that saturates, or a sensor that is not straight",
     "a torque that does not go with the current: iron that saturates"},
    {"voltage", "", "a voltage that is not what acted: a wrong scale, a link that sags, an inverter at its limit", ""},
    {"a line ", "", "a source of its own: the mains, a shaft that resonates, a controller's own signal",
     "a shaft or a load that resonates"},
};

const Meaning* meaning_of(const std::string& with)
{
    for (const Meaning& m : kMeanings) {
        const std::string key = m.with;
        if (with == key || (key.back() == ' ' && with.rfind(key, 0) == 0)) return &m;
    }
    return nullptr;
}

/// A shaft's angle has orders of its own; what does that is told of no single one.
std::string spoken(const TraceCorrelate& c, Regime regime)
{
    const Meaning* m = meaning_of(c.with);
    return m && *m->spoken && regime != Regime::mechanical ? m->spoken : c.with;
}

}  // namespace

std::string clue_of(const std::vector<TraceCorrelate>& rest, Regime regime)
{
    constexpr std::size_t kMost = 3;
    // Part of the residual: below, what it goes with most is not what makes it.
    constexpr double kLeastOfIt = 0.25;
    if (rest.empty()) return "what remains goes with nothing that was tested";
    std::string text = "what remains goes with ";
    for (std::size_t k = 0; k < std::min(rest.size(), kMost); ++k)
        text += (k > 0 ? ", " : "") + spoken(rest[k], regime) + " (axis " + rest[k].axis + ", " +
                std::to_string(static_cast<int>(std::lround(100.0 * rest[k].share))) + " % of it)";
    const TraceCorrelate& most = rest.front();
    const Meaning* m = meaning_of(most.with);
    const std::string why = !m ? "" : regime == Regime::mechanical ? m->in_shaft : m->in_motor;
    return most.share < kLeastOfIt || why.empty() ? text : text + "; what does that is most often " + why;
}

}  // namespace dqw
