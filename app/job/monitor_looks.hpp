// A slow log under the condition monitor: averages or settled points, look by look.
#ifndef DQW_APP_JOB_MONITOR_LOOKS_HPP
#define DQW_APP_JOB_MONITOR_LOOKS_HPP

#include <string>
#include <vector>

#include "app/job/monitor.hpp"

namespace dqw {

/// Is the log one of averages or settled points?
bool is_slow(const Log& log);

/// As monitor_logs(), of such a log. Throws InputError.
Monitored monitor_looks(const Log& log, const Options& options, std::vector<std::string> notes,
                        const MonitorListener& listener);

}  // namespace dqw
#endif
