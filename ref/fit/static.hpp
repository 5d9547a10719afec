// The fit of settled points: steady and standstill.
#ifndef DQW_REF_FIT_STATIC_HPP
#define DQW_REF_FIT_STATIC_HPP

#include "ref/fit/task.hpp"
#include "ref/log/result.hpp"

namespace dqw {

/// Returns parameters, not_identifiable, residual and notes; rows and regime are fit()'s. Throws std::invalid_argument
///         where rows are too few.
Result fit_static(const Task& task);

}  // namespace dqw
#endif
