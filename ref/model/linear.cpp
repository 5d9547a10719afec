#include "ref/model/linear.hpp"

#include "ref/model/sums.hpp"

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

bool LinearModel::sweep(const Eigen::VectorXd& theta, int blocks, Sums& sums) const
{
    using Jet = ceres::Jet<double, kMost>;
    const Eigen::Index n = theta.size();
    // The collector writes kMost columns; those past n stay zero and are cut off at the end.
    Sums wide;
    wide.reset(kMost, channels_, blocks);
    std::array<Jet, 2> e;
    Collector<kMost, 2> two(wide, rows_);
    Collector<kMost, 1> one(wide, rows_);
    source_([&](const Row& row) {
        for (std::size_t c = 0; c < static_cast<std::size_t>(channels_); ++c) {
            e[c] = Jet(row.y[c]);
            for (Eigen::Index j = 0; j < n; ++j) {
                const double x = row.x[c][static_cast<std::size_t>(j)];
                e[c].a -= x * theta[j];
                e[c].v[j] = -x;
            }
        }
        if (channels_ == 2)
            two.add(e, {1.0, 1.0});
        else
            one.add({e[0]}, {1.0});
    });
    if (channels_ == 2)
        two.finish();
    else
        one.finish();
    sums.reset(static_cast<int>(n), channels_, blocks);
    for (int b = 0; b < blocks; ++b)
        for (int c = 0; c < channels_; ++c) {
            const Eigen::MatrixXd& from = wide.at(b, c);
            Eigen::MatrixXd& to = sums.at(b, c);
            to.topLeftCorner(n, n) = from.topLeftCorner(n, n);
            to.col(n).head(n) = from.col(kMost).head(n);
            to.row(n).head(n) = from.row(kMost).head(n);
            to(n, n) = from(kMost, kMost);
            // Noise dx with variances V turns the row [-x, e] by [-dx, -dx'theta].
            Eigen::MatrixXd map(n, n + 1);
            map << Eigen::MatrixXd::Identity(n, n), theta;
            const Eigen::Map<const Eigen::VectorXd> variance(noise_[static_cast<std::size_t>(c)].data(), n);
            to -= static_cast<double>(rows_) / blocks * (map.transpose() * variance.asDiagonal() * map);
            // Back again, as a constant: a square root needs a sum above zero.
            to(n, n) += offset_[c] / blocks;
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
