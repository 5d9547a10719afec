// Pole pairs that the plain fit does not tell, since it lacks what the trace finds.
#ifndef DQW_REF_TRACE_POLE_PAIRS_HPP
#define DQW_REF_TRACE_POLE_PAIRS_HPP

#include "ref/trace/trace.hpp"

namespace dqw {

/// (E125) `as_it_stands` is the trace without pole pairs, whose real ones the plain fit has: the trace under the whole
/// number near those that leaves nothing unexplained, or `as_it_stands` where none stands out.
TraceResult under_whole_pole_pairs(const std::vector<Log>& logs, const TraceOptions& options, TraceResult as_it_stands);

}  // namespace dqw
#endif
