// The fit of polled logs: every row an exact average, weighed by how settled it is.
#ifndef DQW_REF_FIT_POLLED_HPP
#define DQW_REF_FIT_POLLED_HPP

#include "ref/fit/task.hpp"
#include "ref/log/result.hpp"

namespace dqw {

/// (E150) to (E154). Returns parameters, dead_time, not_identifiable, residual and notes; rows and regime are fit()'s.
/// Throws std::invalid_argument where rows are too few.
Result fit_polled(const Task& task);

}  // namespace dqw
#endif
