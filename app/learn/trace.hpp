// A trace's result in the float learners: what they make of the same rows, without and with the effects found.
#ifndef DQW_APP_LEARN_TRACE_HPP
#define DQW_APP_LEARN_TRACE_HPP

#include "ref/trace/trace.hpp"

namespace dqw {

/// Runs the learners over the rows that the trace did not hold out, and judges them on blocks of those that it did,
/// (E43); percent are of the signal that the trace has.
/// Throws std::invalid_argument as learn() does.
TraceFit learn_fit(const std::vector<Log>& logs, const TraceResult& trace, bool with_effects);

}  // namespace dqw
#endif
