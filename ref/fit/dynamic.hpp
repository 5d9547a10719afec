// The fit of dynamic logs.
#ifndef DQW_REF_FIT_DYNAMIC_HPP
#define DQW_REF_FIT_DYNAMIC_HPP

#include <optional>
#include <vector>

#include "ref/fit/hidden_loss.hpp"
#include "ref/fit/task.hpp"
#include "ref/log/result.hpp"

namespace dqw {

/// Returns parameters, not_identifiable, residual and notes; rows and regime are fit()'s. Throws std::invalid_argument
///         where rows are too few.
Result fit_dynamic(const Task& task);

/// A filter of the currents that a plain fit shows, of at most 20 000 of the logs' rows, their pole pairs known.
/// Returns nothing where it is not likely, or takes less from L_d and from L_q than such a fit does not tell anyway.
std::optional<HiddenLoss> hidden_filter_in(const std::vector<Log>& logs, double pole_pairs);

}  // namespace dqw
#endif
