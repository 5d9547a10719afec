// The torque constant from logs that have torque and current: one static input, learned by all that was seen.
#ifndef DQW_APP_LEARN_TORQUE_CONSTANT_HPP
#define DQW_APP_LEARN_TORQUE_CONSTANT_HPP

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "app/learn/parts.hpp"

namespace dqw {

/// Least squares of torque = K_t i_q; the deviation as that of the learners' weights.
class TorqueConstant {
public:
    void learn(double i_q_A, double torque_Nm)
    {
        const double before = torque_Nm - value() * i_q_A;
        ii_ += i_q_A * i_q_A;
        it_ += i_q_A * torque_Nm;
        tt_ += torque_Nm * torque_Nm;
        const double after = torque_Nm - value() * i_q_A;
        // The sum of the products is that of the final value's residuals.
        ee_ += before * after;
        lag_ += after * last_;
        last_ = after;
        ++rows_;
    }

    Read read() const
    {
        constexpr double kFloor = 1e-13, kLagMost = 0.98;
        if (rows_ < 2 || !(ii_ > 0.0)) return {};
        const double freedom = static_cast<double>(rows_ - 1);
        const double variance = std::max(ee_ / freedom, kFloor * tt_ / static_cast<double>(rows_));
        const double r = ee_ > kFloor * tt_ ? std::clamp(lag_ / ee_, 0.0, kLagMost) : 0.0;
        return {value(), std::sqrt(variance / ii_ * (1.0 + r) / (1.0 - r))};
    }

private:
    double value() const { return ii_ > 0.0 ? it_ / ii_ : 0.0; }
    double ii_ = 0.0, it_ = 0.0, tt_ = 0.0, ee_ = 0.0, lag_ = 0.0, last_ = 0.0;
    std::size_t rows_ = 0;
};

}  // namespace dqw
#endif
