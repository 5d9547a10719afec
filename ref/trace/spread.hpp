// What of the found parameters hangs on a law that the log does not tell from another.
#ifndef DQW_REF_TRACE_SPREAD_HPP
#define DQW_REF_TRACE_SPREAD_HPP

#include <functional>

#include "ref/trace/setup.hpp"

namespace dqw {

/// Largest change of each column of `best` to a rival that the rows held out do not tell from it, or that fits no
/// worse beside it than it itself does beside the noise. `rivals(model, here)`: `here` with other laws, refitted.
Eigen::VectorXd spread_over(const TraceSetup& setup, const Refined& best,
                            const std::function<std::vector<Refined>(const Model&, const Refined&)>& rivals);

}  // namespace dqw
#endif
