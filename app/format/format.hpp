// What a file's format says: which fields make which column, which rows are none, what the voltage is.
#ifndef DQW_APP_FORMAT_FORMAT_HPP
#define DQW_APP_FORMAT_FORMAT_HPP

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/base/columns.hpp"
#include "app/format/expression.hpp"
#include "app/format/head.hpp"
#include "app/format/unit.hpp"

namespace dqw {

/// A column: how it is made, and what is not known for that.
struct Source {
    Expression expression;
    std::string unit;                ///< in the file
    std::vector<std::string> needs;  ///< pole pairs, gear, v_dc; then there is no column
};

/// Rows that are no measurement.
struct RowRule {
    Expression what;
    bool (*is_none)(double value);
    std::string why;
    std::size_t dropped = 0;
};

/// How a file's rows become columns; filled by a Format.
struct Import {
    Import(Head& head_, const Given& given_) : head(head_), given(given_) {}

    Head& head;  ///< a format may name fields that the header leaves out
    const Given& given;
    std::array<std::optional<Source>, column_count> columns;
    std::vector<RowRule> rules;
    std::string voltage;                     ///< what v_d, v_q are, for people
    std::vector<std::string> notes;          ///< what a reader should know
    std::string no_log;                      ///< why it is read as none, where it is not
    std::optional<Regime> regime;            ///< what the rows are good for, where the machine file says nothing
    bool voltage_is_size = false;            ///< v_q is that of the voltage's vector, by a duty
    bool polled = false;                     ///< i and v are means over the interval before the row
    bool host_clock = false;                 ///< stamps jitter; they are no control period
    bool gaps = true;                        ///< empty cells: slow columns are held, other rows left out
    bool short_rows = false;                 ///< rows may end before fields that are not used
    bool settled_only = false;               ///< v and i are not of one instant: rows in motion are dropped (E136)
    bool speed_from_angle = false;           ///< w_m is the slope of theta_e
    bool voltage_previous = false;           ///< row k's voltage acted before t_k
    bool even = false;                       ///< the user says how far apart rows are, whatever stamps say
    std::optional<double> row_period_s;      ///< there is no time, or none to trust: rows are this far apart
    std::optional<std::size_t> counter;      ///< a field that counts rows to 256: a jump is rows that were lost
    std::vector<std::string> missing_given;  ///< what --period and the like must say

    /// Makes a column of a field in this unit. False if there is no such field.
    bool take(Column column, std::string_view field, std::string_view unit);
    bool take(Column column, std::size_t field, std::string_view unit);
    /// Makes a column of an expression in this unit.
    void take(Column column, const Expression& x, std::string_view unit);
    /// A column in SI as it stands.
    void take_si(Column column, const Expression& x);

    /// Throws InputError where there is none of this name.
    Expression field(std::string_view name) const;
    Expression field(std::size_t f) const { return field_expression(f, head.fields[f]); }
    /// The DC link: a column, or what is given.
    std::optional<Expression> v_dc() const;
    /// d, q from two or three phase currents or voltages; theta_e must have been taken.
    void take_park(Column d, Column q, const TwoAxes& stationary);
    /// The voltage that a duty of -1..1 makes, where there is a link's voltage.
    void take_duty(const Expression& duty);
    void drop(std::string_view field, bool (*is_none)(double), const std::string& why);
    /// Fields that only rows have, before field `at`.
    void insert_fields(std::size_t at, std::size_t count, const std::string& name);
    bool known(Column column) const { return columns[column] && columns[column]->needs.empty(); }
    ColumnSet has() const;
};

bool is_zero(double value);
bool is_not_zero(double value);

/// A JSON file as CSV, and the line of the file that each of its lines comes from.
struct CsvText {
    std::string text;
    std::vector<std::size_t> lines;
    void add(const std::string& row, std::size_t line)
    {
        text += row + "\n";
        lines.push_back(line);
    }
};

/// A format of log files: one file of this folder, and a line of formats.cpp.
struct Format {
    const char* name;
    const char* about;
    std::vector<const char*> marks;        ///< fields that all such files have
    bool (*recognises)(const Head& head);  ///< null: by `marks` alone
    void (*describe)(Import& in);
    /// False where the file is another's; throws InputError where it is this one's and broken.
    bool (*to_csv)(const std::string& path, const std::string& text, CsvText& csv) = nullptr;  ///< of a JSON file
};

}  // namespace dqw
#endif
