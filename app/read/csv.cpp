#include "app/read/csv.hpp"

#include <fast_float/fast_float.h>

#include <cmath>

#include "app/base/text.hpp"

namespace dqw {

char separator_of(std::string_view header)
{
    std::size_t commas = 0, semicolons = 0, tabs = 0;
    bool inside = false;
    for (const char c : header) {
        if (c == '"') inside = !inside;
        if (inside) continue;
        commas += c == ',';
        semicolons += c == ';';
        tabs += c == '\t';
    }
    if (semicolons > commas && semicolons >= tabs) return ';';
    return tabs > commas ? '\t' : ',';
}

std::vector<std::string> split(std::string_view line, char separator)
{
    std::vector<std::string> fields;
    std::size_t at = 0;
    for (;;) {
        while (at < line.size() && line[at] != separator && (line[at] == ' ' || line[at] == '\t')) ++at;
        std::string field;
        if (at < line.size() && line[at] == '"') {
            for (++at; at < line.size(); ++at) {
                if (line[at] == '"' && at + 1 < line.size() && line[at + 1] == '"')
                    field += line[++at];
                else if (line[at] == '"')
                    break;
                else
                    field += line[at];
            }
            if (at < line.size()) ++at;
        }
        const auto end = std::min(line.find(separator, at), line.size());
        field += trimmed(line.substr(at, end - at));
        fields.push_back(std::move(field));
        if (end == line.size()) return fields;
        at = end + 1;
    }
}

bool scan_number(const char*& first, const char* last, double& value)
{
    const char* at = first;
    if (at < last && *at == '+') {
        ++at;
        if (at < last && *at == '-') return false;
    }
    const auto got = fast_float::from_chars(at, last, value);
    if (got.ec != std::errc()) {
        // Newer versions report an underflow, whose nearest double is 0, as out of range.
        if (got.ec != std::errc::result_out_of_range || value != 0.0) return false;
    }
    if (!std::isfinite(value)) return false;
    first = got.ptr;
    while (first < last && (*first == ' ' || *first == '\t')) ++first;
    return true;
}

NumberError parse_number(std::string_view field, double& value)
{
    field = trimmed(field);
    if (field.empty()) return NumberError::empty;
    const char *first = field.data(), *last = first + field.size();
    if (scan_number(first, last, value) && first == last) return NumberError::none;
    double any = 0;
    const char* at = field.data();
    if (field.size() > 1 && *at == '+' && at[1] != '-') ++at;
    const auto got = fast_float::from_chars(at, last, any);
    if (got.ptr == last && at < last) return NumberError::not_finite;  // nan, inf, 1e999
    if (got.ec == std::errc() && got.ptr < last && *got.ptr == ',') return NumberError::decimal_comma;
    return NumberError::text;
}

}  // namespace dqw
