// `paper`: the paper's tables and figures beside its numbers.
#ifndef DQW_APP_CMD_PAPER_HPP
#define DQW_APP_CMD_PAPER_HPP

#include "app/cmd/command.hpp"

namespace dqw {

Command add_paper(CLI::App& app);

}  // namespace dqw
#endif
