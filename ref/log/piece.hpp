// Stretches of rows without a gap, over which a model may be integrated.
#ifndef DQW_REF_LOG_PIECE_HPP
#define DQW_REF_LOG_PIECE_HPP

#include <cstddef>
#include <vector>

#include "ref/log/log.hpp"

namespace dqw {

/// Rows [begin, end) of one log, evenly or unevenly sampled, without a gap. The log must outlive it.
struct Piece {
    const Log* log = nullptr;
    std::size_t begin = 0, end = 0;
    double dt_s = 0.0;  ///< the one sampling period; 0: uneven, take the difference of t_s

    std::size_t rows() const { return end - begin; }
    /// From row k to row k + 1, s. k + 1 < end.
    double period_s(std::size_t k) const { return dt_s > 0.0 ? dt_s : log->t_s[k + 1] - log->t_s[k]; }
};

/// From row k to row k + n, s.
double span_s(const Piece& piece, std::size_t k, std::size_t n);

/// Rows of a block of the reported residual: max(20 rows, 1 ms) in a dynamic log, 50 ms in a mechanical one, 1
/// otherwise.
std::size_t block_rows(const Log& log);

/// Every segment of every log that has at least `min_rows` rows. Sampling counts as even where each period is within
/// 5 % of the segment's mean (a printed time is rounded); the period is then that mean.
/// Throws std::invalid_argument where time does not increase. Cost: one pass over t_s.
std::vector<Piece> pieces_of(const std::vector<Log>& logs, std::size_t min_rows);
std::vector<Piece> pieces_of(const Log& log, std::size_t min_rows);

/// Windows of `window` rows spread evenly over `pieces`, about `rows` rows in all; `pieces` itself where that is no
/// smaller than half of it. For a first look at a long log.
std::vector<Piece> spread_sample(const std::vector<Piece>& pieces, std::size_t rows, std::size_t window);

/// The pieces' rows as logs of their own, a piece each.
std::vector<Log> copies_of(const std::vector<Piece>& pieces);

/// Rows of all pieces.
std::size_t rows_of(const std::vector<Piece>& pieces);

}  // namespace dqw
#endif
