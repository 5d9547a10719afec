// Rows as a dynamic model reads them: the log's, or with noise on them that is drawn as they are read.
#ifndef DQW_REF_MODEL_ROWS_HPP
#define DQW_REF_MODEL_ROWS_HPP

#include <array>
#include <cstddef>
#include <random>
#include <vector>

#include "ref/log/piece.hpp"

namespace dqw {

struct Row {
    double v_d_V, v_q_V, i_d_A, i_q_A, w_m_rad_s;
};

inline Row row_of(const Log& log, std::size_t k)
{
    return {log.v_d_V[k], log.v_q_V[k], log.i_d_A[k], log.i_q_A[k], log.w_m_rad_s[k]};
}

/// A draw for each value of the logs, always the same: log by log and column by column, in Row's order, of one
/// generator. Kept is where it stands at every 65536th row, for all columns must be read at once.
class Draws {
public:
    static constexpr std::size_t kColumns = 5, kApart = 65536;
    struct Stream {
        std::mt19937_64 bits{1};
        std::normal_distribution<double> normal;
        double next() { return normal(bits); }
    };

    /// The draws of rows [begin, end) themselves.
    struct Kept {
        const Log* log;
        std::size_t begin, end;
        std::array<std::vector<double>, kColumns> of;
        bool has(const Log& l, std::size_t k) const { return &l == log && k >= begin && k < end; }
    };

    /// Refers to the logs. `kept`: pieces of few rows in all that will be read often. Cost: all draws, once.
    explicit Draws(const std::vector<Log>& logs, const std::vector<Piece>& kept = {});
    const std::vector<Kept>& kept() const { return kept_; }
    /// Before row n * kApart.
    const Stream& mark(const Log& log, std::size_t column, std::size_t n) const;

private:
    const std::vector<Log>& logs_;
    std::vector<std::array<std::vector<Stream>, kColumns>> marks_;
    std::vector<Kept> kept_;
};

/// Draws times a size for each column.
struct RowNoise {
    const Draws* draws;
    std::array<double, Draws::kColumns> size;
};

/// Reads rows forwards; one before the last one read, or of another log, costs up to Draws::kApart draws.
class RowReader {
public:
    /// Without noise the log's own rows. It must outlive the reader.
    explicit RowReader(const RowNoise* noise) : noise_(noise), places_(noise != nullptr ? Draws::kColumns : 0) {}
    Row at(const Log& log, std::size_t k);
    double speed_at(const Log& log, std::size_t k);

private:
    struct Place {
        const Log* log = nullptr;
        std::size_t row = 0;
        Draws::Stream stream;
    };
    double noise_at(std::size_t column, const Log& log, std::size_t k);
    /// The kept rows that row k is one of, or null.
    const Draws::Kept* kept_at(const Log& log, std::size_t k);

    const RowNoise* noise_;
    const Draws::Kept* kept_ = nullptr;  ///< those last read
    std::vector<Place> places_;
};

}  // namespace dqw
#endif
