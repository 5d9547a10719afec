// `monitor`: the condition monitor over one log, that of lib/ or that of port_q15/.
#ifndef DQW_APP_CMD_MONITOR_HPP
#define DQW_APP_CMD_MONITOR_HPP

#include "app/cmd/command.hpp"

namespace dqw {

int monitor_command(const Options& options);

}  // namespace dqw
#endif
