// A monitor's run in words and numbers: events as lines, summary, tables that text and page share.
#ifndef DQW_APP_MONITOR_REPORT_HPP
#define DQW_APP_MONITOR_REPORT_HPP

#include <string>
#include <vector>

#include "app/monitor/estimator.hpp"
#include "app/monitor/run.hpp"

namespace dqw {

struct MonitorReport {
    std::string log;
    MonitorRun run;
    std::vector<std::string> notes;
};

/// One object of schema dqwatch.event/1, one line. Beyond it: since_s, healthy, and phase where the fault has one.
std::string event_json(const MonitorEvent& event);
/// The same for people, one line.
std::string event_text(const MonitorEvent& event);

/// One object of schema dqwatch.sensitivity/1, one line: of each channel the smallest change that would be told,
/// whether it is watched, and why not.
std::string sensitivity_json(const MonitorRun& run);

/// Where a monitor is now, as one object: stage, why it is not in service, of each channel what it knows, its band, the
/// smallest change that would be told, whether it is watched; what was refused.
std::string status_json(const MonitorEngine& monitor);
/// The same of an estimator alone: values where they are known, and whether they are usable.
std::string status_json(const EstimatorEngine& estimator);

/// What came of it, in one sentence.
std::string monitor_outcome(const MonitorRun& run);

/// What is another value since; half a sentence.
std::string relearned_text(const MonitorRelearned& relearned);

using MonitorRows = std::vector<std::vector<std::string>>;
/// Healthy and last values of what is watched, and the smallest change that would be told; the first row is the
/// heading. Called by title, or as in the events.
MonitorRows value_rows(const MonitorRun& run, bool titles);
/// What is not watched, or in name only: names, and why.
MonitorRows unwatched_rows(const MonitorRun& run, bool titles);
/// Stage, rows, what was refused, events.
MonitorRows summary_rows(const MonitorRun& run);
MonitorRows event_rows(const MonitorRun& run, std::size_t most);

/// After the events: summary and values.
std::string monitor_text(const MonitorRun& run);

}  // namespace dqw
#endif
