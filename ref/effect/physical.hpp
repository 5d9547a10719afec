// Weights of an effect to its physical parameters.
#ifndef DQW_REF_EFFECT_PHYSICAL_HPP
#define DQW_REF_EFFECT_PHYSICAL_HPP

#include <vector>

#include "ref/effect/found.hpp"
#include "ref/log/residual.hpp"

namespace dqw {

/// Parameters of all inputs of one effect, as effects() names them, with their deviations; shapes that were assumed are
/// `given`.
/// `sd` belongs to the weights, input by input. Of a shape that was fitted, `shape_sd[i]` is the deviation of input i's
/// first entry; else 0.
std::vector<Estimate> physical(const std::vector<TraceInput>& inputs, const std::vector<std::vector<double>>& sd,
                               const std::vector<double>& shape_sd, const PlainModel& model);

}  // namespace dqw
#endif
