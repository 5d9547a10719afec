// Logs to a trace: what the tracer finds, and what the learners make of the same rows.
#ifndef DQW_APP_JOB_TRACE_HPP
#define DQW_APP_JOB_TRACE_HPP

#include <string>
#include <vector>

#include "app/job/options.hpp"
#include "app/trace/report.hpp"
#include "ref/log/log.hpp"

namespace dqw {

/// Reads what is to be traced, polled logs as looks of settled points; throws InputError.
std::vector<Log> logs_to_trace(const Options& options, std::vector<std::string>& notes);

/// Traces them; `notes` stand before the trace's own. Throws InputError.
TraceReport trace_logs(const std::vector<Log>& logs, const Options& options, const std::vector<std::string>& notes);

}  // namespace dqw
#endif
