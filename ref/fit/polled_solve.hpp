// Weighted least squares of a polled log's rows, and what its weights are worth.
#ifndef DQW_REF_FIT_POLLED_SOLVE_HPP
#define DQW_REF_FIT_POLLED_SOLVE_HPP

#include <Eigen/Core>
#include <array>
#include <vector>

#include "ref/log/polled.hpp"

namespace dqw {

/// Weights of (E150): across them also the volts along the current, and by how long the voltage is ahead of it, and
/// psi times the time by which the speed is late.
enum PolledWeight { kPolledR, kPolledLd, kPolledLq, kPolledPsi, kPolledV, kPolledTau, kPolledLate, kPolledWeights };

using PolledVector = Eigen::Matrix<double, kPolledWeights, 1>;

/// Which weights are free. `one_L`: L_d is taken to be L_q.
struct PolledForm {
    bool R = true, Ld = true, Lq = true, psi = true, V = true, tau = false, late = true, one_L = false;
};

struct PolledSolution {
    bool ok = false;
    PolledVector x = PolledVector::Zero();
    PolledVector sd = PolledVector::Zero();  ///< (E152); zero for what is not free
    double quiet_V = 0.0;                    ///< residual of settled rows, of either axis
    double follows = 0.0;                    ///< (E153): part of psi that speed noise takes
    std::vector<double> share;               ///< of each row: its weight, 0 to 1; 0 where it is left out
    std::vector<std::array<double, 2>> e_V;  ///< each row's residual
};

/// Of all weights, and one more that is nothing: eight fill the processor's vectors.
constexpr int kPolledFilled = 8;
static_assert(kPolledWeights <= kPolledFilled, "kPolledFilled holds all weights");
using PolledFilled = Eigen::Matrix<double, kPolledFilled, 1>;

/// One row's equations, y = x w; `turn_s` is what the frame is known to be off by, per electrical speed. Of v_q alone,
/// or of the voltage's size, the second is the one there is: |v| is taken along the direction that the weights `at`
/// give.
struct PolledEquations {
    std::array<PolledFilled, 2> x;
    Eigen::Vector2d y;
};
PolledEquations polled_equations(const PolledRow& r, bool one_L, double turn_s, const PolledVector& at);

/// How many equations a row of these has.
double equations_a_row(const std::vector<PolledRow>& rows);

/// (E152): of the residuals' square, what neighbours share that have no instant of the speed in common.
double lasting_V2(const PolledSolution& s, double per_row);

/// Deviations cost more than weights; without them `sd` and `follows` are zero.
enum class PolledDeviations { found, left_out };

/// Rows of one machine; speeds are electrical.
PolledSolution solve_polled(const std::vector<PolledRow>& rows, const PolledForm& form, double noise_rad_s,
                            PolledDeviations deviations = PolledDeviations::found);

/// Other rows of the same machine under what was found: their shares and residuals.
PolledSolution under(const PolledSolution& of, const std::vector<PolledRow>& rows, const PolledForm& form);

/// Sum of squared residuals of settled rows, each eighth of the rows judged by the weights of the others; V².
std::vector<double> held_out_polled(const std::vector<PolledRow>& rows, const PolledSolution& weighed,
                                    const PolledForm& form);

}  // namespace dqw
#endif
