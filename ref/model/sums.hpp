// The inner loop of a sweep: rows into blocks.
#ifndef DQW_REF_MODEL_SUMS_HPP
#define DQW_REF_MODEL_SUMS_HPP

#include <ceres/jet.h>

#include <array>
#include <cstddef>

#include "ref/model/model.hpp"

namespace dqw {

/// Collects innovations given as ceres::Jet<double, N> into the blocks of a Sums of n >= N parameters.
template <int N, int C> class Collector {
public:
    Collector(Sums& sums, std::size_t rows) : sums_(sums), rows_(rows) { clear(); }

    /// One row: an innovation and a weight (square root of a ratio of variances) for each channel.
    void add(const std::array<ceres::Jet<double, N>, C>& e, const std::array<double, C>& weight)
    {
        for (int c = 0; c < C; ++c) {
            const auto s = static_cast<std::size_t>(c);
            Row row;
            row.template head<N>() = e[s].v;
            row[N] = e[s].a;
            row *= weight[s];
            part_[s].noalias() += row * row.transpose();
        }
        if (++count_ >= next_) flush();
    }

    /// To be called once, after the last row.
    void finish()
    {
        if (block_ < sums_.blocks) flush();
    }

private:
    using Row = Eigen::Matrix<double, N + 1, 1>;
    using Part = Eigen::Matrix<double, N + 1, N + 1>;

    void clear()
    {
        for (auto& p : part_) p.setZero();
        next_ = block_ + 1 < sums_.blocks
                    ? (static_cast<std::size_t>(block_) + 1) * rows_ / static_cast<std::size_t>(sums_.blocks)
                    : static_cast<std::size_t>(-1);
    }
    void flush()
    {
        for (int c = 0; c < C; ++c) {
            Eigen::MatrixXd& to = sums_.at(block_, c);
            const Part& from = part_[static_cast<std::size_t>(c)];
            const Eigen::Index n = to.rows() - 1;
            to.topLeftCorner(N, N) += from.template topLeftCorner<N, N>();
            to.block(n, 0, 1, N) += from.template bottomLeftCorner<1, N>();
            to.block(0, n, N, 1) += from.template topRightCorner<N, 1>();
            to(n, n) += from(N, N);
        }
        ++block_;
        clear();
    }

    Sums& sums_;
    std::size_t rows_;
    std::size_t count_ = 0, next_ = 0;
    int block_ = 0;
    std::array<Part, C> part_;
};

}  // namespace dqw
#endif
