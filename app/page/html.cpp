#include "app/page/html.hpp"

#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>

namespace dqw {

std::string escaped(std::string_view text)
{
    std::string out;
    out.reserve(text.size());
    for (const char c : text) {
        switch (c) {
        case '&': out += "&amp;"; break;
        case '<': out += "&lt;"; break;
        case '>': out += "&gt;"; break;
        case '"': out += "&quot;"; break;
        case '\'': out += "&#39;"; break;
        default: out += static_cast<unsigned char>(c) < 0x20 && c != '\n' ? ' ' : c;
        }
    }
    return out;
}

std::string unbroken(std::string_view text)
{
    const std::string plain = escaped(text);
    std::string out;
    for (std::size_t k = 0; k < plain.size(); ++k) {
        const bool behind_number = k > 0 && plain[k - 1] >= '0' && plain[k - 1] <= '9';
        const bool behind_sign = k > 1 && plain.compare(k - 2, 2, "±") == 0;
        const bool beside_equals = (k > 0 && plain[k - 1] == '=') || (k + 1 < plain.size() && plain[k + 1] == '=');
        if (plain[k] == ' ' && (behind_number || behind_sign || beside_equals))
            out += "\u00a0";
        else
            out += plain[k];
    }
    return out;
}

std::string html_table(const std::vector<std::vector<std::string>>& rows, std::string_view css)
{
    std::string out = fmt::format("<div class=\"scroll\"><table class=\"{}\">", css);
    for (std::size_t r = 0; r < rows.size(); ++r) {
        out += r == 0 ? "<thead><tr>" : "<tr>";
        for (std::size_t c = 0; c < rows[r].size(); ++c) {
            const char* tag = r == 0 || c == 0 ? "th" : "td";
            out += fmt::format("<{0}{2}>{1}</{0}>", tag, escaped(rows[r][c]),
                               r == 0   ? " scope=\"col\""
                               : c == 0 ? " scope=\"row\""
                                        : "");
        }
        out += r == 0 ? "</tr></thead><tbody>\n" : "</tr>\n";
    }
    return out + "</tbody></table></div>\n";
}

std::string script_string(const std::string& text)
{
    std::string json = nlohmann::json(text).dump(-1, ' ', true, nlohmann::json::error_handler_t::replace), out;
    for (const char c : json)
        if (c == '<')
            out += "\\u003c";
        else
            out += c;
    return out;
}

std::string script_rows(const Columns& columns)
{
    fmt::memory_buffer out;
    const auto at = std::back_inserter(out);
    out.push_back('[');
    for (std::size_t k = 0; !columns.empty() && k < columns[0].size(); ++k) {
        if (k) out.push_back(',');
        out.push_back('[');
        for (std::size_t c = 0; c < columns.size(); ++c) {
            if (c) out.push_back(',');
            const double value = columns[c][k];
            if (!std::isfinite(value))
                fmt::format_to(at, "null");
            else
                fmt::format_to(at, "{:.{}g}", value, c ? 5 : 8);
        }
        out.push_back(']');
    }
    out.push_back(']');
    return fmt::to_string(out);
}

}  // namespace dqw
