// What the subcommands share: exit codes.
#ifndef DQW_APP_CMD_COMMAND_HPP
#define DQW_APP_CMD_COMMAND_HPP

#include "app/job/options.hpp"

namespace dqw {

/// Exit codes, as documented.
enum ExitCode { exit_done = 0, exit_other = 1, exit_usage = 2, exit_input = 3, exit_not_identifiable = 4 };

}  // namespace dqw
#endif
