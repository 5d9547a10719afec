// What the subcommands share: exit codes, and what the command line says. Knows nothing of how that is parsed.
#ifndef DQW_APP_CMD_COMMAND_HPP
#define DQW_APP_CMD_COMMAND_HPP

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace dqw {

/// Exit codes, as documented.
enum ExitCode { exit_done = 0, exit_other = 1, exit_usage = 2, exit_input = 3, exit_not_identifiable = 4 };

/// Wrong usage that the command line parser cannot see: exit code 2, one line.
struct UsageError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// A value that its key does not take, or a scenario that contradicts itself: exit code 3, one line that names the key.
struct ValueError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// What the command line says. Each subcommand has some of it; the rest is as it stands here.
struct Options {
    bool json = false;
    std::string out_dir = ".";
    bool out_given = false;
    std::optional<int> pole_pairs;
    std::string machine_file;
    std::string format;  ///< of the logs; empty: found
    std::optional<double> gear, v_dc_V, period_s;
    bool write = false;
    std::vector<std::string> logs, parameters;
    std::vector<std::string> effects;  ///< named with --effect
    std::string config_file;           ///< trace.json
    std::string arith = "float";
    std::vector<std::string> maps;  ///< two flux maps
    // Of `sim`.
    std::string scenario;
    std::vector<std::string> settings;
    std::optional<std::uint64_t> seed;
    std::optional<std::string> polled, modulation;
    bool list = false, list_keys = false;

    bool fixed_point() const { return arith == "q15"; }
};

}  // namespace dqw
#endif
