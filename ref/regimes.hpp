// The fit of each regime, behind fit().
#ifndef DQW_REF_REGIMES_HPP
#define DQW_REF_REGIMES_HPP

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "assess.hpp"
#include "log.hpp"
#include "result.hpp"

namespace dqw {

/// Rows of the shortest stretch without a gap that is simulated.
constexpr std::size_t kLeastPiece = 10;

/// What fit() has found out before it knows the regime.
struct Task {
    const std::vector<Log>& logs;
    std::vector<std::string> asked;    ///< never empty
    std::optional<double> pole_pairs;  ///< of the machine
    std::optional<double> torque_constant_Nm_A;
    std::function<void()> tick;  ///< one evaluation done

    bool asks(const std::string& name) const;
};

/// Each returns parameters, not_identifiable, residual and notes; rows and regime are fit()'s. They throw
/// std::invalid_argument where rows are too few.
Result fit_dynamic(const Task& task);
Result fit_static(const Task& task);  ///< steady and standstill
Result fit_mechanical(const Task& task);

/// Says that of `name` only its product with the pole pairs is known, and asks for it no longer.
void withhold_product(Task& task, const std::string& name, double product, double sd, Result& result);

/// Puts every asked parameter of `names` into result.parameters or, with the reason, into result.not_identifiable.
void publish(const Task& task, const std::vector<std::string>& names, const Covariance& covariance, Result& result);

/// Adds what to say of standard deviations from correlated residuals.
void note_robust(const Covariance& covariance, Result& result);

}  // namespace dqw
#endif
