// What to log next, so that a trace can tell more.
#ifndef DQW_APP_TRACE_ADVICE_HPP
#define DQW_APP_TRACE_ADVICE_HPP

#include <string>
#include <vector>

#include "ref/trace/trace.hpp"

namespace dqw {

/// One text each: of an effect that has look-alikes, the experiment that tells them apart, with a simulation that shows
/// it; of a parameter that is not usable, what excites it. Empty where the log tells all.
std::vector<std::string> advice_of(const TraceResult& trace);

}  // namespace dqw
#endif
