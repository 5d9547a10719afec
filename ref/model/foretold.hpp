// What of single rows' residual the rows before foretell: structure at the scale of a sample, which noise never is.
#ifndef DQW_REF_MODEL_FORETOLD_HPP
#define DQW_REF_MODEL_FORETOLD_HPP

#include <Eigen/Core>
#include <cstddef>

#include "ref/model/model.hpp"

namespace dqw {

/// The part from which it is no noise: of white noise of any channel the rows before foretell 0.007 at most (logs
/// of 10^4 rows and more; beside a model that is slightly wrong 0.03), of filtered currents or a late reference a tenth
/// and more.
constexpr double kFollowed = 0.05;

/// Of a row (E123): a one and both residuals' slow means, which are slow structure and count for neither; then steps of
/// the voltage before it, and residuals two rows and more before, both axes'.
constexpr Eigen::Index kSlowColumns = 3, kFastColumns = 12, kForetelling = kSlowColumns + kFastColumns;
using Foretelling = Eigen::Matrix<double, kForetelling, 1>;

/// Single rows, as they come; what foretells each.
class RowsBefore {
public:
    /// True where enough rows went before, without a gap: then `line` foretells `block`.
    bool add(const ReportBlock& block, Foretelling& line);
    /// Of an axis' voltage, to the row added last from the one before.
    double step(int axis) const { return before(1).measured[axis] - before(2).measured[axis]; }

private:
    static constexpr std::size_t kSlow = 20, kKept = 32;  ///< a block's rows; a power of two above those looked back
    const ReportBlock& before(std::size_t rows) const { return kept_[(count_ - rows) % kKept]; }
    ReportBlock kept_[kKept];
    std::size_t count_ = 0;  ///< since the last gap
    double slow_[2] = {};    ///< sums over the last kSlow
};

/// The regression of both axes' residuals on it.
class Foretold {
public:
    void add(const Foretelling& line, const ReportBlock& block);
    struct Part {
        double part[2] = {};                             ///< of the residual's square, beyond chance and slow structure
        Eigen::Matrix<double, kForetelling, 2> of_line;  ///< the fast columns' weights, others zero
        double square[2] = {};                           ///< mean, of the residual
    };
    Part solve() const;

private:
    Eigen::Matrix<double, kForetelling, kForetelling> g_ = Eigen::Matrix<double, kForetelling, kForetelling>::Zero();
    Eigen::Matrix<double, kForetelling, 2> h_ = Eigen::Matrix<double, kForetelling, 2>::Zero();
    double square_[2] = {}, lines_ = 0.0;
};

}  // namespace dqw
#endif
