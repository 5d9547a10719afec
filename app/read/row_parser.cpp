#include "app/read/row_parser.hpp"

#include <fmt/format.h>

#include <cmath>

#include "app/base/input_error.hpp"
#include "app/base/text.hpp"
#include "app/read/csv.hpp"

namespace dqw {
namespace {

// No signal of a machine is larger in SI units, and sums of its squares stay numbers. A clock may be.
constexpr double kLargest = 1e18;

}  // namespace

RowParser::RowParser(const std::string& path, const Header& header)
    : path_(path), header_(header), column_of_(header.fields.size(), Header::none)
{
    for (std::size_t c = 0; c < column_count; ++c) {
        if (header.field_of[c] == Header::none) continue;
        std::size_t& taken = column_of_[header.field_of[c]];
        if (taken == Header::none)
            taken = c;
        else
            copies_.emplace_back(c, taken);
        if (header.scale[c] != 1.0) scaled_.push_back(c);
        if (columns[c].name != std::string_view("t_s")) signals_.push_back(c);
    }
}

void RowParser::refuse(const std::string& what) const { throw InputError(path_, line_number_, what); }

const RowValues& RowParser::parse(std::string_view line, std::size_t line_number)
{
    line_number_ = line_number;
    if (!parse_usual(line)) parse_any(line);
    for (const auto& [to, from] : copies_) values_[to] = values_[from];
    scale();
    for (const std::size_t c : signals_)
        if (std::fabs(values_[c]) > kLargest)
            refuse(fmt::format("{} is {:g}; expected no more than {:g}", columns[c].name, values_[c], kLargest));
    return values_;
}

/// One pass, numbers scanned where they stand. False for whatever is unusual: quotes, errors.
bool RowParser::parse_usual(std::string_view line)
{
    const char *at = line.data(), *const end = at + line.size();
    const std::size_t fields = column_of_.size();
    for (std::size_t f = 0; f < fields; ++f) {
        while (at < end && *at == ' ') ++at;
        if (at < end && *at == '"') return false;
        const std::size_t c = column_of_[f];
        if (c == Header::none) {
            while (at < end && *at != header_.separator) ++at;
        } else if (!scan_number(at, end, values_[c])) {
            return false;
        }
        if (f + 1 < fields && (at == end || *at++ != header_.separator)) return false;
    }
    return at == end || (header_.trailing_separator && *at == header_.separator && at + 1 == end);
}

void RowParser::parse_any(std::string_view line)
{
    std::vector<std::string> fields = split(line, header_.separator);
    const std::size_t expected = header_.fields.size();
    if (fields.size() == expected + 1 && header_.trailing_separator && fields.back().empty()) fields.pop_back();
    if (fields.size() != expected)
        refuse(fmt::format("{}; expected {}, as in the header", counted(fields.size(), "field"), expected));
    for (std::size_t f = 0; f < expected; ++f)
        if (column_of_[f] != Header::none) parse_field(column_of_[f], fields[f]);
}

void RowParser::parse_field(std::size_t c, const std::string& field)
{
    const char* name = columns[c].name;
    switch (parse_number(field, values_[c])) {
    case NumberError::none: return;
    case NumberError::empty: refuse(fmt::format("{} is empty; expected a number", name));
    case NumberError::not_finite: refuse(fmt::format("{} is {}; expected a finite number", name, shown(field)));
    case NumberError::decimal_comma:
        refuse(fmt::format("{} is {}; expected a decimal point, not a comma", name, shown(field)));
    case NumberError::text: refuse(fmt::format("{} is {}; expected a number", name, shown(field)));
    }
}

void RowParser::scale()
{
    for (const std::size_t c : scaled_) {
        values_[c] *= header_.scale[c];
        if (!std::isfinite(values_[c]))
            refuse(fmt::format("{} times its scale {:g} is not finite", columns[c].name, header_.scale[c]));
    }
}

}  // namespace dqw
