// What a residual is plotted against.
#ifndef DQW_APP_TRACE_PLOT_AXES_HPP
#define DQW_APP_TRACE_PLOT_AXES_HPP

#include <array>
#include <string>
#include <vector>

#include "ref/trace/trace.hpp"

namespace dqw {

/// A column of the blocks as an x axis.
struct PlotAxis {
    std::string name, label;  ///< "time", "time [s]"
    std::vector<double> values;
    bool ordered = false;  ///< increases from block to block
};

/// Time; logs one after the other where it starts anew; the number of the point where there is no time.
PlotAxis time_axis(const TraceBlocks& blocks, Regime regime);

/// Time, angle, currents, speed, temperature: those that the log has and that vary.
std::vector<PlotAxis> plot_axes(const TraceBlocks& blocks, Regime regime);

/// Stretches of an ordered axis that no fit saw; none where they are too many to be seen apart.
std::vector<std::array<double, 2>> heldout_stretches(const PlotAxis& axis, const std::vector<char>& heldout);

}  // namespace dqw
#endif
