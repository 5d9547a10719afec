// The tables that the text and the page of a trace share.
#ifndef DQW_APP_TRACE_ROWS_HPP
#define DQW_APP_TRACE_ROWS_HPP

#include <string>
#include <vector>

#include "app/trace/report.hpp"

namespace dqw {

using Rows = std::vector<std::vector<std::string>>;

/// Parameters without and with the effects, or of one fit where none was found; the first row is the heading.
Rows parameter_rows(const TraceFit& before, const TraceFit& after, bool effects_found);

/// Held-out residual before and after, of both, and in percent of each axis.
Rows residual_rows(const TraceReport& report);

/// One row a parameter of an effect: effect and its confidence, parameter, value.
Rows effect_rows(const TraceResult& trace);

/// "1.53 V", "0.160 V": without prefixes, so that a column of them compares.
std::string residual_text(double rms, const std::string& unit);

}  // namespace dqw
#endif
