// The plots of a trace's report, thinned for the eye.
#ifndef DQW_APP_TRACE_PLOTS_HPP
#define DQW_APP_TRACE_PLOTS_HPP

#include <vector>

#include "app/page/plot.hpp"
#include "ref/trace/trace.hpp"

namespace dqw {

/// Series are named "measured", "before", "after", or "measured", "predicted" and "residual" where no effect was found.

/// The residual against what it goes with most, of the axis that the effects changed most.
Plot key_plot(const TraceResult& trace);

/// All others: measured and predicted, residuals, spectra. What the log lacks is left out.
std::vector<PlotGroup> plot_groups(const TraceResult& trace);

}  // namespace dqw
#endif
