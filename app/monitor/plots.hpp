// What a monitor's run is drawn as.
#ifndef DQW_APP_MONITOR_PLOTS_HPP
#define DQW_APP_MONITOR_PLOTS_HPP

#include <vector>

#include "app/monitor/run.hpp"
#include "app/page/plot.hpp"

namespace dqw {

/// Each channel over time with its 95 % band, its healthy value and the events; what was never known is left out.
std::vector<Plot> monitor_plots(const MonitorRun& run);

}  // namespace dqw
#endif
