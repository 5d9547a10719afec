// Rows of one piece into the sums of its blocks.
#ifndef DQW_REF_MODEL_GATHER_HPP
#define DQW_REF_MODEL_GATHER_HPP

#include <utility>

#include "ref/model/plan.hpp"

namespace dqw {

/// Columns of a sweep's candidates: the first of each group, and where the last one ends.
using Groups = std::vector<Eigen::Index>;

/// Adds up lines [J e] of a piece's rows, in their order, some at a time: a product of matrices costs less than as many
/// of vectors. Fills the lower triangles; with groups not where two of these meet.
class Gather {
public:
    Gather(const Plan& plan, const Span& span, int channels, std::vector<BlockSum>& sums, Fold fold = Fold::none,
           Groups groups = {})
        : blocks_(plan.blocks), sums_(sums), fold_(fold), groups_(std::move(groups)),
          columns_(sums.empty() ? 0 : sums.front().gram.front().rows() - 1), block_(span.first_block),
          end_(span.end_block)
    {
        lines_.assign(static_cast<std::size_t>(channels), Eigen::MatrixXd(columns_ + 1, kChunk));
    }

    /// Whether the row is in a block. If so, all channels' lines are to be filled, and next() called.
    bool counts(std::size_t row)
    {
        while (block_ < end_ && row >= blocks_[block_].end) flush(), ++block_;
        return block_ < end_ && row >= blocks_[block_].begin;
    }
    double* line(std::size_t channel) { return lines_[channel].col(gathered_).data(); }
    void next()
    {
        if (++gathered_ == kChunk) flush();
    }
    /// To be called once, after the last row.
    void flush()
    {
        if (gathered_ == 0) return;
        BlockSum& sum = sums_[fold_ == Fold::none ? block_ : blocks_[block_].heldout ? 1 : 0];
        sum.rows += static_cast<double>(gathered_);
        for (std::size_t c = 0; c < lines_.size(); ++c)
            if (columns_ == 0)
                sum.gram[c](0, 0) += lines_[c].leftCols(gathered_).squaredNorm();
            else if (groups_.size() > 2)
                add_groups(lines_[c].leftCols(gathered_), sum.gram[c]);
            else
                sum.gram[c].selfadjointView<Eigen::Lower>().rankUpdate(lines_[c].leftCols(gathered_));
        gathered_ = 0;
    }

private:
    void add_groups(const Eigen::Ref<const Eigen::MatrixXd>& lines, Eigen::MatrixXd& gram) const
    {
        const Eigen::Index first = groups_.front(), others = columns_ - first;
        gram.leftCols(first).noalias() += lines * lines.topRows(first).transpose();
        gram.bottomRows(1).rightCols(others + 1).noalias() += lines.bottomRows(1) *
                                                              lines.bottomRows(others + 1).transpose();
        for (std::size_t n = 1; n < groups_.size(); ++n) {
            const Eigen::Index at = groups_[n - 1], size = groups_[n] - at;
            gram.block(at, at, size, size).noalias() += lines.middleRows(at, size).lazyProduct(
                lines.middleRows(at, size).transpose());
        }
    }

    static constexpr Eigen::Index kChunk = 128;  ///< lines: with tens of columns they stay in the nearest cache
    const std::vector<FineBlock>& blocks_;
    std::vector<BlockSum>& sums_;
    const Fold fold_;
    const Groups groups_;
    Eigen::Index columns_, gathered_ = 0;
    std::size_t block_, end_;
    std::vector<Eigen::MatrixXd> lines_;
};

}  // namespace dqw
#endif
