// What the command's own parser knows of itself, for its man pages and for the completions of shells.
#ifndef DQW_APP_CMD_PAGES_HPP
#define DQW_APP_CMD_PAGES_HPP

#include <map>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace dqw {

/// An option or a positional. A flag takes no value.
struct Word {
    enum class Takes { nothing, text, choice, file, folder };
    std::string name;  ///< "--out", "LOG.csv"
    std::string about;
    std::string value;  ///< "DIR": what stands for its value
    std::vector<std::string> choices;
    Takes takes = Takes::nothing;
    bool repeats = false, required = false;
};

/// The command, or one of its subcommands.
struct Page {
    std::string name;  ///< "" is the command itself
    std::string about, footer;
    std::vector<Word> options, positionals;
};

/// The command's page first. `known`: choices that the parser does not check, by the word's name.
std::vector<Page> pages_of(const CLI::App& app, const std::map<std::string, std::vector<std::string>>& known);

/// `about` up to the first pause, for one line in a terminal.
std::string brief(const std::string& about);

}  // namespace dqw
#endif
