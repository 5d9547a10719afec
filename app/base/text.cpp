#include "app/base/text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace dqw {

std::string as_utf8(std::string_view bytes)
{
    std::string text(bytes);
    try {
        (void)nlohmann::json(text).dump();
        return text;
    } catch (const nlohmann::json::type_error&) {
        text.clear();
    }
    for (const char c : bytes) {
        const auto byte = static_cast<unsigned char>(c);
        if (byte >= 0x80) text += static_cast<char>(byte < 0xc0 ? 0xc2 : 0xc3);
        text += static_cast<char>(byte < 0xc0 ? byte : byte - 0x40);
    }
    return text;
}

std::string printable(std::string_view bytes)
{
    std::string out;
    for (const char c : bytes) {
        const auto byte = static_cast<unsigned char>(c);
        // Bytes from 0x80 stay: names may be UTF-8.
        if (byte < 0x20 || byte == 0x7f)
            out += fmt::format("\\x{:02x}", byte);
        else
            out += c;
    }
    return out;
}

std::string shown(std::string_view bytes, std::size_t max)
{
    // Not within a character, which has four bytes at most: what has more of the kind is none.
    constexpr std::size_t most_back = 3;
    const std::size_t cut = std::min(max, bytes.size());
    std::size_t end = cut;
    while (end > 0 && cut - end < most_back && end < bytes.size() &&
           (static_cast<unsigned char>(bytes[end]) & 0xc0U) == 0x80U)
        --end;
    return "\"" + printable(bytes.substr(0, end)) + (end < bytes.size() ? "…\"" : "\"");
}

std::string list(const std::vector<std::string>& items, std::size_t max)
{
    std::string out;
    for (std::size_t i = 0; i < items.size() && i < max; ++i) out += (i ? ", " : "") + items[i];
    if (items.size() > max) out += fmt::format(" … and {} more", items.size() - max);
    return out;
}

std::string counted(std::size_t n, std::string_view noun) { return fmt::format("{} {}{}", n, noun, n == 1 ? "" : "s"); }

std::string with_minus(std::string_view text)
{
    std::string out;
    for (std::size_t k = 0; k < text.size(); ++k) {
        const bool opens = k == 0 || std::string_view(" (=").find(text[k - 1]) != std::string_view::npos;
        const bool number = k + 1 < text.size() && ((text[k + 1] >= '0' && text[k + 1] <= '9') || text[k + 1] == '.');
        if (text[k] == '-' && opens && number)
            out += "\u2212";
        else
            out += text[k];
    }
    return out;
}

std::string_view trimmed(std::string_view text)
{
    const auto first = text.find_first_not_of(" \t");
    if (first == std::string_view::npos) return {};
    return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

}  // namespace dqw
