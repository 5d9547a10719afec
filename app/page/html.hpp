// Text as HTML, and as data inside HTML.
#ifndef DQW_APP_PAGE_HTML_HPP
#define DQW_APP_PAGE_HTML_HPP

#include <string>
#include <string_view>
#include <vector>

#include "app/page/thin.hpp"

namespace dqw {

/// Text between tags or in a quoted attribute.
std::string escaped(std::string_view text);

/// `escaped`, with numbers kept on one line with their deviations and units.
std::string unbroken(std::string_view text);

/// A table; the first row is the heading, the first column of each row too. `css` is its class.
std::string html_table(const std::vector<std::vector<std::string>>& rows, std::string_view css);

/// A JSON string that may stand inside a <script> block: no < of it can end the block.
std::string script_string(const std::string& text);

/// [[x, y, …], …], row by row; five digits of y, more of x; null for NaN.
std::string script_rows(const Columns& columns);

}  // namespace dqw
#endif
