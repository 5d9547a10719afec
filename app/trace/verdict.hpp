// What a trace found, in words: one sentence for each effect, and what the plain model made of it.
#ifndef DQW_APP_TRACE_VERDICT_HPP
#define DQW_APP_TRACE_VERDICT_HPP

#include <string>

#include "ref/trace/trace.hpp"

namespace dqw {

/// "The inverter loses 3.6 ± 0.1 V per phase (dead time)." Without its sentence's parameters: their names and values. A
/// flux is told at the largest currents of `blocks`.
std::string effect_sentence(const TraceEffect& effect, const TraceBlocks& blocks);

/// The verdict: a sentence for each effect, and the base parameter that was most wrong without them. For a clean log,
/// and for one that nothing of the catalogue fits, what the plain model leaves against the log's own noise.
std::string verdict_sentence(const TraceResult& trace);

/// The same, and which parameters are not usable: what is read first, and often alone.
std::string verdict_line(const TraceResult& trace);

/// What must be said beside it: look-alikes, and what is left. Empty where there is nothing.
std::string verdict_remark(const TraceResult& trace);

/// "dead time" for dead_time.
std::string spoken(const std::string& name);

/// "delay or dead time": what this log cannot tell an effect from.
std::string look_alikes_of(const TraceEffect& effect);

}  // namespace dqw
#endif
