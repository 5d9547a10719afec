#include "ref/fit/solve.hpp"

#include <ceres/ceres.h>
#include <glog/logging.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "ref/log/symmetric.hpp"

namespace dqw {
namespace {

constexpr double kSigmaRatio = 1e-3;  ///< smallest noise of a channel against the largest: keeps one from ruling alone
constexpr double kAwake = 2e-3;       ///< from a bound, where a gain on it starts again
constexpr double kLeastVariance = 1e-200;  ///< of a log of zeros: its inverse must stay finite

/// The entries of theta that Ceres sees: the free ones, each over its size at the start.
struct Scaling {
    std::vector<int> free;
    Eigen::VectorXd scale, theta;

    Eigen::VectorXd full(const double* z) const
    {
        Eigen::VectorXd out = theta;
        for (std::size_t i = 0; i < free.size(); ++i) out[free[i]] = z[i] * scale[free[i]];
        return out;
    }
    /// The scaled free entries; theta is rounded to what full() gives back.
    std::vector<double> scaled()
    {
        std::vector<double> z;
        for (int j : free) z.push_back(theta[j] / scale[j]);
        theta = full(z.data());
        return z;
    }
};

/// The latest sums, so that no sweep is done twice at one theta.
struct Latest {
    Eigen::VectorXd theta;
    std::vector<BlockSum> sums;
    bool valid = false;

    bool at(const Regression& model, const Eigen::VectorXd& where)
    {
        if (valid && theta == where) return true;
        theta = where;
        return valid = model.sweep(where, sums);
    }
};

class RootCost : public ceres::CostFunction {
public:
    RootCost(const Regression& model, const Scaling& scaling, Eigen::VectorXd sigma, Latest& latest,
             const std::function<void()>& tick)
        : model_(model), scaling_(scaling), sigma_(std::move(sigma)), latest_(latest), tick_(tick)
    {
        const int n = static_cast<int>(scaling.free.size());
        set_num_residuals(n + 1);
        mutable_parameter_block_sizes()->push_back(n);
    }

    bool Evaluate(double const* const* z, double* residuals, double** jacobians) const override
    {
        const Eigen::VectorXd theta = scaling_.full(z[0]);
        if (tick_) tick_();
        const int n = num_residuals() - 1;
        Eigen::Map<Eigen::VectorXd> r(residuals, n + 1);
        if (jacobians == nullptr || jacobians[0] == nullptr) {
            Eigen::VectorXd squares;
            if (!model_.squares(theta, squares)) return false;
            r.setZero();
            r[0] = std::sqrt(squares.cwiseQuotient(sigma_.cwiseAbs2()).sum());
            return std::isfinite(r[0]);
        }
        if (!latest_.at(model_, theta)) return false;
        const Eigen::MatrixXd root = root_of(latest_.sums);
        if (!root.allFinite()) return false;
        r = root.col(n);
        using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
        Eigen::Map<RowMajor>(jacobians[0], n + 1, n) = root.leftCols(n);
        return true;
    }

private:
    /// A square root of the weighted sum over channels, from its eigenvalues: a singular sum has one too.
    Eigen::MatrixXd root_of(const std::vector<BlockSum>& sums) const
    {
        const auto n = static_cast<Eigen::Index>(scaling_.free.size());
        const Eigen::Index last = sums.front().gram.front().rows() - 1;
        Eigen::MatrixXd pick = Eigen::MatrixXd::Zero(last + 1, n + 1);
        for (Eigen::Index i = 0; i < n; ++i) {
            const int j = scaling_.free[static_cast<std::size_t>(i)];
            pick(j, i) = scaling_.scale[j];
        }
        pick(last, n) = 1.0;
        Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(n + 1, n + 1);
        for (Eigen::Index c = 0; c < sigma_.size(); ++c)
            gram += pick.transpose() * total_of(sums, static_cast<std::size_t>(c)) * pick / (sigma_[c] * sigma_[c]);
        const Eigen::VectorXd size = gram.diagonal().cwiseMax(std::numeric_limits<double>::min()).cwiseSqrt();
        const Eigen::MatrixXd unit = size.cwiseInverse().asDiagonal() * gram * size.cwiseInverse().asDiagonal();
        const Symmetric eigen(unit);
        return eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal() * eigen.eigenvectors().transpose() *
               size.asDiagonal();
    }

    const Regression& model_;
    const Scaling& scaling_;
    Eigen::VectorXd sigma_;
    Latest& latest_;
    const std::function<void()>& tick_;
};

void minimise(Scaling& scaling, const Regression& model, const Eigen::VectorXd& sigma, Latest& latest,
              const SolveOptions& options)
{
    // Ceres complains on stderr where its first evaluation fails.
    std::vector<double> z = scaling.scaled();
    if (z.empty() || !latest.at(model, scaling.theta)) return;
    ceres::Problem problem;
    problem.AddResidualBlock(new RootCost(model, scaling, sigma, latest, options.tick), nullptr, z.data());
    // Ceres logs what its summary says anyway; a failed search is judged here, not on stderr.
#ifndef CERCES_INTERNAL_MINIGLOG_GLOG_LOGGING_H_  // Ceres' own small log has its level from its build
    FLAGS_minloglevel = google::GLOG_FATAL;
#endif
    ceres::Solver::Options ceres_options;
    ceres_options.linear_solver_type = ceres::DENSE_QR;
    ceres_options.logging_type = ceres::SILENT;
    ceres_options.max_num_iterations = options.iterations;
    ceres_options.function_tolerance = 1e-14;
    ceres_options.gradient_tolerance = 1e-14;
    ceres_options.parameter_tolerance = options.tolerance;
    ceres_options.max_num_consecutive_invalid_steps = 20;
    ceres_options.initial_trust_region_radius = 1e6;
    ceres::Solver::Summary summary;
    ceres::Solve(ceres_options, &problem, &summary);
    if (summary.IsSolutionUsable()) scaling.theta = scaling.full(z.data());
}

/// What innovations of this noise are divided by.
Eigen::VectorXd weights(const Eigen::VectorXd& noise, bool common)
{
    if (common)
        return Eigen::VectorXd::Constant(noise.size(),
                                         std::sqrt(noise.squaredNorm() / static_cast<double>(noise.size())));
    return noise.cwiseMax(noise.maxCoeff() * kSigmaRatio);
}

/// Unbiased noise of each channel: its squares over its rows less the parameters it determines.
Eigen::VectorXd noise(const std::vector<BlockSum>& sums, const std::vector<int>& free, const Eigen::VectorXd& old,
                      double rows)
{
    const auto n = static_cast<Eigen::Index>(free.size());
    const Eigen::Index last = sums.front().gram.front().rows() - 1;
    std::vector<Eigen::MatrixXd> part;
    Eigen::MatrixXd all = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd squares(old.size()), used(old.size());
    for (Eigen::Index c = 0; c < old.size(); ++c) {
        const Eigen::MatrixXd total = total_of(sums, static_cast<std::size_t>(c));
        squares[c] = total(last, last);
        Eigen::MatrixXd m(n, n);
        for (Eigen::Index i = 0; i < n; ++i)
            for (Eigen::Index j = 0; j < n; ++j)
                m(i, j) = total(free[static_cast<std::size_t>(i)], free[static_cast<std::size_t>(j)]);
        part.push_back(m / (old[c] * old[c]));
        all += part.back();
    }
    const Eigen::VectorXd size = all.diagonal().cwiseMax(std::numeric_limits<double>::min()).cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd unit = size.asDiagonal() * all * size.asDiagonal();
    const Eigen::MatrixXd inverse = pseudo_inverse(unit);
    for (Eigen::Index c = 0; c < old.size(); ++c)
        used[c] = (inverse * (size.asDiagonal() * part[static_cast<std::size_t>(c)] * size.asDiagonal())).trace();
    Eigen::VectorXd variance(old.size());
    for (Eigen::Index c = 0; c < old.size(); ++c) variance[c] = squares[c] / std::max(rows - used[c], 0.5);
    return variance.cwiseMax(kLeastVariance).cwiseSqrt();
}

/// Brings free gains onto [0, 1], or, to try again whether one leaves a bound, a little inside.
void confine(const Regression& model, const std::vector<int>& free, double margin, Eigen::VectorXd& theta)
{
    for (int j : free)
        if (model.is_gain(j)) theta[j] = std::clamp(theta[j], margin, 1.0 - margin);
}

/// From the least squares to where the scores add up to what noise of columns adds to them.
void take_off_noise(const Regression& model, const std::vector<int>& free, const SolveOptions& options, double rows,
                    Solution& s)
{
    constexpr int kRounds = 6;
    constexpr double kMost = 0.3;  // of R and L, in a step and in all: beyond, the model bends
    const auto n = static_cast<Eigen::Index>(free.size());
    const Solution first = s;
    Solution best = s;
    for (int round = 0; round < kRounds; ++round) {
        const Eigen::MatrixXd added = options.added(best.theta, best.noise.cwiseAbs2());
        if (added.size() == 0) return;
        best.added = added * best.sigma.cwiseAbs2().cwiseInverse();
        Eigen::MatrixXd m = Eigen::MatrixXd::Zero(n, n);
        Eigen::VectorXd score(n), step = Eigen::VectorXd::Zero(best.theta.size());
        for (Eigen::Index i = 0; i < n; ++i) score[i] = -best.added[free[static_cast<std::size_t>(i)]];
        for (Eigen::Index c = 0; c < best.sigma.size(); ++c) {
            const Eigen::MatrixXd total = total_of(best.sums, static_cast<std::size_t>(c)) /
                                          (best.sigma[c] * best.sigma[c]);
            for (Eigen::Index i = 0; i < n; ++i) {
                score[i] += total(free[static_cast<std::size_t>(i)], total.cols() - 1);
                for (Eigen::Index j = 0; j < n; ++j)
                    m(i, j) += total(free[static_cast<std::size_t>(i)], free[static_cast<std::size_t>(j)]);
            }
        }
        const Eigen::VectorXd size =
            m.diagonal().cwiseMax(std::numeric_limits<double>::min()).cwiseSqrt().cwiseInverse();
        const Eigen::VectorXd by = size.asDiagonal() * (pseudo_inverse(size.asDiagonal() * m * size.asDiagonal()) *
                                                        (size.asDiagonal() * score));
        double most = 0.0;
        for (Eigen::Index i = 0; i < n; ++i) {
            const int j = free[static_cast<std::size_t>(i)];
            step[j] = -by[i];
            if (!model.is_gain(j)) most = std::max(most, std::abs(step[j]) / std::abs(best.theta[j]));
        }
        if (!step.allFinite()) return;
        best.theta += std::min(1.0, kMost / most) * step;
        confine(model, free, 0.0, best.theta);
        if (!model.sweep(best.theta, best.sums)) return;
        std::vector<int> moving;
        for (int j : free)
            if (!at_bound(model, best.theta, j)) moving.push_back(j);
        best.noise = noise(best.sums, moving, best.sigma, rows);
        best.sigma = weights(best.noise, options.common_weight);
        s = best;
        for (int j : free)
            if (j < 3 && std::abs(s.theta[j] - first.theta[j]) > kMost * std::abs(first.theta[j])) {
                // What it takes for noise is the model's error.
                s = first;
                return;
            }
        if (most < 1e-5) return;
    }
}

}  // namespace

bool at_bound(const Regression& model, const Eigen::VectorXd& theta, Eigen::Index j)
{
    return model.is_gain(j) && (theta[j] <= 0.0 || theta[j] >= 1.0);
}

Solution solve(Regression& model, const Eigen::VectorXd& start, const std::vector<bool>& free,
               const SolveOptions& options)
{
    Solution s;
    s.theta = start;
    s.free = free;
    Scaling scaling{{}, start.cwiseAbs(), start};
    for (Eigen::Index j = 0; j < start.size(); ++j) {
        if (free[static_cast<std::size_t>(j)]) scaling.free.push_back(static_cast<int>(j));
        if (!(scaling.scale[j] > 0.0)) scaling.scale[j] = 1.0;
    }
    const double rows = static_cast<double>(model.rows());
    model.prepare(start);
    Eigen::VectorXd squares;
    if (!model.squares(start, squares)) return s;
    s.sigma = weights((squares / rows).cwiseMax(kLeastVariance).cwiseSqrt(), options.common_weight);
    for (int pass = 0; pass < options.passes; ++pass) {
        confine(model, scaling.free, pass < 2 && pass + 1 < options.passes ? kAwake : 0.0, scaling.theta);
        model.prepare(scaling.theta);
        Latest latest;
        minimise(scaling, model, s.sigma, latest, options);
        confine(model, scaling.free, 0.0, scaling.theta);
        if (!latest.at(model, scaling.theta)) return s;
        s.sums = std::move(latest.sums);
        std::vector<int> moving;
        for (int j : scaling.free)
            if (!at_bound(model, scaling.theta, j)) moving.push_back(j);
        s.noise = noise(s.sums, moving, s.sigma, rows);
        const Eigen::VectorXd sigma = weights(s.noise, options.common_weight);
        const double change = (sigma.cwiseQuotient(s.sigma).array() - 1.0).abs().maxCoeff();
        s.sigma = sigma;
        if (change < options.sigma_tolerance) break;
    }
    s.theta = scaling.theta;
    s.log_likelihood = -rows * s.noise.array().log().sum();
    s.ok = true;
    if (options.added) {
        std::vector<int> moving;
        for (int j : scaling.free)
            if (!at_bound(model, s.theta, j)) moving.push_back(j);
        take_off_noise(model, moving, options, rows, s);
    }
    return s;
}

}  // namespace dqw
