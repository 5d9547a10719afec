#include "app/read/row_parser.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "app/base/input_error.hpp"
#include "app/base/text.hpp"
#include "app/read/clock.hpp"
#include "app/read/csv.hpp"

namespace dqw {
namespace {

// No signal of a machine is larger in SI units, and sums of its squares stay numbers. A clock may be.
constexpr double kLargest = 1e18;
constexpr double no_number = std::numeric_limits<double>::quiet_NaN();

/// Channels so slow that their last value may stand for a missing one.
bool is_slow(std::size_t column)
{
    return column == col_v_dc || column == col_temp_winding || column == col_temp_magnet;
}

}  // namespace

RowParser::RowParser(const std::string& path, Import& import)
    : path_(path), import_(import), strict_(!import.gaps), slots_(import.head.fields.size())
{
    std::size_t most = 1;
    for (std::size_t c = 0; c < column_count; ++c) {
        if (!import.known(static_cast<Column>(c))) continue;
        const Expression& x = import.columns[c]->expression;
        most = std::max(most, x.fields.size());
        plans_.push_back({c, x.linear(), x.fields.empty() ? Head::none : x.fields[0], x.scale, x.offset});
        for (const std::size_t f : x.fields) {
            Slot& slot = slots_[f];
            if (slot.need == Need::unused) slot.column = c;
            // What makes a slow channel is slow wherever else it is used.
            if (is_slow(c)) slot.need = Need::held;
            if (slot.need != Need::held) slot.need = Need::every_row;
            slot.time = slot.time || c == col_t;
        }
    }
    for (const RowRule& rule : import.rules)
        for (const std::size_t f : rule.what.fields)
            if (slots_[f].need == Need::unused) slots_[f].need = Need::noticed;
    if (import.counter && slots_[*import.counter].need == Need::unused) slots_[*import.counter].need = Need::noticed;
    for (Slot& slot : slots_)
        if (slot.need == Need::held) slot.value = no_number;
    gathered_.resize(most);
}

void RowParser::refuse(const std::string& what) const { throw InputError(path_, line_number_, what); }

const RowValues* RowParser::parse(std::string_view line, std::size_t line_number)
{
    line_number_ = line_number;
    return parse_usual(line) || parse_any(line) ? ruled() : nullptr;
}

const RowValues* RowParser::parse(const double* fields, std::size_t line_number)
{
    line_number_ = line_number;
    return take_values(fields) ? ruled() : nullptr;
}

const RowValues* RowParser::ruled()
{
    for (RowRule& rule : import_.rules) {
        const double value = value_of(rule.what);
        if (!std::isfinite(value) || !rule.is_none(value)) continue;
        left_out_ = rule.why;
        return nullptr;
    }
    return evaluate() ? &values_ : nullptr;
}

double RowParser::value_of(const Expression& x)
{
    if (x.fields.size() > gathered_.size()) gathered_.resize(x.fields.size());
    for (std::size_t k = 0; k < x.fields.size(); ++k) gathered_[k] = slots_[x.fields[k]].value;
    return x(gathered_.data());
}

bool RowParser::evaluate()
{
    for (const Plan& plan : plans_) {
        double& value = values_[plan.column];
        if (plan.linear)
            value = plan.field == Head::none ? plan.offset : slots_[plan.field].value * plan.scale + plan.offset;
        else
            value = value_of(import_.columns[plan.column]->expression);
        const char* name = columns[plan.column].name;
        if (std::fabs(value) <= kLargest) continue;
        if (std::isnan(value)) {
            if (is_slow(plan.column)) continue;
            left_out_ = fmt::format("{} waits for the first value of a slow channel", name);
            return false;
        }
        if (plan.column == col_t && std::isfinite(value)) continue;
        if (!std::isfinite(value) && plan.linear)
            refuse(fmt::format("{} times its scale {:g} is not finite", name, plan.scale));
        refuse(fmt::format("{} is {:g}; expected no more than {:g}", name, value, kLargest));
    }
    return true;
}

/// One pass, numbers scanned where they stand. False for whatever is unusual: quotes, errors.
bool RowParser::parse_usual(std::string_view line)
{
    const char *at = line.data(), *const end = at + line.size();
    const std::size_t fields = slots_.size();
    const char separator = import_.head.separator;
    for (std::size_t f = 0; f < fields; ++f) {
        while (at < end && *at == ' ') ++at;
        if (at < end && *at == '"') return false;
        Slot& slot = slots_[f];
        if (slot.need == Need::unused) {
            while (at < end && *at != separator) ++at;
        } else {
            // A field that holds nothing keeps its last value, so it is parsed aside.
            double value = 0;
            if (!scan_number(at, end, value)) return false;
            slot.value = value;
        }
        if (f + 1 < fields && (at == end || *at++ != separator)) return false;
    }
    return at == end || (import_.head.trailing_separator && *at == separator && at + 1 == end);
}

bool RowParser::take_values(const double* fields)
{
    for (std::size_t f = 0; f < slots_.size(); ++f) {
        Slot& slot = slots_[f];
        if (slot.need == Need::unused) continue;
        if (std::isfinite(fields[f])) {
            slot.value = fields[f];
        } else if (slot.need == Need::noticed) {
            slot.value = no_number;
        } else if (slot.need == Need::held && std::isnan(fields[f])) {
            continue;
        } else if (strict_) {
            refuse(fmt::format("{} is {}; expected a finite number", columns[slot.column].name, fields[f]));
        } else if (slot.need != Need::held) {
            left_out_ = fmt::format("no value of {}", printable(import_.head.fields[f]));
            return false;
        }
    }
    return true;
}

bool RowParser::parse_any(std::string_view line)
{
    std::vector<std::string> fields = split(line, import_.head.separator);
    const std::size_t expected = slots_.size();
    const bool may_trail = import_.head.trailing_separator || !strict_;
    if (fields.size() == expected + 1 && may_trail && fields.back().empty()) fields.pop_back();
    if (fields.size() < expected && import_.short_rows) fields.resize(expected);
    if (fields.size() != expected)
        refuse(fmt::format("{}; expected {}, as in the header", counted(fields.size(), "field"), expected));
    for (std::size_t f = 0; f < expected; ++f)
        if (slots_[f].need != Need::unused && !parse_field(f, fields[f])) return false;
    return true;
}

bool RowParser::parse_field(std::size_t f, const std::string& text)
{
    Slot& slot = slots_[f];
    const bool percent = !text.empty() && text.back() == '%';
    const std::string field = percent ? text.substr(0, text.size() - 1) : text;
    double value = 0;
    const NumberError error = parse_number(field, value);
    if (error == NumberError::none || (slot.time && parse_clock(field, value))) {
        slot.value = value;
        return true;
    }
    if (slot.need == Need::noticed) {
        slot.value = no_number;
        return true;
    }
    // Words that writers put where there is no sample.
    const bool nan = error == NumberError::not_finite && (field.back() == 'n' || field.back() == 'N');
    const bool nothing = error == NumberError::empty || (nan && slot.need == Need::held) ||
                         (!strict_ && (error == NumberError::not_finite || field == "undefined" || field == "null" ||
                                       field == "None"));
    if (nothing && slot.need == Need::held) return true;
    const char* name = columns[slot.column].name;
    if (nothing && !strict_) {
        left_out_ = fmt::format("no value of {}", printable(import_.head.fields[f]));
        return false;
    }
    switch (error) {
    case NumberError::empty: refuse(fmt::format("{} is empty; expected a number", name));
    case NumberError::not_finite: refuse(fmt::format("{} is {}; expected a finite number", name, shown(field)));
    case NumberError::decimal_comma:
        refuse(fmt::format("{} is {}; expected a decimal point, not a comma", name, shown(field)));
    default: refuse(fmt::format("{} is {}; expected a number", name, shown(field)));
    }
}

}  // namespace dqw
