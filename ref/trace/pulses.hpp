// A log's inverter as its pulses go: what stands for its link, and iron whose eddies see the pulses.
#ifndef DQW_REF_TRACE_PULSES_HPP
#define DQW_REF_TRACE_PULSES_HPP

#include "ref/trace/setup.hpp"

namespace dqw {

/// Where a fit of the link begins; 0: the logs have its column.
double start_link_V(const std::vector<Log>& logs);

/// The same point with the time constant of its iron's eddies, and the modulation whose pulses they see, that predict
/// best; as it is where it has none that follow late. Pulses are left only where the rows held out confirm them.
Refined settle_iron(const TraceSetup& setup, const Model& model, Refined found);

}  // namespace dqw
#endif
