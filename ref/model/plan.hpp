// Which rows are judged, and together with which.
#ifndef DQW_REF_MODEL_PLAN_HPP
#define DQW_REF_MODEL_PLAN_HPP

#include "ref/model/model.hpp"

namespace dqw {

/// So many stretches in turn over the pieces' rows, seen and held out, with `fine` fine blocks in each; the first
/// `guard` rows of a stretch count in neither.
Plan alternate_plan(std::vector<Piece> pieces, std::size_t stretches, std::size_t fine, std::size_t guard);

/// Whether each block of a plan has its sum, or all that are seen have one, and all that are held out another.
enum class Fold { none, kinds };
/// What the latter are the sums of: a plan of two blocks.
Plan folded_plan();
/// The same sums, of each block's.
std::vector<BlockSum> folded(const Plan& plan, const std::vector<BlockSum>& sums);

/// Rows of a piece that a prediction runs through, and the blocks that are judged on its way.
struct Span {
    const Piece* piece = nullptr;
    std::size_t begin = 0, end = 0;              ///< rows of the log
    std::size_t first_block = 0, end_block = 0;  ///< of the plan
};

/// Each piece as a whole.
std::vector<Span> spans_of(const Plan& plan);
/// The stretches that are held out, or those that are not, each from `lead` rows before its first block, or from its
/// piece's start; those that then meet are one, with what is between them.
std::vector<Span> spans_of(const Plan& plan, bool heldout, std::size_t lead);

/// Blocks whose scores show whether `rows` rows are white, and the one that a row is in.
int block_count(std::size_t rows);
std::size_t block_of(std::size_t row, std::size_t rows);
/// All rows but the `first` of each piece, cut where those blocks end.
Plan even_plan(std::vector<Piece> pieces, std::size_t first);

}  // namespace dqw
#endif
