// `dqwatch columns LOG`: what is read of a log, and what is missing. `dqwatch formats`: what can be read.
#ifndef DQW_APP_CMD_COLUMNS_HPP
#define DQW_APP_CMD_COLUMNS_HPP

#include "app/cmd/command.hpp"

namespace dqw {

int columns_command(const Options& options);
int formats_command(const Options& options);

}  // namespace dqw
#endif
