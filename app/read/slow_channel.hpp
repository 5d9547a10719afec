// A channel so slow that its last value may stand for a missing one: link voltage and temperatures.
#ifndef DQW_APP_READ_SLOW_CHANNEL_HPP
#define DQW_APP_READ_SLOW_CHANNEL_HPP

#include <string>
#include <vector>

#include "app/base/columns.hpp"

namespace dqw {

/// Puts the first value before it, where there is none yet. What is wrong with the channel, or nothing: it has no value
/// at all, or, where `doubted`, temperatures of no sensor.
std::string settle_slow_channel(Column column, std::vector<double>& values, bool doubted);

}  // namespace dqw
#endif
