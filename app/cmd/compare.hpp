// `compare`: float, fixed point and the reference fit on one log.
#ifndef DQW_APP_CMD_COMPARE_HPP
#define DQW_APP_CMD_COMPARE_HPP

#include "app/cmd/command.hpp"

namespace dqw {

Command add_compare(CLI::App& app);

}  // namespace dqw
#endif
