// One row of a log: text to numbers, one for each column that is made of the file.
#ifndef DQW_APP_READ_ROW_PARSER_HPP
#define DQW_APP_READ_ROW_PARSER_HPP

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "app/base/columns.hpp"
#include "app/format/format.hpp"

namespace dqw {

using RowValues = std::array<double, column_count>;

/// Parses rows by an import. Time is linear in the row; no memory is taken by a usual row.
class RowParser {
public:
    RowParser(const std::string& path, Import& import);

    /// The row's numbers in SI units, finite and of a sane size where there is a column; a column that may be held is
    /// NaN before its first number. Null where the row is left out, and left_out() says why. Throws InputError at
    /// `line_number`.
    const RowValues* parse(std::string_view line, std::size_t line_number);
    /// The same of a row that is numbers already, one a field; NaN holds nothing.
    const RowValues* parse(const double* fields, std::size_t line_number);
    /// True where a column is made of the field.
    bool uses(std::size_t field) const { return slots_[field].need >= Need::held; }
    const std::string& left_out() const { return left_out_; }
    /// Of the row parsed last; NaN where it holds nothing.
    double counter() const { return import_.counter ? slots_[*import_.counter].value : 0.0; }

private:
    const RowValues* ruled();

    /// What becomes of a field that holds no number.
    enum class Need { unused, noticed, held, every_row };
    struct Slot {
        Need need = Need::unused;
        std::size_t column = 0;  ///< the first that is made of it
        bool time = false;
        double value = 0.0;
    };
    struct Plan {
        std::size_t column;
        bool linear;
        std::size_t field;
        double scale, offset;
    };

    bool parse_usual(std::string_view line);
    bool take_values(const double* fields);
    bool parse_any(std::string_view line);
    bool parse_field(std::size_t f, const std::string& field);
    bool evaluate();
    double value_of(const Expression& x);
    [[noreturn]] void refuse(const std::string& what) const;

    const std::string& path_;
    Import& import_;
    bool strict_;  // dqwatch's own format: what is no number is an error
    std::vector<Slot> slots_;
    std::vector<Plan> plans_;
    std::vector<double> gathered_;
    RowValues values_ = {};
    std::size_t line_number_ = 0;
    std::string left_out_;
};

}  // namespace dqw
#endif
