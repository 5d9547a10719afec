// What the fits of the regimes are asked.
#ifndef DQW_REF_FIT_TASK_HPP
#define DQW_REF_FIT_TASK_HPP

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "ref/log/log.hpp"

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
    bool by_angle = false;       ///< the pole pairs are not given, but seen in the angle

    bool asks(const std::string& name) const;
};

}  // namespace dqw
#endif
