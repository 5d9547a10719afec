#include "ref/model/foretold.hpp"

#include "ref/log/symmetric.hpp"

namespace dqw {

bool RowsBefore::add(const ReportBlock& block, Foretelling& line)
{
    if (count_ > 0 && (before(1).log != block.log || before(1).end != block.begin)) count_ = 0;
    if (count_ == 0) slow_[0] = slow_[1] = 0.0;
    constexpr std::size_t kReach = kSlow + 4;
    const bool enough = count_ >= kReach;
    if (enough) {
        line(0) = 1.0;
        Eigen::Index n = kSlowColumns;
        for (int c : {0, 1}) {
            const double slow = slow_[c] / static_cast<double>(kSlow);
            line(1 + c) = slow;
            for (std::size_t lag : {1, 2, 3}) line(n++) = before(lag).measured[c] - before(lag + 1).measured[c];
            for (std::size_t lag : {2, 3, 4}) line(n++) = before(lag).residual[c] - slow;
        }
    }
    for (int c : {0, 1}) slow_[c] += block.residual[c] - (count_ >= kSlow ? before(kSlow).residual[c] : 0.0);
    kept_[count_++ % kKept] = block;
    return enough;
}

void Foretold::add(const Foretelling& line, const ReportBlock& block)
{
    g_ += line * line.transpose(), lines_ += 1.0;
    for (int c : {0, 1}) {
        h_.col(c) += line * block.residual[c];
        square_[c] += block.residual[c] * block.residual[c];
    }
}

Foretold::Part Foretold::solve() const
{
    Part out;
    out.of_line.setZero();
    constexpr double kLeastLines = 10.0 * kForetelling;
    if (lines_ < kLeastLines) return out;
    // A column that never moves, as a voltage without steps, stays out.
    const Foretelling size = g_.diagonal().cwiseSqrt().cwiseMax(1e-300);
    const Eigen::MatrixXd unit = size.cwiseInverse().asDiagonal() * g_ * size.cwiseInverse().asDiagonal();
    const Eigen::MatrixXd to = size.cwiseInverse().asDiagonal() * h_;
    const Eigen::MatrixXd all = pseudo_inverse(unit) * to,
                          slow = pseudo_inverse(unit.topLeftCorner(kSlowColumns, kSlowColumns)) *
                                 to.topRows(kSlowColumns);
    for (int c : {0, 1}) {
        out.square[c] = square_[c] / lines_;
        const double without = square_[c] - to.col(c).head(kSlowColumns).dot(slow.col(c)),
                     with = square_[c] - to.col(c).dot(all.col(c));
        if (!(without > 0.0)) continue;
        out.part[c] = 1.0 - with / without - static_cast<double>(kFastColumns) / lines_;
        out.of_line.col(c).tail(kFastColumns) = all.col(c).tail(kFastColumns).cwiseQuotient(size.tail(kFastColumns));
    }
    return out;
}

}  // namespace dqw
