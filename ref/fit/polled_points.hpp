// Settled rows of polled logs as looks of so many seconds that what one is off by says nothing of the next.
#ifndef DQW_REF_FIT_POLLED_POINTS_HPP
#define DQW_REF_FIT_POLLED_POINTS_HPP

#include <vector>

#include "ref/log/log.hpp"

namespace dqw {

/// Fewer tell no effect from chance: half of them are held out.
constexpr std::size_t kLeastLooks = 30;

struct PolledPoints {
    std::vector<Log> logs;  ///< settled points, a look each
    double look_s = 0.0;    ///< its most
    std::size_t looks = 0;  ///< of all logs
};

/// Until errors of neighbours have nothing in common, or looks are whole operating points, or fewer would be too few.
///
/// Source   (E158) in docs/EQUATIONS.md
/// Throws   as settled_logs()
PolledPoints polled_points(const std::vector<Log>& logs);

}  // namespace dqw
#endif
