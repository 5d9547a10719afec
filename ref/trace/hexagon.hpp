// Rows whose voltage no inverter on their link can make: overmodulation. They are held out, (E115).
#ifndef DQW_REF_TRACE_HEXAGON_HPP
#define DQW_REF_TRACE_HEXAGON_HPP

#include "ref/effect/columns.hpp"
#include "ref/log/piece.hpp"

namespace dqw {

/// Rows of a log with a link voltage that lie beyond its hexagon, 1 each; empty where the log has no link or no angle.
std::vector<char> beyond_hexagon(const Log& log, const TraceColumns& columns, double pole_pairs);

/// Pieces without the marked rows, of `least` rows each; `marks`: of each log, or empty.
std::vector<Piece> without_marked(const std::vector<Piece>& pieces, const std::vector<Log>& logs,
                                  const std::vector<std::vector<char>>& marks, std::size_t least);

}  // namespace dqw
#endif
