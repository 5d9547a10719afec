// Means of a mechanical log over hats: slopes of the speed that its noise hardly stands in. (E190)
#ifndef DQW_REF_MODEL_HAT_HPP
#define DQW_REF_MODEL_HAT_HPP

#include <vector>

#include "ref/log/piece.hpp"

namespace dqw {

/// What rows k .. k + 2n of a column that runs straight from row to row weigh in its mean under a hat that rises over n
/// rows and falls over n, and in the mean of its slope: the difference of the means of both halves.
struct Hat {
    std::vector<double> mean, slope;

    /// k + 2n < piece.end
    Hat(const Piece& piece, std::size_t k, std::size_t n);
    /// Of a column from row k on.
    double mean_of(const double* x) const;
    double slope_of(const double* x) const;
    double slope_square() const;  ///< the slope's variance over that of a row's white noise
};

/// Rows of half a hat that lasts `half_s`.
std::size_t hat_rows(const Log& log, double half_s);

/// The hats of n rows to a side in rows [begin, end) of a piece, each from half of the last one on: visit(k, hat).
template <class Visit>
void each_hat(const Piece& piece, std::size_t begin, std::size_t end, std::size_t n, const Visit& visit)
{
    if (begin + 2 * n >= end) return;
    Hat hat(piece, begin, n);
    for (std::size_t k = begin; k + 2 * n < end; k += n) {
        if (!(piece.dt_s > 0.0) && k > begin) hat = Hat(piece, k, n);
        visit(k, hat);
    }
}

struct HatChoice {
    double half_s = 0.0;
    double noise_part = 0.0;  ///< of the slopes' mean square: J is too small by as much
};

/// The shortest half of a hat, of 25 ms and its doubles up to `most_s`, under which the speed's noise makes next to
/// nothing of the slopes; shorter where what longer ones lose is motion, or too few of them would be left to say.
HatChoice choose_hat(const std::vector<Piece>& pieces, double most_s);

}  // namespace dqw
#endif
