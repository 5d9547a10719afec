// A log under the condition monitor.
#ifndef DQW_APP_JOB_MONITOR_HPP
#define DQW_APP_JOB_MONITOR_HPP

#include <functional>
#include <string>
#include <vector>

#include "app/job/options.hpp"
#include "app/monitor/report.hpp"
#include "ref/log/log.hpp"

namespace dqw {

/// Is told what happens when it does; notes are in the report as well.
struct MonitorListener {
    std::function<void(const std::vector<std::string>&)> notes = {};
    std::function<void(const MonitorEvent&)> event = {};
};

/// A monitored log; in fixed point with the header with which firmware runs the same.
struct Monitored {
    MonitorReport report;
    std::string q15_header = {};
};

/// Reads what is to be monitored; throws InputError.
std::vector<Log> logs_to_monitor(const Options& options, std::vector<std::string>& notes);

/// How the monitor is configured for what `options` name.
MonitorSetup setup_to_monitor(const Options& options);

/// Monitors the first of them; `notes` stand before its own. Throws InputError.
Monitored monitor_logs(const std::vector<Log>& logs, const Options& options, std::vector<std::string> notes,
                       const MonitorListener& listener);

/// Monitors rows as they come from options.logs, "-" for standard input, until they end or an interrupt comes. Throws
/// InputError.
Monitored monitor_pipe(const Options& options, const MonitorListener& listener);

}  // namespace dqw
#endif
