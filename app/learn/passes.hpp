// As many passes over electrical logs as their effects need.
#ifndef DQW_APP_LEARN_PASSES_HPP
#define DQW_APP_LEARN_PASSES_HPP

#include <functional>
#include <vector>

#include "app/learn/parts.hpp"

namespace dqw {

/// Pairs in half a block of an electrical log: short enough for the angle with which an effect comes and goes.
std::uint16_t half_window_of(const std::vector<Log>& logs, const std::vector<TraceInput>& inputs, double pole_pairs);

/// One pass of some learners over the logs with everything decided: the inputs' shapes, the pole pairs and whether they
/// were given.
using Pass = std::function<Learned(const std::vector<Log>&, const LearnOptions&, const std::vector<TraceInput>&,
                                   double pole_pairs, bool p_given)>;
/// As many passes over electrical logs as their effects need, and the residual.
Learned learn_in_passes(const std::vector<Log>& logs, const LearnOptions& options, const Pass& pass);

}  // namespace dqw
#endif
