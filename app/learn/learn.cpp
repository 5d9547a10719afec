#include "app/learn/learn.hpp"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

#include "app/base/learnable.hpp"
#include "app/base/parameters.hpp"
#include "app/learn/electrical.hpp"
#include "app/learn/mechanical.hpp"
#include "app/learn/parts.hpp"
#include "app/learn/q15.hpp"

namespace dqw {
namespace {

void check(const std::vector<Log>& logs, const LearnOptions& options)
{
    const std::vector<std::string>& known = known_parameters();
    for (const std::string& name : options.parameters)
        if (std::find(known.begin(), known.end(), name) == known.end())
            throw std::invalid_argument("unknown parameter '" + name + "'");
    if (logs.empty()) throw std::invalid_argument("no log");
    for (const Log& log : logs) {
        if (log.regime != logs.front().regime)
            throw std::invalid_argument(log.path + ": its regime differs from " + logs.front().path);
        const bool timed = log.regime == Regime::dynamic || log.regime == Regime::mechanical;
        if (timed && std::abs(log.dt_s / logs.front().dt_s - 1.0) > 1e-3)
            throw std::invalid_argument(log.path + ": its sampling period differs from " + logs.front().path +
                                        "; learn them one at a time");
    }
}

}  // namespace

namespace {

Learned learn_those(const std::vector<Log>& logs, const LearnOptions& options)
{
    if (logs.front().regime == Regime::mechanical) return learn_mechanical(logs, options);
    return options.fixed_point ? learn_q15(logs, options) : learn_electrical(logs, options);
}

/// A flux map is the machine's where its bend counts once.
void note_weights(Learned& learned)
{
    constexpr double kOff = 0.05, kDeviations = 4.0;
    for (const TraceEffect& effect : learned.effects)
        for (const Estimate& e : effect.parameters)
            if (effect.name == "flux_map" && !e.given && std::isfinite(e.sd) &&
                std::abs(e.value - 1.0) > std::max(kOff, kDeviations * e.sd))
                learned.result.notes.push_back(
                    fmt::format("warning: the flux map is not this machine's, or the iron has changed: {} is {:.3g} ± "
                                "{:.2g}, expected 1",
                                e.name, e.value, e.sd));
}

}  // namespace

Learned learn_all(const std::vector<Log>& logs, const LearnOptions& options)
{
    check(logs, options);
    if (options.heldout_row != nullptr && options.heldout_row->size() != all_rows(logs))
        throw std::invalid_argument("not one mark for each row of what is held out");
    LearnOptions those = options;
    those.inputs = learnable(options.inputs);
    Learned learned = learn_those(logs, those);
    note_weights(learned);
    for (const std::string& note : notes_on_others(options.inputs)) learned.result.notes.push_back(note);
    return learned;
}

Result learn(const std::vector<Log>& logs, const LearnOptions& options) { return learn_all(logs, options).result; }

}  // namespace dqw
