// A traced point without what noise of the logged columns makes of it, and how far it may be off.
#ifndef DQW_REF_TRACE_COLUMN_NOISE_HPP
#define DQW_REF_TRACE_COLUMN_NOISE_HPP

#include "ref/model/column_noise.hpp"
#include "ref/trace/setup.hpp"

namespace dqw {

/// (E110), of a dynamic log: `refined` is a point of `model`, which is setup.full or has its rows. As it is elsewhere.
Refined without_column_noise(const TraceSetup& setup, const Model& model, const Refined& refined);

/// Nats on the rows held out that a point's effects lose to noise of the logged columns which their own laws bring in,
/// beside the plain model's; below 0 where they average it away. 0 where that cannot be had.
double nats_to_law_noise(const TraceSetup& setup, const Refined& refined);

/// Deviations of a point's columns with what the model's own error may hide, (E111), (E190) to (E192).
Eigen::VectorXd whole_deviations(const TraceSetup& setup, const Model& model, const Refined& refined);

}  // namespace dqw
#endif
