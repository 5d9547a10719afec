#include "ref/fit/assess.hpp"

#include <algorithm>
#include <cmath>

#include "ref/log/symmetric.hpp"

namespace dqw {

using namespace assessing;

namespace {

constexpr double kSignificant = 3.5;  ///< standard deviations of a block variance

Eigen::MatrixXd picked(const Eigen::MatrixXd& m, const std::vector<int>& index)
{
    const auto n = static_cast<Eigen::Index>(index.size());
    Eigen::MatrixXd out(n, n);
    for (Eigen::Index i = 0; i < n; ++i)
        for (Eigen::Index j = 0; j < n; ++j)
            out(i, j) = m(index[static_cast<std::size_t>(i)], index[static_cast<std::size_t>(j)]);
    return out;
}

/// Effect of theta[j] on what is predicted, over the signal, RMS.
double effect(const Solution& s, const Eigen::VectorXd& power, double size, int j)
{
    double sum = 0.0;
    const double all = power.sum();
    for (Eigen::Index c = 0; c < power.size(); ++c) sum += total_of(s.sums, static_cast<std::size_t>(c))(j, j);
    return all > 0.0 ? size * std::sqrt(sum / all) : 0.0;
}

/// Scatter of the blocks' weighted scores J'e, with the small-sample factor of b blocks.
Eigen::MatrixXd scores(const Solution& s, const std::vector<int>& index)
{
    const auto n = static_cast<Eigen::Index>(index.size());
    Eigen::MatrixXd meat = Eigen::MatrixXd::Zero(n, n);
    double rows = 0.0;
    for (const BlockSum& sum : s.sums) rows += sum.rows;
    for (const BlockSum& sum : s.sums) {
        Eigen::VectorXd score = Eigen::VectorXd::Zero(n);
        for (Eigen::Index c = 0; c < s.sigma.size(); ++c) {
            const Eigen::MatrixXd& m = sum.gram[static_cast<std::size_t>(c)];
            for (Eigen::Index i = 0; i < n; ++i)
                score[i] += m(index[static_cast<std::size_t>(i)], m.cols() - 1) / (s.sigma[c] * s.sigma[c]);
        }
        for (Eigen::Index i = 0; i < n && s.added.size() > 0; ++i)
            score[i] -= s.added[index[static_cast<std::size_t>(i)]] * sum.rows / rows;
        meat += score * score.transpose();
    }
    const auto blocks = static_cast<double>(s.sums.size());
    return meat * blocks / std::max(blocks - static_cast<double>(n), 1.0);
}

}  // namespace

Covariance assess(const Solution& s, const Regression& model, const Eigen::VectorXd& typical)
{
    const auto size = s.theta.size();
    Covariance out;
    out.of = Eigen::MatrixXd::Zero(size, size);
    out.each.resize(static_cast<std::size_t>(size));
    const Eigen::VectorXd power = model.power();
    std::vector<int> index;
    for (int j = 0; j < size; ++j) {
        Assessment& a = out.each[static_cast<std::size_t>(j)];
        a.value = s.theta[j];
        if (!s.free[static_cast<std::size_t>(j)] || at_bound(model, s.theta, j)) continue;
        if (!model.is_gain(j) && effect(s, power, std::max(std::abs(a.value), typical[j]), j) < kNoEffect)
            a.verdict = Verdict::no_effect;
        else
            index.push_back(j);
    }
    if (index.empty()) return out;

    Eigen::MatrixXd information = Eigen::MatrixXd::Zero(size, size), spread = information;
    for (Eigen::Index c = 0; c < s.sigma.size(); ++c) {
        const Eigen::MatrixXd part = total_of(s.sums, static_cast<std::size_t>(c)).topLeftCorner(size, size) /
                                     (s.sigma[c] * s.sigma[c]);
        information += part;
        spread += part * std::pow(s.noise[c] / s.sigma[c], 2);
    }
    const Eigen::MatrixXd m = picked(information, index);
    const Eigen::VectorXd scale = m.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const Symmetric eigen(scale.asDiagonal() * m * scale.asDiagonal());
    const auto n = static_cast<Eigen::Index>(index.size());
    Eigen::MatrixXd inverse = Eigen::MatrixXd::Zero(n, n);
    for (Eigen::Index k = 0; k < n; ++k) {
        const Eigen::VectorXd v = eigen.eigenvectors().col(k);
        if (eigen.eigenvalues()[k] > kCollinear) {
            inverse += v * v.transpose() / eigen.eigenvalues()[k];
            continue;
        }
        for (Eigen::Index i = 0; i < n; ++i) {
            if (std::abs(v[i]) < kPartner) continue;
            Assessment& a = out.each[static_cast<std::size_t>(index[static_cast<std::size_t>(i)])];
            a.verdict = Verdict::collinear;
            for (Eigen::Index j = 0; j < n; ++j)
                if (j != i && std::abs(v[j]) >= kPartner) a.partners.push_back(index[static_cast<std::size_t>(j)]);
        }
    }
    inverse = scale.asDiagonal() * inverse * scale.asDiagonal();
    const Eigen::MatrixXd white = inverse * picked(spread, index) * inverse;
    const Eigen::MatrixXd sandwich = inverse * scores(s, index) * inverse;
    const double limit = 1.0 + kSignificant * std::sqrt(2.0 / static_cast<double>(s.sums.size()));
    double worst = 1.0;
    for (Eigen::Index i = 0; i < n; ++i)
        if (white(i, i) > 0.0 && !model.is_gain(index[static_cast<std::size_t>(i)]))
            worst = std::max(worst, sandwich(i, i) / white(i, i));
    out.robust = worst > limit;
    if (out.robust) out.inflation = std::sqrt(worst);
    const Eigen::MatrixXd& cov = out.robust ? sandwich : white;
    for (Eigen::Index i = 0; i < n; ++i) {
        const int row = index[static_cast<std::size_t>(i)];
        for (Eigen::Index j = 0; j < n; ++j) out.of(row, index[static_cast<std::size_t>(j)]) = cov(i, j);
        Assessment& a = out.each[static_cast<std::size_t>(row)];
        a.sd = std::sqrt(std::max(cov(i, i), out.robust ? white(i, i) : 0.0));
        if (a.verdict == Verdict::determined && a.sd > kUncertain * std::max(std::abs(a.value), 0.1 * typical[row]))
            a.verdict = Verdict::uncertain;
    }
    return out;
}

Covariance assess_excited(const Solution& solution, Regression& model, const Eigen::VectorXd& typical)
{
    Solution simulated = solution;
    for (std::size_t j = 0; j < solution.free.size(); ++j)
        if (model.is_gain(static_cast<Eigen::Index>(j))) {
            simulated.theta[static_cast<Eigen::Index>(j)] = 0.0;
            simulated.free[j] = false;
        }
    model.count_starts(false);
    model.prepare(simulated.theta);
    const bool done = model.sweep(simulated.theta, simulated.sums);
    model.count_starts(true);
    model.prepare(solution.theta);
    Covariance covariance = assess(solution, model, typical);
    if (!done) return covariance;
    const Covariance signal = assess(simulated, model, typical);
    for (std::size_t j = 0; j < covariance.each.size(); ++j)
        if (covariance.each[j].verdict == Verdict::determined && signal.each[j].verdict != Verdict::determined)
            covariance.each[j] = signal.each[j];
    return covariance;
}

}  // namespace dqw
