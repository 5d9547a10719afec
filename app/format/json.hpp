// JSON files as lines of CSV.
#ifndef DQW_APP_FORMAT_JSON_HPP
#define DQW_APP_FORMAT_JSON_HPP

#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>

#include "app/format/format.hpp"

namespace dqw {

struct JsonLine {
    nlohmann::json object;   ///< discarded where the line is no JSON
    std::size_t number = 1;  ///< of the line
};

/// The first line that is not empty.
JsonLine first_object(const std::string& text);

/// One object a line: the first one's keys are the columns. Throws InputError at a line that is none.
bool objects_to_csv(const std::string& path, const std::string& text, CsvText& csv);

/// A value as a field: a number, a text without commas, empty where it is null or something else.
std::string json_cell(const nlohmann::json& value);

/// What stands for a line that the file's end cuts off: a row of too few fields.
constexpr const char* kCutRow = "cut off";

/// Calls `take(line, number, ended)` for each line that is not empty, without its end, which the last may lack.
template <class Take> void each_line(const std::string& text, const Take& take)
{
    std::size_t number = 0;
    for (std::size_t from = 0; from < text.size();) {
        const std::size_t end = std::min(text.find('\n', from), text.size());
        std::string line = text.substr(from, end - from);
        if (!line.empty() && line.back() == '\r') line.pop_back();
        from = end + 1, ++number;
        if (line.find_first_not_of(" \t") != line.npos) take(line, number, end < text.size());
    }
}

}  // namespace dqw
#endif
