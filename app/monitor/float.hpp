// The monitor of lib/.
#ifndef DQW_APP_MONITOR_FLOAT_HPP
#define DQW_APP_MONITOR_FLOAT_HPP

#include <memory>

#include "app/monitor/engine.hpp"

namespace dqw {

/// Throws std::invalid_argument where the monitor refuses its configuration; `setup` stays in use as long as the
/// engine.
std::unique_ptr<MonitorEngine> float_monitor(const MonitorSetup& setup);

}  // namespace dqw
#endif
