// `compare`: float, fixed point and the reference fit on one log.
#ifndef DQW_APP_CMD_COMPARE_HPP
#define DQW_APP_CMD_COMPARE_HPP

#include "app/cmd/command.hpp"

namespace dqw {

int compare_command(const Options& options);

}  // namespace dqw
#endif
