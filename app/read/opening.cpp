#include "app/read/opening.hpp"

#include <fmt/format.h>

#include <cmath>

#include "app/base/input_error.hpp"
#include "app/base/text.hpp"
#include "app/read/clock.hpp"
#include "app/read/csv.hpp"

namespace dqw {
namespace {

constexpr std::size_t most_json_bytes = std::size_t{256} << 20;
constexpr std::size_t most_preamble_lines = 200;
constexpr std::size_t rows_looked_at = 24;

bool starts(std::string_view line, std::string_view mark) { return line.substr(0, mark.size()) == mark; }

void refuse_foreign_encodings(const std::string& path, std::size_t number, std::string& line)
{
    if (number == 1 && (starts(line, "\xff\xfe") || starts(line, "\xfe\xff")))
        throw InputError(path, 1, "UTF-16 text; expected UTF-8 or ASCII");
    if (number == 1 && starts(line, "\xef\xbb\xbf")) line.erase(0, 3);
    if (line.find('\0') != line.npos) throw InputError(path, number, "binary data (a NUL byte); expected a CSV header");
    if (line.find('\r') != line.npos) throw InputError(path, number, "lines end with CR alone; expected LF or CRLF");
}

bool is_number(const std::string& field)
{
    double value = 0;
    return parse_number(field, value) == NumberError::none;
}

std::string without_brackets(const std::string& unit)
{
    const std::string text(trimmed(unit));
    if (text.size() > 2 && (text.front() == '[' || text.front() == '(') && (text.back() == ']' || text.back() == ')'))
        return text.substr(1, text.size() - 2);
    return text;
}

bool looks_like_a_unit(const std::string& field)
{
    const std::string unit = without_brackets(field);
    if (unit != trimmed(field)) return true;
    for (const ColumnInfo& column : columns)
        if (is_unit(column.id, unit)) return true;
    return unit == "Volt" || unit == "Sequence";
}

/// Numbers nowhere (oscilloscopes have some in the last two places), a unit somewhere.
bool is_line_of_units(const Head& head, const std::vector<std::string>& fields)
{
    if (fields.size() != head.fields.size() && fields.size() != head.fields.size() + head.trailing_separator)
        return false;
    if (head.has("Increment") && head.has("Start")) return !is_number(fields[0]);
    bool unit = false;
    for (const std::string& field : fields) {
        double t_s = 0;
        if (is_number(field) || parse_clock(field, t_s)) return false;
        unit = unit || looks_like_a_unit(field);
    }
    return unit;
}

}  // namespace

Opening::Opening(const std::string& path) : source_(std::make_unique<LineSource>(path))
{
    head.path = path;
    std::string line;
    if (!read(line)) throw InputError(path, 1, "an empty file; expected a CSV log with a header line");
    refuse_foreign_encodings(path, line_, line);
    if (trimmed(line).empty()) {
        // Only JSON begins so: MESC's terminal does.
        std::string second;
        const bool more = read(second);
        if (!more || !starts(trimmed(second), "{"))
            throw InputError(
                path, 1, "an empty first line; expected a CSV header such as t_s,v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s");
        line = second;
    }
    if (starts(trimmed(line), "{")) {
        convert(path, line, line_);
        if (!read(line)) throw InputError(path, 1, "no rows");
    }
    if (starts(line, "1651 "))
        throw InputError(path, 1,
                         "a .dat file of TI's Code Composer, one buffer without names; expected CSV with all channels");
    const bool scope = starts(line, "Model,");
    // What comes before the header: comments, an oscilloscope's settings, what a motor says of its start.
    while (starts(line, "#") || starts(line, "MOT:") || (scope && !starts(line, "TIME,"))) {
        if (head.comments.size() >= most_preamble_lines)
            throw InputError(path, line_, fmt::format("no header within {} lines", most_preamble_lines));
        head.comments.push_back(as_utf8(line.substr(starts(line, "#") ? 1 : 0)));
        if (!read(line)) throw InputError(path, line_, "comments and nothing else; expected a header and rows");
        refuse_foreign_encodings(path, line_, line);
    }
    read_header(path, line);
    look_at_rows();
}

Opening::Opening(const std::string& name, RowSource& rows) : table_(&rows)
{
    head.path = name;
    head.fields = rows.fields();
    line_ = 1;
    if (head.fields.empty()) throw InputError(name, 1, "no columns; expected columns such as t_s, v_d_V, i_d_A");
    if (head.fields.size() > most_fields)
        throw InputError(name, 1, fmt::format("{} columns; expected at most {}", head.fields.size(), most_fields));
    while (seen_rows_.size() < rows_looked_at) {
        const double* values = rows.next();
        if (!values) break;
        seen_rows_.emplace_back(values, values + head.fields.size());
        std::vector<std::string> texts;
        for (const double value : seen_rows_.back()) texts.push_back(std::isnan(value) ? "" : fmt::format("{}", value));
        head.rows.push_back(std::move(texts));
    }
}

const double* Opening::next()
{
    ++line_;
    if (seen_rows_.empty()) return table_->next();
    row_ = std::move(seen_rows_.front());
    seen_rows_.pop_front();
    return row_.data();
}

bool Opening::read(std::string& line)
{
    std::string_view view;
    if (!source_->next(view)) return false;
    line = view;
    line_ = source_->line_number();
    return true;
}

void Opening::convert(const std::string& path, const std::string& first, std::size_t number)
{
    // Line numbers are those of the file: what came before is empty lines.
    const std::string text = std::string(number - 1, '\n') + first + "\n" + source_->rest(most_json_bytes);
    for (const Format* format : formats()) {
        CsvText csv;
        if (!format->to_csv || !format->to_csv(path, text, csv)) continue;
        json = format;
        source_ = std::make_unique<LineSource>(path, std::move(csv.text), std::move(csv.lines));
        return;
    }
    throw InputError(path, number,
                     "JSON of no format known; expected MESC's log -fl or status json, moteus tview's JSONL, or "
                     "Floaty's");
}

void Opening::read_header(const std::string& path, std::string line)
{
    if (trimmed(line).empty()) throw InputError(path, line_, "an empty line; expected a CSV header");
    head.line = line_;
    head.separator = separator_of(line);
    head.fields = split(as_utf8(line), head.separator);
    if (head.fields.size() > 1 && head.fields.back().empty()) {
        head.trailing_separator = true;
        head.fields.pop_back();
    }
    if (head.fields.size() > most_fields)
        throw InputError(path, line_, fmt::format("{} columns; expected at most {}", head.fields.size(), most_fields));
    head.headerless = true;
    for (const std::string& field : head.fields) head.headerless = head.headerless && is_number(field);
    if (!head.headerless) return;
    for (std::size_t f = 0; f < head.fields.size(); ++f) head.fields[f] = std::to_string(f + 1);
    seen_.emplace_back(std::move(line), line_);
    head.rows.push_back(split(seen_.back().first, head.separator));
}

void Opening::look_at_rows()
{
    std::string line;
    while (seen_.size() < rows_looked_at && read(line)) {
        if (trimmed(line).empty()) {
            seen_.emplace_back(line, line_);
            continue;
        }
        std::vector<std::string> fields = split(as_utf8(line), head.separator);
        if (head.rows.empty() && head.units.empty() && is_line_of_units(head, fields)) {
            for (const std::string& field : fields) head.units.push_back(without_brackets(field));
            continue;
        }
        head.rows.push_back(std::move(fields));
        seen_.emplace_back(line, line_);
    }
}

bool Opening::next(std::string_view& line)
{
    if (!seen_.empty()) {
        line_text_ = std::move(seen_.front().first);
        line_ = seen_.front().second;
        seen_.pop_front();
        line = line_text_;
        return true;
    }
    if (!source_->next(line)) return false;
    line_ = source_->line_number();
    return true;
}

bool Opening::was_last()
{
    std::string_view line;
    while (next(line))
        if (!trimmed(line).empty()) return false;
    return true;
}

}  // namespace dqw
