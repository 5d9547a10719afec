// A trace as JSON (schema dqwatch.trace/1) and as text.
#ifndef DQW_APP_TRACE_REPORT_HPP
#define DQW_APP_TRACE_REPORT_HPP

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "ref/trace/trace.hpp"

namespace dqw {

/// A trace, and what the learners of lib/ make of the same rows.
struct TraceReport {
    TraceResult trace;
    std::optional<TraceFit> learner_before, learner_after;
    std::vector<std::string> logs;
};

/// The object of schema dqwatch.trace/1. Beyond it: `sentence`, `remark`, `logs`, `axes` of each fit, `separate`,
/// `structure`, `rest`, `inputs`, `notes`.
nlohmann::ordered_json trace_json(const TraceReport& report);

/// A trace for people at a terminal, notes left out: they go to stderr.
std::string trace_text(const TraceReport& report);

}  // namespace dqw
#endif
