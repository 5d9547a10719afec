// What the subcommands share: exit codes, options.
#ifndef DQW_APP_CMD_COMMAND_HPP
#define DQW_APP_CMD_COMMAND_HPP

#include <CLI/CLI.hpp>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/read/log_reader.hpp"
#include "ref/log/log.hpp"

namespace dqw {

/// Exit codes, as documented.
enum ExitCode { exit_done = 0, exit_other = 1, exit_usage = 2, exit_input = 3, exit_not_identifiable = 4 };

/// Wrong usage that the command line parser cannot see: exit code 2, one line.
struct UsageError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// The options that every subcommand takes.
struct CommonOptions {
    bool json = false;
    std::string out_dir = ".";
    bool out_given = false;
    std::optional<int> pole_pairs;
    std::string machine_file;
    std::vector<std::string> parameters;
    bool all_columns = false;  ///< keep every column of the logs, not only those of a plain fit
};

/// Which effects are estimated beside the parameters.
struct EffectOptions {
    std::vector<std::string> names;
    std::string config_file;
};

/// A subcommand: what the parser fills in, and what runs then. Returns an exit code.
struct Command {
    CLI::App* app;
    std::function<int()> run;
};

/// Adds --json --out --pole-pairs --machine to a subcommand.
void add_common(CLI::App& command, CommonOptions& options);
/// Adds --parameters, names checked.
void add_parameters(CLI::App& command, CommonOptions& options);
/// Adds --effect --config.
void add_effects(CLI::App& command, EffectOptions& options);

}  // namespace dqw
#endif
