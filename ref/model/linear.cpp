#include "ref/model/linear.hpp"

#include "ref/model/plan.hpp"

namespace dqw {

LinearModel::LinearModel(std::vector<std::string> names, int channels, Source source)
    : names_(std::move(names)), channels_(channels), source_(std::move(source)),
      power_(Eigen::VectorXd::Zero(channels)), offset_(Eigen::VectorXd::Zero(channels))
{
    source_([this](const Row& row) {
        ++rows_;
        for (int c = 0; c < channels_; ++c)
            power_[c] += row.y[static_cast<std::size_t>(c)] * row.y[static_cast<std::size_t>(c)];
    });
}

void LinearModel::prepare(const Eigen::VectorXd& theta)
{
    for (int c = 0; c < channels_; ++c) {
        const Eigen::Map<const Eigen::VectorXd> variance(noise_[static_cast<std::size_t>(c)].data(), theta.size());
        offset_[c] = static_cast<double>(rows_) * theta.dot(variance.cwiseProduct(theta));
    }
}

bool LinearModel::sweep(const Eigen::VectorXd& theta, std::vector<BlockSum>& sums) const
{
    const Eigen::Index n = theta.size();
    sums = empty_sums(static_cast<std::size_t>(block_count(rows_)), channels_, n);
    Eigen::VectorXd line(n + 1);
    std::size_t k = 0;
    source_([&](const Row& row) {
        BlockSum& to = sums[block_of(k++, rows_)];
        to.rows += 1.0;
        for (std::size_t c = 0; c < to.gram.size(); ++c) {
            const Eigen::Map<const Eigen::VectorXd> x(row.x[c].data(), n);
            line << -x, row.y[c] - x.dot(theta);
            to.gram[c].noalias() += line * line.transpose();
        }
    });
    Eigen::MatrixXd map(n, n + 1);
    map << Eigen::MatrixXd::Identity(n, n), theta;
    const double blocks = static_cast<double>(sums.size());
    for (BlockSum& to : sums)
        for (std::size_t c = 0; c < to.gram.size(); ++c) {
            // Noise dx with variances V turns the row [-x, e] by [-dx, -dx'theta].
            const Eigen::Map<const Eigen::VectorXd> variance(noise_[c].data(), n);
            to.gram[c] -= static_cast<double>(rows_) / blocks * (map.transpose() * variance.asDiagonal() * map);
            // Back again, as a constant: a square root needs a sum above zero.
            to.gram[c](n, n) += offset_[static_cast<Eigen::Index>(c)] / blocks;
        }
    return true;
}

bool LinearModel::squares(const Eigen::VectorXd& theta, Eigen::VectorXd& sum) const
{
    sum.setZero(channels_);
    source_([&](const Row& row) {
        for (int c = 0; c < channels_; ++c) {
            double e = row.y[static_cast<std::size_t>(c)];
            for (Eigen::Index j = 0; j < theta.size(); ++j)
                e -= row.x[static_cast<std::size_t>(c)][static_cast<std::size_t>(j)] * theta[j];
            sum[c] += e * e;
        }
    });
    for (int c = 0; c < channels_; ++c) {
        const Eigen::Map<const Eigen::VectorXd> variance(noise_[static_cast<std::size_t>(c)].data(), theta.size());
        sum[c] += offset_[c] - static_cast<double>(rows_) * theta.dot(variance.cwiseProduct(theta));
    }
    return sum.allFinite() && sum.minCoeff() >= 0.0;
}

}  // namespace dqw
