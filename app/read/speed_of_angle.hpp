// The speed that an angle shows, where the log has none.
#ifndef DQW_APP_READ_SPEED_OF_ANGLE_HPP
#define DQW_APP_READ_SPEED_OF_ANGLE_HPP

#include <vector>

namespace dqw {

/// (E134): the slope of the unwrapped angle at each row, by a straight line through up to ten rows on either side.
/// From row to row the angle must go less than half a turn.
std::vector<double> slope_of_angle(const std::vector<double>& t_s, const std::vector<double>& theta_rad);

}  // namespace dqw
#endif
