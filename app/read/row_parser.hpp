// One row of a log: text to numbers, one for each column that the file has.
#ifndef DQW_APP_READ_ROW_PARSER_HPP
#define DQW_APP_READ_ROW_PARSER_HPP

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "app/base/columns.hpp"
#include "app/read/header.hpp"

namespace dqw {

using RowValues = std::array<double, column_count>;

/// Parses rows by a header. Time is linear in the row; no memory is taken by a usual row.
class RowParser {
public:
    RowParser(const std::string& path, const Header& header);

    /// The row's numbers in SI units, finite and of a sane size where the file has the column; throws InputError at
    /// `line_number`.
    const RowValues& parse(std::string_view line, std::size_t line_number);

private:
    bool parse_usual(std::string_view line);
    void parse_any(std::string_view line);
    void parse_field(std::size_t c, const std::string& field);
    void scale();
    [[noreturn]] void refuse(const std::string& what) const;

    const std::string& path_;
    const Header& header_;
    std::vector<std::size_t> column_of_;                       // each field's column, or Header::none
    std::vector<std::pair<std::size_t, std::size_t>> copies_;  // columns whose field serves another as well: to, from
    std::vector<std::size_t> scaled_, signals_;
    RowValues values_ = {};
    std::size_t line_number_ = 0;
};

}  // namespace dqw
#endif
