// Foreign bytes and lists in one-line messages.
#ifndef DQW_APP_BASE_TEXT_HPP
#define DQW_APP_BASE_TEXT_HPP

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace dqw {

/// `bytes` as UTF-8: what is none is taken as Latin-1, which a header with "°C" in one byte is.
std::string as_utf8(std::string_view bytes);

/// `bytes` as one line that is safe on a terminal: control bytes as \xNN.
std::string printable(std::string_view bytes);

/// The same in double quotes, cut to about `max` bytes.
std::string shown(std::string_view bytes, std::size_t max = 40);

/// "a, b, c"; after `max` items "… and 12 more".
std::string list(const std::vector<std::string>& items, std::size_t max = 12);

/// "1 row", "2 rows".
std::string counted(std::size_t n, std::string_view noun);

/// `text` for people to read: a true minus (U+2212) before every number that has a hyphen for it.
std::string with_minus(std::string_view text);

/// `text` without spaces and tabs at both ends.
std::string_view trimmed(std::string_view text);

}  // namespace dqw
#endif
