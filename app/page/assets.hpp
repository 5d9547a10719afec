// Files that the binary carries: what a report needs to open offline.
#ifndef DQW_APP_PAGE_ASSETS_HPP
#define DQW_APP_PAGE_ASSETS_HPP

#include <string_view>

namespace dqw {

/// The plotting library dygraphs and its licence, as Debian packages them.
std::string_view dygraphs_js();
std::string_view dygraphs_css();
std::string_view dygraphs_licence();

/// What page.css and page.js beside this file say.
std::string_view report_css();
std::string_view report_js();

}  // namespace dqw
#endif
