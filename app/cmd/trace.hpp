// `trace`: which physical effect a log's model lacks.
#ifndef DQW_APP_CMD_TRACE_HPP
#define DQW_APP_CMD_TRACE_HPP

#include "app/cmd/command.hpp"

namespace dqw {

int trace_command(const Options& options);

}  // namespace dqw
#endif
