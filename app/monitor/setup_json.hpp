// A monitor's configuration as JSON, so that it can be said, kept and given back without a log.
#ifndef DQW_APP_MONITOR_SETUP_JSON_HPP
#define DQW_APP_MONITOR_SETUP_JSON_HPP

#include <string>

#include "app/monitor/setup.hpp"

namespace dqw {

/// One object: the fields of the configurations by their names, `period_s`, `modulation`, `band` by channel, `inputs`.
std::string setup_json(const MonitorSetup& setup);

/// The setup that it says. What is left out is as a nameplate has it (dqw_monitor_config_default); nameplate values are
/// period_s, v_base_V, i_base_A, w_base_rad_s, pole_pairs. Throws std::invalid_argument on a key that is none, or a
/// value of another kind.
MonitorSetup setup_of_json(const std::string& text);

}  // namespace dqw
#endif
