// Sampling period, gaps and voltage interval of a log in memory.
#ifndef DQW_APP_READ_TIME_BASE_HPP
#define DQW_APP_READ_TIME_BASE_HPP

#include <cstddef>
#include <vector>

#include "ref/log/log.hpp"

namespace dqw {

/// Who stamps the rows: the controller, evenly; a host, when they arrive; nobody says.
enum class Clock { own, host, unknown };

/// What the time column looks like. An interval above 1.5 medians is a gap; of a host's stamps, and of others that
/// jitter, one above four times what nine of ten intervals stay below.
struct TimeBase {
    double median_s = 0.0;
    std::vector<std::size_t> gaps;  ///< rows that begin behind a gap
    double longest_gap_s = 0.0;
    double gap_s = 0.0;    ///< an interval above it is a gap
    bool regular = false;  ///< at most one interval in ten is a gap
};

/// Looks at strictly increasing times. The median is of at most 100 000 intervals, spread evenly.
TimeBase time_base_of(const std::vector<double>& t_s, Clock clock = Clock::own);

/// Moves voltages that row k holds for t_{k-1}..t_k to row k-1, and drops each segment's last row, which then has none.
/// Returns the number of rows dropped.
std::size_t turn_voltage_interval(Log& log);

}  // namespace dqw
#endif
