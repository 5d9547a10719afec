// What a comparison is drawn as.
#ifndef DQW_APP_REPORT_COMPARE_PLOTS_HPP
#define DQW_APP_REPORT_COMPARE_PLOTS_HPP

#include <vector>

#include "app/page/plot.hpp"
#include "app/report/compare.hpp"

namespace dqw {

/// Each parameter over time, of float and Q15; the reference as a level line.
std::vector<Plot> compare_plots(const Comparison& c);

}  // namespace dqw
#endif
