// What a fit says of the parameters that were asked for.
#ifndef DQW_REF_FIT_PUBLISH_HPP
#define DQW_REF_FIT_PUBLISH_HPP

#include <string>
#include <vector>

#include "ref/fit/assess.hpp"
#include "ref/fit/task.hpp"
#include "ref/log/result.hpp"

namespace dqw {

/// Says why `name` is not known, what would help, and asks for it no longer.
void withhold(Task& task, const std::string& name, const std::string& why, const std::string& would_help,
              Result& result);

/// Says that of `name` only its product with the pole pairs is known, and asks for it no longer.
void withhold_product(Task& task, const std::string& name, double product, double sd, Result& result);

/// Puts every asked parameter of `names` into result.parameters or, with the reason, into result.not_identifiable.
void publish(const Task& task, const std::vector<std::string>& names, const Covariance& covariance, Result& result);

/// Adds what to say of standard deviations from correlated residuals.
void note_robust(const Covariance& covariance, Result& result);

}  // namespace dqw
#endif
