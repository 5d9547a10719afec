// A flux map as firmware has it: a table of how far the flux bends away from its tangent at zero current, (E165).
#ifndef DQW_REF_EFFECT_FLUX_TABLE_HPP
#define DQW_REF_EFFECT_FLUX_TABLE_HPP

#include "ref/effect/found.hpp"
#include "ref/effect/plane.hpp"

namespace dqw {

/// Currents that a table covers, A.
struct FluxRange {
    double least_d_A = 0, most_d_A = 0, most_q_A = 0;
};

/// All that a map has.
FluxRange range_of(const FluxMap& map);

/// The input "flux_map" of both weights 1; what the map says of i_q and of −i_q is averaged. Throws
/// std::invalid_argument for a map that does not bend, or no currents.
TraceInput flux_table(const FluxMap& map, const FluxRange& over);

}  // namespace dqw
#endif
