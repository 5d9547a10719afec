// When the currents of a row are sampled, among the legs' pulses.
#ifndef DQW_REF_TRACE_SAMPLED_INSTANT_HPP
#define DQW_REF_TRACE_SAMPLED_INSTANT_HPP

#include "ref/search/solve.hpp"
#include "ref/trace/setup.hpp"

namespace dqw {

/// (E168). The same point with its shift, or its lag, of the currents told between the pulses, of the modulation that
/// predicts best, where the rows held out confirm it; as it is where it has none. What the pulses add shows only once
/// what else the machine has is in the model.
/// Cost  a fit for each modulation
Refined settle_instant(const TraceSetup& setup, const Model& model, Refined found);

}  // namespace dqw

#endif
