// Weighted nonlinear least squares of a prediction model, on Ceres, without storing a Jacobian.
#ifndef DQW_REF_FIT_SOLVE_HPP
#define DQW_REF_FIT_SOLVE_HPP

#include <functional>

#include "ref/model/regression.hpp"

namespace dqw {

struct SolveOptions {
    bool common_weight = false;     ///< weigh all channels alike, instead of by their noise
    int passes = 8;                 ///< of theta and noise variances in turn, at most
    int iterations = 40;            ///< of Ceres in one pass
    double tolerance = 1e-10;       ///< relative change of theta that ends a pass
    double sigma_tolerance = 1e-3;  ///< relative change of the noise that ends the passes
    std::function<void()> tick = {};
    /// (E110): what noise of columns adds to the scores of each channel, at theta and with each channel's variance;
    /// empty where that cannot be had.
    std::function<Eigen::MatrixXd(const Eigen::VectorXd& theta, const Eigen::VectorXd& variance)> added = {};
};

/// (E41). The maximum of the likelihood, each channel's noise variance concentrated out.
struct Solution {
    Eigen::VectorXd theta;
    Eigen::VectorXd sigma;  ///< that each channel's innovations were divided by
    Eigen::VectorXd noise;  ///< standard deviation of each channel's innovations, unbiased
    std::vector<bool> free;
    double log_likelihood = 0.0;  ///< up to a constant
    std::vector<BlockSum> sums;   ///< at theta
    Eigen::VectorXd added;        ///< what the scores, over sigma squared, add up to there; empty: zero
    bool ok = false;              ///< false where the model could not be evaluated at the start
};

/// Minimises sum_c sum_k (e_ck / sigma_c)^2 over the entries of theta that are `free`, and re-estimates sigma.
/// The cost handed to Ceres is the square root R of the summed [J e]'[J e] (R'R equals it): n + 1 residuals with the
/// same cost, gradient and Gauss-Newton matrix as all rows.
Solution solve(Regression& model, const Eigen::VectorXd& start, const std::vector<bool>& free,
               const SolveOptions& options);

/// Whether the errors stop depending on theta[j] because it is a gain on a bound.
bool at_bound(const Regression& model, const Eigen::VectorXd& theta, Eigen::Index j);

}  // namespace dqw
#endif
