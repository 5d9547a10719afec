// The fit of dynamic logs.
#ifndef DQW_REF_FIT_DYNAMIC_HPP
#define DQW_REF_FIT_DYNAMIC_HPP

#include "ref/fit/task.hpp"
#include "ref/log/result.hpp"

namespace dqw {

/// Returns parameters, not_identifiable, residual and notes; rows and regime are fit()'s. Throws std::invalid_argument
///         where rows are too few.
Result fit_dynamic(const Task& task);

}  // namespace dqw
#endif
