// What a residual that has no name looks like, in words.
#ifndef DQW_REF_TRACE_CLUE_HPP
#define DQW_REF_TRACE_CLUE_HPP

#include "ref/trace/trace.hpp"

namespace dqw {

/// One sentence without its full stop: what the residual goes with, strongest first, and what in a drive does that. It
/// names no effect: others may look like it.
std::string clue_of(const std::vector<TraceCorrelate>& rest, Regime regime);

}  // namespace dqw
#endif
