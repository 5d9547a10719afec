// The parts of report.html that are text and tables.
#ifndef DQW_APP_TRACE_SECTIONS_HPP
#define DQW_APP_TRACE_SECTIONS_HPP

#include <string>

#include "app/trace/report.hpp"

namespace dqw {

/// HTML of each part; empty where there is nothing to say.
std::string error_card(const TraceReport& report);
std::string parameter_card(const TraceReport& report);
/// What firmware's learners make of the same rows.
std::string learner_section(const TraceReport& report);
std::string effect_section(const TraceResult& trace);
/// What each candidate would leave, as bars, with why those that were not taken were not.
std::string candidate_section(const TraceResult& trace);
std::string rest_section(const TraceResult& trace);
std::string notes_section(const TraceReport& report);

}  // namespace dqw
#endif
