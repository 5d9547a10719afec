#include "app/read/header.hpp"

#include <fmt/format.h>

#include "app/base/input_error.hpp"
#include "app/base/text.hpp"
#include "app/read/csv.hpp"

namespace dqw {
namespace {

void refuse_foreign_encodings(const std::string& path, std::string_view& line)
{
    const auto starts = [&](std::string_view mark) { return line.substr(0, mark.size()) == mark; };
    if (starts("\xff\xfe") || starts("\xfe\xff")) throw InputError(path, 1, "UTF-16 text; expected UTF-8 or ASCII");
    if (starts("\xef\xbb\xbf")) line.remove_prefix(3);
    if (line.find('\0') != line.npos) throw InputError(path, 1, "binary data (a NUL byte); expected a CSV header");
    if (line.find('\r') != line.npos) throw InputError(path, 1, "lines end with CR alone; expected LF or CRLF");
}

std::vector<std::string> shown_all(const std::vector<std::string>& names)
{
    std::vector<std::string> out;
    for (const auto& name : names) {
        // shown() minus its quotes: names of a healthy header read better bare.
        const std::string text = shown(name);
        out.push_back(text.substr(1, text.size() - 2));
    }
    return out;
}

}  // namespace

Header parse_header(const std::string& path, std::string_view line, const MachineFile& machine)
{
    refuse_foreign_encodings(path, line);
    if (trimmed(line).empty())
        throw InputError(path, 1,
                         "an empty first line; expected a CSV header such as t_s,v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s");
    Header header;
    header.separator = separator_of(line);
    header.fields = split(line, header.separator);
    if (header.fields.size() > 1 && header.fields.back().empty()) {
        header.trailing_separator = true;
        header.fields.pop_back();
    }
    if (header.fields.size() > Header::most_fields)
        throw InputError(path, 1,
                         fmt::format("{} columns; expected at most {}", header.fields.size(), Header::most_fields));
    header.field_of.fill(Header::none);
    header.scale.fill(1.0);

    std::vector<bool> used(header.fields.size(), false);
    for (std::size_t c = 0; c < column_count; ++c) {
        const ColumnSource& source = machine.sources[c];
        const std::string name = source.line ? source.name : columns[c].name;
        for (std::size_t f = 0; f < header.fields.size(); ++f) {
            if (header.fields[f] != name) continue;
            if (header.field_of[c] != Header::none)
                throw InputError(path, 1,
                                 fmt::format("column {} is there twice (fields {} and {}); expected once", shown(name),
                                             header.field_of[c] + 1, f + 1));
            header.field_of[c] = f;
            header.scale[c] = source.scale;
            used[f] = true;
        }
    }
    for (std::size_t f = 0; f < header.fields.size(); ++f)
        if (!used[f]) header.unused.push_back(header.fields[f].empty() ? "(nameless)" : header.fields[f]);
    header.unused = shown_all(header.unused);
    return header;
}

void require_columns(const std::string& path, const Header& header, std::optional<Regime> regime,
                     const MachineFile& machine)
{
    const Regime assumed = regime.value_or(Regime::dynamic);
    auto missing = missing_columns(assumed, header.has(), machine.machine.torque_constant_Nm_A.has_value());
    if (missing.empty()) return;
    for (auto& name : missing) {
        const auto column = column_named(name);
        if (column && machine.sources[*column].line)
            name += fmt::format(" (from {})", shown(machine.sources[*column].name));
    }
    throw InputError(path, 1,
                     fmt::format("missing column{} {}; a {} log needs {}, the file has {}",
                                 missing.size() == 1 ? "" : "s", list(missing), name_of(assumed),
                                 missing.size() == 1 ? "it" : "them", list(shown_all(header.fields))));
}

}  // namespace dqw
