// Man pages of the command and its subcommands.
#ifndef DQW_APP_CMD_MANUAL_HPP
#define DQW_APP_CMD_MANUAL_HPP

#include <string>
#include <vector>

#include "app/cmd/pages.hpp"

namespace dqw {

/// One page in man(7)'s macros; the command's names all others.
std::string man_page(const Page& page, const std::vector<Page>& all);

/// Writes dqwatch.1 and dqwatch-SUBCOMMAND.1 into `dir`.
void write_manual(const std::vector<Page>& all, const std::string& dir);

}  // namespace dqw
#endif
