// How probable it is that a machine has the effect that was named.
#ifndef DQW_REF_TRACE_CONFIDENCE_HPP
#define DQW_REF_TRACE_CONFIDENCE_HPP

#include "ref/search/select.hpp"

namespace dqw {

/// Probability that the log has the effect `found`, (E112): against each rival that makes physical sense, against
/// nothing in its place, and against what no catalogue holds. `share`: part of what is above the noise that the named
/// effects explain together.
double confidence_of(const Found& found, double share);

}  // namespace dqw
#endif
