// Rows of one piece into the sums of its blocks.
#ifndef DQW_REF_MODEL_GATHER_HPP
#define DQW_REF_MODEL_GATHER_HPP

#include "ref/model/plan.hpp"

namespace dqw {

/// Adds up lines [J e] of a piece's rows, in their order, some at a time: a product of matrices costs less than as many
/// of vectors. Fills the lower triangles.
class Gather {
public:
    Gather(const Plan& plan, const Span& span, int channels, std::vector<BlockSum>& sums)
        : blocks_(plan.blocks), sums_(sums), columns_(sums.empty() ? 0 : sums.front().gram.front().rows() - 1),
          block_(span.first_block), end_(span.end_block)
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
        BlockSum& sum = sums_[block_];
        sum.rows += static_cast<double>(gathered_);
        for (std::size_t c = 0; c < lines_.size(); ++c)
            if (columns_ == 0)
                sum.gram[c](0, 0) += lines_[c].leftCols(gathered_).squaredNorm();
            else
                sum.gram[c].selfadjointView<Eigen::Lower>().rankUpdate(lines_[c].leftCols(gathered_));
        gathered_ = 0;
    }

private:
    static constexpr Eigen::Index kChunk = 128;  ///< lines: with tens of columns they stay in the nearest cache
    const std::vector<FineBlock>& blocks_;
    std::vector<BlockSum>& sums_;
    Eigen::Index columns_, gathered_ = 0;
    std::size_t block_, end_;
    std::vector<Eigen::MatrixXd> lines_;
};

}  // namespace dqw
#endif
