// How the monitor is configured for a log.
#ifndef DQW_APP_MONITOR_SETUP_HPP
#define DQW_APP_MONITOR_SETUP_HPP

#include <string>
#include <vector>

#include "app/learn/inputs.hpp"
#include "dqw_monitor.h"
#include "ref/log/log.hpp"

namespace dqw {

struct MonitorSetup {
    dqw_monitor_config config{};     ///< but for its effects
    std::vector<TraceInput> inputs;  ///< those effects, shapes completed
    std::vector<std::string> notes;  ///< what is assumed, and what is not watched
    double speed_lag_s = 0.0;        ///< of the log's speed, which was brought forward
};

/// For the first of `logs`. Bases from the nameplate in the machine file, else from the log's largest signals; nominal
/// values from the machine file, else `asked.start`, else learned from the log's first seconds. Throws InputError for a
/// log that is not dynamic, or without pole pairs; std::invalid_argument for effects that there is no room for.
MonitorSetup monitor_setup(const std::vector<Log>& logs, const LearnConfig& asked);

}  // namespace dqw
#endif
