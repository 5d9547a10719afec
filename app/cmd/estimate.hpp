// `learn` and `fit`: one log or several to one set of parameters.
#ifndef DQW_APP_CMD_ESTIMATE_HPP
#define DQW_APP_CMD_ESTIMATE_HPP

#include "app/cmd/command.hpp"

namespace dqw {

Command add_learn(CLI::App& app);
Command add_fit(CLI::App& app);

}  // namespace dqw
#endif
