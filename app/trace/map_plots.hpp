// The plots of a flux map: along each axis, where the log was.
#ifndef DQW_APP_TRACE_MAP_PLOTS_HPP
#define DQW_APP_TRACE_MAP_PLOTS_HPP

#include "app/page/plot.hpp"
#include "ref/effect/plane.hpp"

namespace dqw {

/// Flux linkages and incremental inductances within two deviations; without plots where there is no map.
PlotGroup map_group(const FluxMap& map);

/// What the second has more, at the first's currents; without plots where no current was seen by both.
PlotGroup difference_group(const FluxMap& first, const FluxMap& second);

}  // namespace dqw
#endif
