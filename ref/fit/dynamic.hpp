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

/// What a plain fit says of logs that others learn from: R, L_d, L_q, psi, and deviations that hold what may be hidden,
/// infinite where the rows do not tell.
struct PlainLook {
    Eigen::Vector4d value, sd;
    HiddenLoss hidden;
    bool filtered = false;  ///< a filter is likely, and takes more from L_d or L_q than the fit does not tell anyway
};

/// A plain fit of at most 20 000 of the logs' rows, their pole pairs known. Returns nothing where they are too few or it
/// does not converge.
std::optional<PlainLook> plain_look(const std::vector<Log>& logs, double pole_pairs);

}  // namespace dqw
#endif
