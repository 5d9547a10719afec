// report.html: a trace as one page that opens offline.
#ifndef DQW_APP_TRACE_PAGE_HPP
#define DQW_APP_TRACE_PAGE_HPP

#include <string>

#include "app/page/page.hpp"
#include "app/trace/report.hpp"

namespace dqw {

/// The whole page: text, tables, plots with the library that draws them. It asks for nothing from outside, and says so
/// in a content security policy. Every string that may come from a file is escaped. Time grows with the number of
/// blocks, size does not.
std::string report_page(const TraceReport& report, Extent extent = Extent::whole);

}  // namespace dqw
#endif
