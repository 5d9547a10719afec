// `dqwatch monitor` of slow logs: averages or settled points, look by look.
#ifndef DQW_APP_CMD_MONITOR_LOOKS_HPP
#define DQW_APP_CMD_MONITOR_LOOKS_HPP

#include <string>
#include <vector>

#include "app/cmd/command.hpp"
#include "ref/log/log.hpp"

namespace dqw {

/// The whole subcommand for such a log; `notes` are those of reading it. Throws InputError.
int monitor_looks_command(const Log& log, const Options& options, std::vector<std::string> notes);

}  // namespace dqw
#endif
