// What the monitor knows of each channel, in the units of its name.
#ifndef DQW_APP_MONITOR_READINGS_HPP
#define DQW_APP_MONITOR_READINGS_HPP

#include <array>
#include <limits>

#include "dqw_monitor.h"

namespace dqw {

/// NaN: not known, or there is none.
struct MonitorReading {
    double value = std::numeric_limits<double>::quiet_NaN(), sd = value, healthy = value;
};
using MonitorReadings = std::array<MonitorReading, DQW_WATCH_CHANNELS>;

/// What 1 of the monitor's own unit of a channel is in that of its name: radians for the flux on the other axis, one phase's or one
/// sensor's share for the witness' weights.
double channel_unit(const dqw_monitor& m, int channel);

/// All channels. A weight without a deviation has no value; nothing is healthy before service, nor
/// while healthy values are being taken. No temperature where alpha_per_K is 0.
MonitorReadings readings_of(const dqw_monitor& m);

}  // namespace dqw
#endif
