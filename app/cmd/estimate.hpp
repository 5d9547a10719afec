// `learn` and `fit`: one log or several to one set of parameters.
#ifndef DQW_APP_CMD_ESTIMATE_HPP
#define DQW_APP_CMD_ESTIMATE_HPP

#include "app/cmd/command.hpp"

namespace dqw {

int learn_command(const Options& options);
int fit_command(const Options& options);

}  // namespace dqw
#endif
