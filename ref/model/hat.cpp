#include "ref/model/hat.hpp"

#include <algorithm>
#include <cmath>

#include "ref/log/wanted.hpp"

namespace dqw {
namespace {

/// Of the slopes' mean square: J is too small by as much.
constexpr double kNoisePart = 0.002;
constexpr double kShortest_s = 25e-3;
/// Under hats twice as long an eighth of white noise is left; where more than this is, it is motion.
constexpr double kStill = 0.5;
/// Of a normal of variance one; squares of (1 -4 6 -4 1) over those of (1 -1): 70/2.
constexpr double kMedianOfSquare = 0.4549, kBend = 35.0;

double median(std::vector<double>& x)
{
    if (x.empty()) return 0.0;
    const auto middle = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
    std::nth_element(x.begin(), middle, x.end());
    return *middle;
}

double dot(const std::vector<double>& weights, const double* x)
{
    double sum = 0.0;
    for (std::size_t r = 0; r < weights.size(); ++r) sum += weights[r] * x[r];
    return sum;
}

struct Slopes {
    double noise = 0.0, square = 0.0;  ///< (rad/s^2)^2
    double part() const { return square > 0.0 ? noise / square : 0.0; }
};

/// The slopes' mean square and what of it is noise: third differences of slopes one after the other, which what is slow
/// hardly has. 0 where there are too few to say.
Slopes slopes_of(const std::vector<Piece>& pieces, double half_s)
{
    std::vector<double> bends;
    double square = 0.0;
    std::size_t hats = 0;
    for (const Piece& piece : pieces) {
        double last[3] = {};
        std::size_t held = 0;
        each_hat(piece, piece.begin, piece.end, hat_rows(*piece.log, half_s), [&](std::size_t k, const Hat& hat) {
            const double slope = hat.slope_of(&piece.log->w_m_rad_s[k]),
                         bend = slope - 3.0 * last[0] + 3.0 * last[1] - last[2];
            square += slope * slope, ++hats;
            if (held++ >= 3) bends.push_back(bend * bend);
            last[2] = last[1], last[1] = last[0], last[0] = slope;
        });
    }
    constexpr std::size_t kFewest = 10;
    if (bends.size() < kFewest) return {};
    return {median(bends) / (kBend * kMedianOfSquare), square / static_cast<double>(hats)};
}

}  // namespace

Hat::Hat(const Piece& piece, std::size_t k, std::size_t n) : mean(2 * n + 1), slope(2 * n + 1)
{
    ask_at(k, 2 * n);
    const double up_s = span_s(piece, k, n), down_s = span_s(piece, k + n, n), whole_s = up_s + down_s;
    double high = 0.0;
    for (std::size_t r = 0; r < 2 * n; ++r) {
        const double dt = piece.period_s(k + r), side = r < n ? up_s : -down_s, low = high;
        high += dt / side;
        // Of two straight lines' product over a period.
        mean[r] += dt * (2.0 * low + high) / (3.0 * whole_s), mean[r + 1] += dt * (low + 2.0 * high) / (3.0 * whole_s);
        slope[r] -= dt / (side * whole_s), slope[r + 1] -= dt / (side * whole_s);
    }
}

double Hat::mean_of(const double* x) const { return dot(mean, x); }

double Hat::slope_of(const double* x) const { return dot(slope, x); }

std::size_t hat_rows(const Log& log, double half_s)
{
    return log.dt_s > 0.0 ? static_cast<std::size_t>(std::max(1.0, std::ceil(half_s / log.dt_s - 1e-6))) : 1;
}

double hat_half_s(const std::vector<Piece>& pieces, double most_s)
{
    double half_s = kShortest_s;
    Slopes slopes = slopes_of(pieces, half_s);
    while (slopes.part() > kNoisePart && 2.0 * half_s <= most_s) {
        const Slopes next = slopes_of(pieces, 2.0 * half_s);
        if (next.noise > kStill * slopes.noise) break;
        half_s *= 2.0, slopes = next;
    }
    return half_s;
}

}  // namespace dqw
