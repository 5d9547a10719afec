// `trace`: which physical effect a log's model lacks.
#ifndef DQW_APP_CMD_TRACE_HPP
#define DQW_APP_CMD_TRACE_HPP

#include "app/cmd/command.hpp"

namespace dqw {

Command add_trace(CLI::App& app);

}  // namespace dqw
#endif
