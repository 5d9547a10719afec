#include "ref/model/hat.hpp"

#include <algorithm>
#include <cmath>

#include "ref/log/median.hpp"
#include "ref/log/wanted.hpp"

namespace dqw {
namespace {

/// Of the slopes' mean square: J is too small by as much.
constexpr double kNoisePart = 0.002;
constexpr double kShortest_s = 25e-3;
/// Under hats twice as long: twice of what white noise leaves, an eighth of itself in hats of many rows; and most of
/// what is slow.
constexpr double kNoiseLeft = 2.0, kMotionLeft = 0.8;
constexpr double kMostlyNoise = 0.1;  ///< of slopes: beside more, what is motion hangs on the noise's own scatter
constexpr std::size_t kFewest = 10;   ///< bends, of which a median is known to a half
/// Of a normal of variance one; squares of (1 -4 6 -4 1).
constexpr double kMedianOfSquare = 0.4549, kRowBend = 70.0;

double dot(const std::vector<double>& weights, const double* x)
{
    double sum = 0.0;
    for (std::size_t r = 0; r < weights.size(); ++r) sum += weights[r] * x[r];
    return sum;
}

/// What third differences of slopes n rows apart make of white noise, over what the slopes do: 35 of long hats, which
/// share no more than an end.
double bend_of_white(const Hat& hat, std::size_t n)
{
    constexpr double kThird[] = {1.0, -3.0, 3.0, -1.0};
    std::vector<double> weights(hat.slope.size() + 3 * n, 0.0);
    for (std::size_t d = 0; d < 4; ++d)
        for (std::size_t r = 0; r < hat.slope.size(); ++r) weights[r + d * n] += kThird[d] * hat.slope[r];
    return dot(weights, weights.data()) / hat.slope_square();
}

/// Variance of a row's noise if it is white, (rad/s)^2.
double row_noise_of(const std::vector<Piece>& pieces)
{
    std::vector<double> rows;
    for (const Piece& piece : pieces) {
        const double* w = piece.log->w_m_rad_s.data();
        for (std::size_t k = piece.begin; k + 4 < piece.end; ++k) {
            const double bend = w[k] - 4.0 * w[k + 1] + 6.0 * w[k + 2] - 4.0 * w[k + 3] + w[k + 4];
            rows.push_back(bend * bend);
        }
    }
    return median(rows) / (kRowBend * kMedianOfSquare);
}

struct Slopes {
    double noise = 0.0, square = 0.0;  ///< (rad/s^2)^2
    std::size_t bends = 0;
    double of_row = 0.0;  ///< variance of a slope over that of a row's white noise, 1/s^2
    double part() const { return square > 0.0 ? std::min(noise / square, 1.0) : 0.0; }
    double motion() const { return square * (1.0 - part()); }
};

/// The slopes' mean square and what of it is noise: third differences of slopes one after the other, which what is slow
/// hardly has, or what the noise of single rows makes of them if it is white, where that is less: a fast motion is none
/// of theirs, coarse angles are none of the former's. 0 where there are too few to say.
Slopes slopes_of(const std::vector<Piece>& pieces, double half_s, double row_noise)
{
    std::vector<double> bends;
    double square = 0.0, of_rows = 0.0, of_bends = 0.0;
    std::size_t hats = 0;
    for (const Piece& piece : pieces) {
        double last[3] = {};
        std::size_t held = 0;
        const std::size_t half = hat_rows(*piece.log, half_s);
        each_hat(piece, piece.begin, piece.end, half, [&](std::size_t k, const Hat& hat) {
            if (held == 0) of_bends = std::max(of_bends, bend_of_white(hat, half));
            const double slope = hat.slope_of(&piece.log->w_m_rad_s[k]),
                         bend = slope - 3.0 * last[0] + 3.0 * last[1] - last[2];
            square += slope * slope, of_rows += hat.slope_square(), ++hats;
            if (held++ >= 3) bends.push_back(bend * bend);
            last[2] = last[1], last[1] = last[0], last[0] = slope;
        });
    }
    const std::size_t count = bends.size();
    if (count < kFewest) return {};
    const double n = static_cast<double>(hats), white = row_noise * of_rows / n;
    return {std::min(white, median(bends) / (of_bends * kMedianOfSquare)), square / n, count, of_rows / n};
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

double Hat::slope_square() const { return dot(slope, slope.data()); }

std::size_t hat_rows(const Log& log, double half_s)
{
    return log.dt_s > 0.0 ? static_cast<std::size_t>(std::max(1.0, std::ceil(half_s / log.dt_s - 1e-6))) : 1;
}

HatChoice choose_hat(const std::vector<Piece>& pieces, double most_s)
{
    double period_s = 0.0;
    for (const Piece& piece : pieces) period_s = std::max(period_s, piece.log->dt_s);
    double half_s = std::max(kShortest_s, period_s);
    const double row_noise = row_noise_of(pieces);
    Slopes slopes = slopes_of(pieces, half_s, row_noise);
    while (slopes.part() > kNoisePart && 2.0 * half_s <= most_s) {
        const Slopes next = slopes_of(pieces, 2.0 * half_s, row_noise);
        const bool tells_motion = slopes.part() < kMostlyNoise;
        if (next.bends < kFewest || next.noise > kNoiseLeft * next.of_row / slopes.of_row * slopes.noise ||
            (tells_motion && next.motion() < kMotionLeft * slopes.motion()))
            break;
        half_s *= 2.0, slopes = next;
    }
    return {half_s, slopes.part()};
}

}  // namespace dqw
