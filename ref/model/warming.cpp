#include "ref/model/warming.hpp"

#include <algorithm>
#include <cmath>

#include "ref/log/symmetric.hpp"

namespace dqw {
namespace {

constexpr double kWarms = 0.05;  ///< of the friction, over a log: a deviation of what grease usually does

/// (x'x)^-1 of columns of any size; of what they do not tell the least.
Eigen::MatrixXd inverse(const Eigen::MatrixXd& m)
{
    const Eigen::VectorXd unit = m.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    return unit.asDiagonal() * pseudo_inverse(unit.asDiagonal() * m * unit.asDiagonal()) * unit.asDiagonal();
}

}  // namespace

double when_in(const Log& log, std::size_t row)
{
    const double span_s = log.t_s.back() - log.t_s.front();
    // A stretch whose clock was set back lies outside.
    return span_s > 0.0 ? std::clamp((log.t_s[row] - log.t_s.front()) / span_s - 0.5, -0.5, 0.5) : 0.0;
}

Eigen::VectorXd warming_deviations(const std::vector<TimedSum>& sums, const Eigen::VectorXd& friction, double noise2)
{
    const Eigen::Index n = friction.size();
    Eigen::MatrixXd m = Eigen::MatrixXd::Zero(n + 1, n + 1);
    Eigen::VectorXd score = Eigen::VectorXd::Zero(n + 1);
    for (const TimedSum& s : sums) {
        const auto plain = s.gram.topLeftCorner(n, n);
        const Eigen::VectorXd falls = s.when * (plain * friction), e = s.gram.col(n).head(n);
        m.topLeftCorner(n, n) += plain;
        m.col(n).head(n) += falls, m.row(n).head(n) += falls.transpose();
        m(n, n) += s.when * friction.dot(falls);
        score.head(n) += e, score[n] += s.when * friction.dot(e);
    }
    if (!(noise2 > 0.0) || !(m(n, n) > 0.0)) return Eigen::VectorXd::Zero(n);
    const Eigen::MatrixXd without = inverse(m.topLeftCorner(n, n));
    m(n, n) += noise2 / (kWarms * kWarms);
    const Eigen::MatrixXd with = inverse(m);
    const Eigen::VectorXd moved = with.topRows(n) * score - without * score.head(n);
    const Eigen::ArrayXd wider = noise2 * (with.diagonal().head(n) - without.diagonal()).array();
    return (wider.max(0.0) + moved.array().square()).sqrt();
}

}  // namespace dqw
