// What turns a machine in which no current flows.
#ifndef DQW_REF_FIT_DRAG_HPP
#define DQW_REF_FIT_DRAG_HPP

#include <string>
#include <vector>

#include "ref/log/log.hpp"

namespace dqw {

/// Iron and friction by speed, in words; empty where no torque is logged at five speeds.
///
/// Source   (E162) in docs/EQUATIONS.md
/// Units    of each number in the text
std::string drag_of(const std::vector<Log>& logs);

}  // namespace dqw
#endif
