// `sim`: simulates a drive.
#ifndef DQW_APP_CMD_SIM_HPP
#define DQW_APP_CMD_SIM_HPP

#include "app/cmd/command.hpp"

namespace dqw {

int sim_command(const Options& options);

}  // namespace dqw
#endif
