// What is asked of a job, and how it refuses. Knows nothing of how that was said.
#ifndef DQW_APP_JOB_OPTIONS_HPP
#define DQW_APP_JOB_OPTIONS_HPP

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "app/base/progress.hpp"
#include "app/read/row_source.hpp"

namespace dqw {

/// Wrong usage that the command line parser cannot see: exit code 2, one line.
struct UsageError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// A value that its key does not take, or a scenario that contradicts itself: exit code 3, one line that names the key.
struct ValueError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// What is asked for, on a command line or in a call. Each job reads some of it; the rest is as it stands here.
struct Options {
    bool json = false;
    std::string out_dir = ".";
    bool out_given = false;
    std::optional<int> pole_pairs;
    std::string machine_file;
    std::string format;  ///< of the logs; empty: found
    std::optional<double> gear, v_dc_V, period_s;
    bool write = false;
    std::string store_file;  ///< what is healthy, across restarts
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

    /// Logs that are not files, by the names that `logs` has for them; each can be read once.
    std::map<std::string, std::shared_ptr<RowSource>> tables;
    std::string machine_text;  ///< a machine file's text instead of a file
    std::string config_text;   ///< a trace's JSON instead of a file
    JobProgress progress;      ///< instead of a bar on the terminal

    bool fixed_point() const { return arith == "q15"; }
};

}  // namespace dqw
#endif
