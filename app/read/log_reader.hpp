// Reads LOG.csv, and LOG.toml beside it, into memory.
#ifndef DQW_APP_READ_LOG_READER_HPP
#define DQW_APP_READ_LOG_READER_HPP

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/base/input_error.hpp"
#include "app/format/unit.hpp"
#include "app/read/row_source.hpp"
#include "app/read/survey.hpp"
#include "ref/log/log.hpp"

namespace dqw {

struct ReadOptions {
    std::string machine_file;          ///< instead of LOG.toml; empty: LOG.toml if it is there
    std::optional<double> pole_pairs;  ///< wins over the machine file's
    std::string format = {};           ///< name of the format; empty: found from the file
    Given given = {};                  ///< gear, v_dc, period: win over the machine file's
    bool angle = false;                ///< beside these the angle, which tells the pole pairs
    bool plain_only = false;           ///< keep only the columns that a plain fit uses: 10 million rows in 0.5 GB
    std::string machine_text = {};     ///< a machine file's text, in place of the file
    RowSource* table = nullptr;        ///< the log itself, where `path` is only its name; read once
    Survey* survey = nullptr;          ///< what was made of it; then nothing that is missing refuses the log
    /// gets what was assumed, ignored or skipped; warnings begin "warning: "
    std::vector<std::string>* notes = nullptr;
    std::function<void(double)> progress = {};  ///< called with 0..1 now and then
};

/// Reads a log of any format of `formats()`, "-" for standard input, packed or not; throws InputError. Every row is
/// used, or counted in a note. Memory: 8 bytes a row for each column kept, and 1 MiB.
Log read_log(const std::string& path, const ReadOptions& options = {});

/// Name of the format that a file has by its first lines, without a machine file; throws InputError.
std::string format_of_file(const std::string& path);

}  // namespace dqw
#endif
