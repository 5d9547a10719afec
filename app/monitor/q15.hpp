// The monitor of port_q15/, as a core without floating point would run it.
#ifndef DQW_APP_MONITOR_Q15_HPP
#define DQW_APP_MONITOR_Q15_HPP

#include <memory>

#include "app/monitor/engine.hpp"
#include "dqw_monitor_q15.h"

namespace dqw {

/// Throws std::invalid_argument where the monitor refuses its configuration; `setup` stays in use as long as the
/// engine.
std::unique_ptr<MonitorEngine> q15_monitor(const MonitorSetup& setup);

/// With what q15_monitor() runs. Throws std::invalid_argument for what fixed point does not take.
dqw_monitor_q15_config q15_monitor_config(const MonitorSetup& setup);

}  // namespace dqw
#endif
