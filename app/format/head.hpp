// The first lines of a file: what comes before the rows, and some rows to look at.
#ifndef DQW_APP_FORMAT_HEAD_HPP
#define DQW_APP_FORMAT_HEAD_HPP

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace dqw {

struct Head {
    static constexpr std::size_t none = static_cast<std::size_t>(-1);

    std::string path;
    std::size_t line = 1;               ///< of the header
    std::vector<std::string> comments;  ///< lines before the header, without `#`
    char separator = ',';
    std::vector<std::string> fields;  ///< names as written; of a headerless file "1", "2", …
    bool headerless = false;
    bool trailing_separator = false;             ///< the header ends with a separator; so may the rows
    std::vector<std::vector<std::string>> rows;  ///< the first rows' fields
    std::vector<std::string> units;              ///< of a line of units below the header

    /// The field of this name, whatever its case; `none` where there is none.
    std::size_t find(std::string_view name) const;
    /// The first field whose name ends so, behind a `/`, a `.` or at its beginning.
    std::size_t find_ending(std::string_view name) const;
    bool has(std::string_view name) const { return find(name) != none; }
};

/// Letters of ASCII alone.
bool equal_ignoring_case(std::string_view a, std::string_view b);

}  // namespace dqw
#endif
