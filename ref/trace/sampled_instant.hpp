// When the currents of a row are sampled, among the legs' pulses.
#ifndef DQW_REF_TRACE_SAMPLED_INSTANT_HPP
#define DQW_REF_TRACE_SAMPLED_INSTANT_HPP

#include "ref/search/solve.hpp"
#include "ref/trace/setup.hpp"

namespace dqw {

/// (E168). The same point with its shift, or its lag, of the currents told without pulses, or between those of a
/// modulation, whichever predicts best and the rows held out confirm; as it is where it has none. What the pulses add
/// shows only once what else the machine has is in the model.
/// Cost  four fits for each modulation, and one
Refined settle_instant(const TraceSetup& setup, const Model& model, Refined found);

}  // namespace dqw

#endif
