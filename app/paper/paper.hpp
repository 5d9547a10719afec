// `dqwatch paper`: the paper's tables and figures, ours beside its own.
#ifndef DQW_APP_PAPER_PAPER_HPP
#define DQW_APP_PAPER_PAPER_HPP

#include <string>

namespace dqw {

/// Prints the tables (or one JSON object) and writes fig6.svg .. fig9.svg into out_dir.
/// Returns an exit code; throws std::runtime_error (one line) where a file cannot be written.
int run_paper(const std::string& out_dir, bool json);

}  // namespace dqw
#endif
