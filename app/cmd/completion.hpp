// Completions of the command line for bash, zsh and fish.
#ifndef DQW_APP_CMD_COMPLETION_HPP
#define DQW_APP_CMD_COMPLETION_HPP

#include <string>
#include <vector>

#include "app/cmd/pages.hpp"

namespace dqw {

/// Shells that completion_for knows.
const std::vector<std::string>& completed_shells();

/// A script for one of completed_shells().
std::string completion_for(const std::string& shell, const std::vector<Page>& pages);

}  // namespace dqw
#endif
