// monitor.html: a monitor's run as one page that opens offline.
#ifndef DQW_APP_MONITOR_PAGE_HPP
#define DQW_APP_MONITOR_PAGE_HPP

#include <string>
#include <vector>

#include "monitor_report.hpp"
#include "plot.hpp"

namespace dqw {

/// Each channel over time with its 95 % band, its healthy value and the events; what was never known is left out.
std::vector<Plot> monitor_plots(const MonitorRun& run);

/// The whole page. Every string that may come from a file is escaped.
std::string monitor_page(const MonitorReport& report);

}  // namespace dqw
#endif
