// Which rows are judged, and together with which.
#ifndef DQW_REF_MODEL_PLAN_HPP
#define DQW_REF_MODEL_PLAN_HPP

#include "ref/model/model.hpp"

namespace dqw {

/// So many stretches in turn over the pieces' rows, seen and held out, with `fine` fine blocks in each; the first
/// `guard` rows of a stretch count in neither.
Plan alternate_plan(std::vector<Piece> pieces, std::size_t stretches, std::size_t fine, std::size_t guard);

/// Blocks whose scores show whether `rows` rows are white, and the one that a row is in.
int block_count(std::size_t rows);
std::size_t block_of(std::size_t row, std::size_t rows);
/// All rows but the `first` of each piece, cut where those blocks end.
Plan even_plan(std::vector<Piece> pieces, std::size_t first);

}  // namespace dqw
#endif
