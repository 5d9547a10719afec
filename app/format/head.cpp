#include "app/format/head.hpp"

namespace dqw {
namespace {

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

}  // namespace

bool equal_ignoring_case(std::string_view a, std::string_view b)
{
    if (a.size() != b.size()) return false;
    for (std::size_t k = 0; k < a.size(); ++k)
        if (lower(a[k]) != lower(b[k])) return false;
    return true;
}

std::size_t Head::find(std::string_view name) const
{
    for (std::size_t f = 0; f < fields.size(); ++f)
        if (equal_ignoring_case(fields[f], name)) return f;
    return none;
}

std::size_t Head::find_ending(std::string_view name) const
{
    for (std::size_t f = 0; f < fields.size(); ++f) {
        const std::string_view field = fields[f];
        if (field.size() < name.size() || !equal_ignoring_case(field.substr(field.size() - name.size()), name))
            continue;
        if (field.size() == name.size()) return f;
        const char before = field[field.size() - name.size() - 1];
        if (before == '/' || before == '.') return f;
    }
    return none;
}

}  // namespace dqw
