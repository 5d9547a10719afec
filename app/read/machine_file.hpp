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

/// How a column is called in the CSV, and how it becomes SI: (name · scale + offset) · times, in its unit.
struct ColumnSource {
    std::string name, unit;
    std::string times;  ///< name of a column that it is multiplied by
    double scale = 1.0, offset = 0.0;
    std::optional<double> value;  ///< instead of a name: a constant in SI
    std::size_t line = 0;         ///< in the machine file; 0: it says nothing, the column has its own name
};

/// d and q out of phases, line-to-line voltages, or α and β, with theta_e.
struct FrameSource {
    std::vector<std::string> names;
    std::string kind = "phase", unit;
    double scale = 1.0;
    std::size_t line = 0;
};

struct MachineFile {
    std::string path;  ///< empty: there is none
    Machine machine;
    std::optional<Regime> regime;
    bool voltage_previous = false;
    std::string modulation;        ///< empty: nothing is said
    bool observed = false;         ///< the angle is an observer's
    double voltage_error_V = 0.0;  ///< by how much the voltage may be off, unseen
    /// Deviation of the scale that the voltage is given in, as a part. Where nobody says it, a link is measured in
    /// steps of 12 bits, of whose range it fills half: one of them, over the root of 12.
    double voltage_scale = 1.41e-4;
    std::optional<double> gear, v_dc_V, period_s;
    std::array<ColumnSource, column_count> sources;
    FrameSource i_dq, v_dq;
    std::vector<std::string> public_sources;  ///< text of the comment lines that begin "# Source:"
    std::vector<std::string> notes;           ///< unknown keys, one line
};

/// Reads a machine file; throws InputError, with its path and line, on bad syntax, a wrong type or an unphysical value.
MachineFile read_machine_file(const std::string& path);

/// The same of a text; `name` stands for its path.
MachineFile read_machine_text(const std::string& name, const std::string& text);

/// The machine file of `log_path`: `chosen` where that is not empty (then it must exist), else LOG.toml if there is
/// one.
MachineFile machine_file_of(const std::string& log_path, const std::string& chosen);

}  // namespace dqw
#endif
