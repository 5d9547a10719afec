// monitor.html: a monitor's run as one page that opens offline.
#ifndef DQW_APP_MONITOR_PAGE_HPP
#define DQW_APP_MONITOR_PAGE_HPP

#include <string>

#include "app/monitor/report.hpp"
#include "app/page/page.hpp"

namespace dqw {

/// The whole page. Every string that may come from a file is escaped.
std::string monitor_page(const MonitorReport& report, Extent extent = Extent::whole);

}  // namespace dqw
#endif
