#include "app/format/json.hpp"

#include <fmt/format.h>

#include "app/base/input_error.hpp"
#include "app/base/text.hpp"

namespace dqw {

JsonLine first_object(const std::string& text)
{
    std::size_t from = 0;
    JsonLine line;
    while (from < text.size() && (text[from] == '\r' || text[from] == '\n' || text[from] == ' ')) {
        line.number += text[from] == '\n';
        ++from;
    }
    const std::size_t end = std::min(text.find('\n', from), text.size());
    line.object = nlohmann::json::parse(text.begin() + static_cast<std::ptrdiff_t>(from),
                                        text.begin() + static_cast<std::ptrdiff_t>(end), nullptr, false);
    return line;
}

std::string json_cell(const nlohmann::json& value)
{
    if (value.is_number()) return value.dump();
    if (value.is_boolean()) return value.get<bool>() ? "1" : "0";
    if (!value.is_string()) return "";
    std::string text = printable(value.get<std::string>());
    for (char& c : text)
        if (c == ',' || c == '"') c = ' ';
    return text;
}

bool objects_to_csv(const std::string& path, const std::string& text, CsvText& csv)
{
    std::vector<std::string> keys;
    each_line(text, [&](const std::string& line, std::size_t number, bool ended) {
        const nlohmann::json object = nlohmann::json::parse(line, nullptr, false);
        if (object.is_discarded() && !ended && keys.size() > 1) return csv.add(kCutRow, number);
        if (!object.is_object())
            throw InputError(path, number, shown(line) + " is no JSON object; expected one a line");
        std::string row;
        if (keys.empty()) {
            for (const auto& [key, value] : object.items()) {
                keys.push_back(key);
                row += (row.empty() ? "" : ",") + json_cell(key);
            }
            csv.add(row, number);
            row.clear();
        }
        for (std::size_t k = 0; k < keys.size(); ++k) {
            const auto found = object.find(keys[k]);
            row += (k ? "," : "") + (found == object.end() ? std::string() : json_cell(*found));
        }
        csv.add(row, number);
    });
    return true;
}

}  // namespace dqw
