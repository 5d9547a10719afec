// The header line of a log: which field holds which column.
#ifndef DQW_APP_READ_HEADER_HPP
#define DQW_APP_READ_HEADER_HPP

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/base/columns.hpp"
#include "app/read/machine_file.hpp"

namespace dqw {

struct Header {
    static constexpr std::size_t none = static_cast<std::size_t>(-1);
    static constexpr std::size_t most_fields = 4096;

    char separator = ',';
    std::vector<std::string> fields;                 ///< as written, without a nameless last one
    bool trailing_separator = false;                 ///< the header ends with a separator; so may the rows
    std::array<std::size_t, column_count> field_of;  ///< the field that holds a column, or none
    std::array<double, column_count> scale;
    std::vector<std::string> unused;  ///< names of fields that hold no column

    ColumnSet has() const
    {
        ColumnSet set = {};
        for (std::size_t c = 0; c < column_count; ++c) set[c] = field_of[c] != none;
        return set;
    }
};

/// Parses line 1 of `path`. Refuses binary data, other encodings, too many fields, and two fields for one column.
Header parse_header(const std::string& path, std::string_view line, const MachineFile& machine);

/// Throws the InputError that says which columns are missing for `regime` and which are there.
/// Without a regime: for dynamic, which names all.
void require_columns(const std::string& path, const Header& header, std::optional<Regime> regime,
                     const MachineFile& machine);

}  // namespace dqw
#endif
