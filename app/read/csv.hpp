// Fields and numbers of one CSV line. Knows no column by name.
#ifndef DQW_APP_READ_CSV_HPP
#define DQW_APP_READ_CSV_HPP

#include <string>
#include <string_view>
#include <vector>

namespace dqw {

/// The separator a header line uses: whichever of comma, semicolon and tab it has most of, outside quotes.
char separator_of(std::string_view header);

/// Splits a line; spaces around a field and quotes around its text are taken off ("" inside quotes is one quote).
std::vector<std::string> split(std::string_view line, char separator);

enum class NumberError { none, empty, text, not_finite, decimal_comma };

/// Parses a whole field as a finite number, spaces and a plus sign allowed, whatever the locale.
NumberError parse_number(std::string_view field, double& value);

/// Parses the number at `first`, leaving `first` behind it and behind spaces. False if there is no finite number.
bool scan_number(const char*& first, const char* last, double& value);

}  // namespace dqw
#endif
