#include "ref/trace/quarters.hpp"

#include <array>
#include <cmath>

namespace dqw {
namespace {

constexpr int kParts = 4;
/// Of a deviation from three degrees of freedom, which one of 20 exceeds by chance.
constexpr double kClearly = 1.6;

/// The linear step to the least squares of these sums, in unit columns; of columns that they do not tell the shortest.
Eigen::VectorXd step_of(const Eigen::MatrixXd& gram)
{
    const Eigen::Index n = gram.rows() - 1;
    const Eigen::VectorXd unit = gram.diagonal().head(n).cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd m = unit.asDiagonal() * gram.topLeftCorner(n, n) * unit.asDiagonal();
    const Eigen::VectorXd z = m.completeOrthogonalDecomposition().solve(unit.cwiseProduct(gram.col(n).head(n)));
    return -unit.cwiseProduct(z);
}

}  // namespace

Eigen::VectorXd beside_quarters(const Model& model, const Refined& refined, Eigen::VectorXd sd)
{
    const auto& blocks = model.plan().blocks;
    double rows = 0.0, passed = 0.0;
    for (std::size_t b = 0; b < blocks.size(); ++b)
        if (!blocks[b].heldout) rows += refined.sums[b].rows;
    const Eigen::Index n = refined.sums.front().gram[0].rows() - 1;
    if (n != sd.size() || !(rows > 0.0)) return sd;
    std::array<Eigen::MatrixXd, kParts> part;
    part.fill(Eigen::MatrixXd::Zero(n + 1, n + 1));
    for (std::size_t b = 0; b < blocks.size(); ++b) {
        if (blocks[b].heldout) continue;
        const double middle = passed + 0.5 * refined.sums[b].rows;
        part[static_cast<std::size_t>(kParts * middle / rows)] += refined.sums[b].gram[0];
        passed += refined.sums[b].rows;
    }
    Eigen::MatrixXd total = Eigen::MatrixXd::Zero(n + 1, n + 1), step(n, kParts);
    for (const Eigen::MatrixXd& p : part) total += p;
    for (int p = 0; p < kParts; ++p) step.col(p) = step_of(total - part[static_cast<std::size_t>(p)]);
    step.colwise() -= step.rowwise().mean().eval();
    const Eigen::VectorXd quarters = (step.rowwise().squaredNorm() * (kParts - 1.0) / kParts).cwiseSqrt();
    for (Eigen::Index j = 0; j < n; ++j)
        if (quarters[j] > kClearly * sd[j]) sd[j] = quarters[j];
    return sd;
}

}  // namespace dqw
