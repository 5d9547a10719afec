// The fields of the ROS message VescState, whatever wrote them down.
#ifndef DQW_APP_FORMAT_VESC_STATE_HPP
#define DQW_APP_FORMAT_VESC_STATE_HPP

#include "app/format/format.hpp"

namespace dqw {

/// Takes all columns but the time, by the ends of the fields' names.
void vesc_state(Import& in);

}  // namespace dqw
#endif
