// LOG.toml beside LOG.csv: what is known of the machine and of the log.
#ifndef DQW_APP_READ_MACHINE_FILE_HPP
#define DQW_APP_READ_MACHINE_FILE_HPP

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "app/base/columns.hpp"
#include "ref/log/log.hpp"

namespace dqw {

/// How a column is called in the CSV, and the factor to SI.
struct ColumnSource {
    std::string name;
    double scale = 1.0;
    std::size_t line = 0;  ///< in the machine file; 0: it says nothing, the column has its own name
};

struct MachineFile {
    std::string path;  ///< empty: there is none
    Machine machine;
    std::optional<Regime> regime;
    bool polled = false;  ///< then the regime is steady, until polled logs have an estimator of their own
    bool voltage_previous = false;
    std::string modulation;        ///< empty: nothing is said
    bool observed = false;         ///< the angle is an observer's
    double voltage_error_V = 0.0;  ///< by how much the voltage may be off, unseen
    std::array<ColumnSource, column_count> sources;
    std::vector<std::string> public_sources;  ///< text of the comment lines that begin "# Source:"
    std::vector<std::string> notes;           ///< unknown keys, one line
};

/// Reads a machine file; throws InputError, with its path and line, on bad syntax, a wrong type or an unphysical value.
MachineFile read_machine_file(const std::string& path);

/// The machine file of `log_path`: `chosen` where that is not empty (then it must exist), else LOG.toml if there is
/// one.
MachineFile machine_file_of(const std::string& log_path, const std::string& chosen);

}  // namespace dqw
#endif
