// Several logs of one machine.
#ifndef DQW_APP_CMD_LOGS_HPP
#define DQW_APP_CMD_LOGS_HPP

#include <string>
#include <vector>

#include "app/cmd/command.hpp"
#include "ref/log/log.hpp"

namespace dqw {

/// Reads logs of one machine and one regime, for a joint estimate: what one machine file says holds for all. Throws
/// InputError.
std::vector<Log> read_logs(const std::vector<std::string>& paths, const CommonOptions& options,
                           std::vector<std::string>& notes);

}  // namespace dqw
#endif
