// What a monitor knows of each channel, in the units of its name, whatever arithmetic it runs in.
#ifndef DQW_APP_MONITOR_READINGS_HPP
#define DQW_APP_MONITOR_READINGS_HPP

#include <array>
#include <cstdint>
#include <limits>

#include "dqw_parameter.h"
#include "dqw_watch.h"
#include "dqw_why.h"
#include "dqw_witness.h"

namespace dqw {

/// NaN: not known, or there is none.
struct MonitorReading {
    double value = std::numeric_limits<double>::quiet_NaN(), sd = value, healthy = value;
};
using MonitorReadings = std::array<MonitorReading, DQW_WATCH_CHANNELS>;

/// The smallest change of a channel that would be told, NaN where there is none, and why it is not watched; `said`
/// where the monitor of lib/ has no word for it.
struct MonitorSight {
    double least = std::numeric_limits<double>::quiet_NaN();
    double band =
        least;  ///< a change by less is healthy, however sure; NaN where there is no healthy value, or a limit
    dqw_why why = DQW_WHY_NO_BLOCK;
    const char* said = nullptr;
};
using MonitorSights = std::array<MonitorSight, DQW_WATCH_CHANNELS>;

/// What it has measured, SI. A deviation is infinite where nothing is known.
struct MonitorMeasures {
    std::array<double, DQW_WATCH_OFFSET> weight, weight_sd, healthy;
    std::array<double, DQW_WITNESS_INPUTS> ripple, ripple_sd, healthy_ripple;
    double friction_Nm, friction_sd_Nm, healthy_friction_Nm;
    double cold_R_ohm, alpha_per_K;
    double residual_V, healthy_residual_V;
    std::uint32_t blocks;
    bool friction_known, in_service, resting;
};

/// What 1 of a monitor's own unit of a channel is in that of its name: radians for the flux on the other axis, one
/// phase's or one sensor's share for the witness' weights.
double channel_unit(const MonitorMeasures& m, int channel);

/// All channels. A weight without a deviation has no value; nothing is healthy before service, nor
/// while healthy values are being taken. No temperature where alpha_per_K is 0.
MonitorReadings readings_of(const MonitorMeasures& m);

}  // namespace dqw
#endif
