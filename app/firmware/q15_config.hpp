// dqw_q15_config.h: full scales, nominal values and Q formats of the fixed-point port, for firmware.
#ifndef DQW_APP_FIRMWARE_Q15_CONFIG_HPP
#define DQW_APP_FIRMWARE_Q15_CONFIG_HPP

#include <string>
#include <vector>

#include "dqw_monitor_q15.h"
#include "ref/effect/found.hpp"
#include "ref/log/log.hpp"
#include "ref/log/result.hpp"

namespace dqw {

/// A C99 header for port_q15/: full scales with which `learn --arith q15` learns these logs, nominal values from
/// `found`, else from the logs' machine; the effects `inputs`, if there are any.
/// Throws std::invalid_argument (one line) where a signal is more than fixed point takes. Not for mechanical logs.
std::string q15_config_text(const std::vector<Log>& logs, const std::vector<Estimate>& found,
                            const std::vector<TraceInput>& inputs);

/// The same for the monitor: with what `monitor --arith q15` ran over `log`, whole, with the effects `inputs` that it
/// learned.
std::string q15_monitor_text(const dqw_monitor_q15_config& config, const std::string& log,
                             const std::vector<TraceInput>& inputs);

}  // namespace dqw
#endif
