// `learn` and `fit`: one log or several to one set of parameters.
#ifndef DQW_APP_CMD_ESTIMATE_HPP
#define DQW_APP_CMD_ESTIMATE_HPP

#include "app/cmd/command.hpp"
#include "app/learn/inputs.hpp"
#include "app/learn/learn.hpp"

namespace dqw {

int learn_command(const Options& options);
int fit_command(const Options& options);

/// What the command line and a trace say to the learners.
LearnOptions learn_options(const Options& options, const LearnConfig& config, bool fixed_point);

}  // namespace dqw
#endif
