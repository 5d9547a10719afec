// Which rows are held out.
#ifndef DQW_REF_SEARCH_PLAN_HPP
#define DQW_REF_SEARCH_PLAN_HPP

#include "ref/search/model.hpp"

namespace dqw {

/// Twenty stretches in turn over the pieces' rows, seen and held out, with `fine` fine blocks in each. Pieces are
/// copied in.
Plan alternate_plan(std::vector<Piece> pieces, std::size_t stretches, std::size_t fine, std::size_t guard);

}  // namespace dqw
#endif
