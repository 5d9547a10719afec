// A speed that is late beside the angle, as behind a filter or from a loop that tracks it.
#ifndef DQW_REF_LOG_SPEED_LAG_HPP
#define DQW_REF_LOG_SPEED_LAG_HPP

#include <cstddef>
#include <vector>

#include "ref/log/log.hpp"

namespace dqw {

/// By how much the speed of dynamic logs is late beside their angle, which is a sensor's. (E193)
///
/// Returns  s; 0: not by more than two rows, not told, or there is no such angle
/// Cost     three passes
double speed_lag_s(const std::vector<Log>& logs);

/// Brings a late speed forward, `w + lag dw/dt`, row by row and from one piece of a log to the next.
class SpeedForward {
public:
    SpeedForward(double lag_s, double dt_s);
    /// In place; begins anew at each of rows.segments.
    void over(Log& rows);

private:
    double at(double w_m_rad_s);

    double rows_;                 ///< of the lag
    std::vector<double> before_;  ///< the last ones, a ring
    std::size_t next_ = 0, kept_ = 0;
};

}  // namespace dqw
#endif
