// A trace for people at a terminal.
#ifndef DQW_APP_TRACE_TEXT_HPP
#define DQW_APP_TRACE_TEXT_HPP

#include <string>

#include "app/trace/report.hpp"

namespace dqw {

/// A trace for people, notes left out: they go to stderr.
std::string trace_text(const TraceReport& report);

}  // namespace dqw
#endif
