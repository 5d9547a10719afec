// What was made of a log, column by column, for people and for `dqwatch columns`.
#ifndef DQW_APP_READ_SURVEY_HPP
#define DQW_APP_READ_SURVEY_HPP

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "app/format/format.hpp"
#include "app/format/proposal.hpp"

namespace dqw {

/// Rows that are none, by the reason.
struct LeftOut {
    std::string why;
    std::size_t rows = 0, first_line = 0;
};

struct Survey {
    struct Column {
        std::string name;
        std::string rule;                ///< how it is made of the file's fields
        std::vector<std::string> from;   ///< those fields
        std::string unit;                ///< in the file; empty: several, or none
        std::optional<double> factor;    ///< to SI; absent where it is more than a factor
        std::vector<std::string> needs;  ///< what is not known for it; then it is not there
        bool kept = false;
        double first = 0, least = 0, largest = 0;
    };

    std::string format, about, voltage;
    std::size_t rows_in_file = 0, rows_kept = 0;
    std::vector<Column> columns;
    std::vector<LeftOut> left_out;
    std::vector<std::string> unused;
    std::vector<std::string> notes;
    std::string regime;                    ///< empty: none
    std::string regime_why;                ///< or why there is none
    std::vector<std::string> missing;      ///< by name, with the option that says it
    std::vector<ProposedColumn> proposed;  ///< what other fields may be, where columns are missing
};

/// What each column is made of, and the values that `log` has of those in `has`.
std::vector<Survey::Column> surveyed_columns(const Import& import, const Log& log, const ColumnSet& has);

/// `pole pairs` as a sentence that says how to give it.
std::string how_to_give(const std::string& need);

/// Adds a row to the reason's count.
void count_left_out(std::vector<LeftOut>& all, const std::string& why, std::size_t line);

}  // namespace dqw
#endif
