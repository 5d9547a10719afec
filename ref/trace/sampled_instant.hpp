// When the currents of a row are sampled: among the legs' pulses, or a little late as on each drive.
#ifndef DQW_REF_TRACE_SAMPLED_INSTANT_HPP
#define DQW_REF_TRACE_SAMPLED_INSTANT_HPP

#include <string>

#include "ref/search/solve.hpp"
#include "ref/trace/setup.hpp"

namespace dqw {

/// (E168). The same point with its shift, or its lag, of the currents told without pulses, or between those of a
/// modulation, whichever predicts best and the rows held out confirm; as it is where it has none. What the pulses add
/// shows only once what else the machine has is in the model.
/// Cost  four fits for each modulation, and one
Refined settle_instant(const TraceSetup& setup, const Model& model, Refined found);

/// What a converter that takes one current after the other, and its amplifier, leave at most.
constexpr double kSampling_s = 1e-6;

/// Whether an effect of a machine's point is no more than what a converter that takes one current after the other, and
/// its amplifier, leave of the currents: a shift or a lag, or a loss or a short by what it takes of them. (E196)
bool may_be_sampling(const Point& at, const std::string& name);

}  // namespace dqw

#endif
