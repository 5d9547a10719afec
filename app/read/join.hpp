// Channels that were polled one after another: voltages beside currents by the nearest stamp, where nothing moves.
#ifndef DQW_APP_READ_JOIN_HPP
#define DQW_APP_READ_JOIN_HPP

#include <cstddef>

#include "ref/log/log.hpp"

namespace dqw {

/// Puts v_d, v_q of `control` beside the rows of `stats` (E136). Rows that are further from any stamp than the longer
/// of both usual intervals are dropped; their number. Both logs have t_s.
std::size_t join_voltages(Log& stats, const Log& control);

/// Drops rows beside which speed or voltage differs: by 2 % of the speed's RMS, 3 % of the voltage's. Their number.
std::size_t keep_settled(Log& log);

}  // namespace dqw
#endif
