// The plots of a trace's report, thinned for the eye.
#ifndef DQW_APP_TRACE_PLOTS_HPP
#define DQW_APP_TRACE_PLOTS_HPP

#include <array>
#include <string>
#include <vector>

#include "thin.hpp"
#include "trace.hpp"

namespace dqw {

/// One plot. Series are named "measured", "before", "after", or "measured", "predicted" and "residual" where no effect was found; every
/// label carries its unit.
struct Plot {
    enum class Kind { lines, points, bars };
    Kind kind = Kind::lines;
    std::string title, x_label, y_label;
    std::vector<std::string> series;            ///< of columns[1] and those after it
    Columns columns;                            ///< at most 2000 rows
    Columns means;                              ///< of the points: means along x, from all blocks
    std::vector<std::array<double, 2>> shaded;  ///< stretches of x that no fit saw
    bool log_y = false;
};

struct PlotGroup {
    std::string title, about;
    std::vector<Plot> plots;
};

/// The residual against what it goes with most, of the axis that the effects changed most.
Plot key_plot(const TraceResult& trace);

/// All others: measured and predicted, residuals, spectra. What the log lacks is left out.
std::vector<PlotGroup> plot_groups(const TraceResult& trace);

}  // namespace dqw
#endif
