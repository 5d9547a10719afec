#include "ref/log/speed_lag.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "ref/log/piece.hpp"

namespace dqw {
namespace {

constexpr std::size_t kLeastPiece = 100;
/// Blocks' lengths: an encoder's step stands beside what the speed changes by, and a slow drive's changes slowly.
constexpr double kBlocks_s[] = {1e-3, 4e-3, 16e-3};
constexpr std::size_t kLeastRows = 10;
/// Less is an angle's own instant; of a lag that is one, most of what the angle is ahead by goes with it.
constexpr double kLeastPeriods = 2.0, kMostLeft = 0.5, kDeviations = 10.0;
/// By which every other block may say otherwise: where one jump makes it, the half without says nothing.
constexpr double kApart = 0.2;

/// What the angle turns by more than the speed says in a block, beside what the speed changes by.
struct Sums {
    double xx = 0.0, xy = 0.0, yy = 0.0, count = 0.0;
    double lag_s() const { return xy / xx; }
    double left() const { return std::max(1.0 - xy * xy / (xx * yy), 0.0); }
    double sd_s() const { return std::sqrt(left() * yy / xx / count); }
    bool tells() const { return count > 2.0 && xx > 0.0 && yy > 0.0; }
    bool tells_lag(double least_s) const
    {
        return tells() && left() < kMostLeft && lag_s() > least_s && lag_s() > kDeviations * sd_s();
    }
    void add(double x, double y) { xx += x * x, xy += x * y, yy += y * y, ++count; }
};
/// Of all blocks, and of every other one.
using Halves = std::array<Sums, 3>;

/// Into one turn: half of it either way.
double wrapped(double angle_rad) { return std::remainder(angle_rad, 2.0 * M_PI); }

Halves sums_of(const std::vector<Piece>& pieces, bool electrical, double block_s)
{
    Halves sums;
    std::size_t blocks = 0;
    for (const Piece& piece : pieces) {
        const Log& log = *piece.log;
        const std::vector<double>&w = log.w_m_rad_s, &theta = electrical ? log.theta_e_rad : log.theta_m_rad;
        const double turns = electrical ? *log.machine.pole_pairs : 1.0;
        const auto block = std::max(kLeastRows, static_cast<std::size_t>(std::lround(block_s / log.dt_s)));
        double ahead = 0.0;
        std::size_t begin = piece.begin;
        for (std::size_t k = piece.begin; k + 1 < piece.end; ++k) {
            ahead += wrapped(theta[k + 1] - theta[k] - 0.5 * turns * (w[k] + w[k + 1]) * piece.period_s(k));
            if (k + 1 - begin < block) continue;
            const double x = turns * (w[k + 1] - w[begin]);
            sums[0].add(x, ahead), sums[1 + blocks++ % 2].add(x, ahead);
            ahead = 0.0, begin = k + 1;
        }
    }
    return sums;
}

}  // namespace

double speed_lag_s(const std::vector<Log>& logs)
{
    bool mechanical = !logs.empty(), electrical = !logs.empty();
    double dt_s = 0.0;
    for (const Log& log : logs) {
        if (log.regime != Regime::dynamic || log.observed || !(log.dt_s > 0.0)) return 0.0;
        mechanical = mechanical && !log.theta_m_rad.empty();
        electrical = electrical && !log.theta_e_rad.empty() && log.machine.pole_pairs;
        dt_s = std::max(dt_s, log.dt_s);
    }
    if (!mechanical && !electrical) return 0.0;
    const std::vector<Piece> pieces = pieces_of(logs, kLeastPiece);
    Halves best;
    for (const double block_s : kBlocks_s) {
        const Halves sums = sums_of(pieces, electrical, block_s);
        if (sums[0].tells() && (!best[0].tells() || sums[0].left() < best[0].left())) best = sums;
    }
    const bool told = std::all_of(best.begin(), best.end(), [&](const Sums& s) {
        return s.tells_lag(kLeastPeriods * dt_s) && std::abs(s.lag_s() - best[0].lag_s()) < kApart * best[0].lag_s();
    });
    return told ? best[0].lag_s() : 0.0;
}

// The slope is taken over half the lag: of a shorter time it is the noise's.
SpeedForward::SpeedForward(double lag_s, double dt_s)
    : rows_(lag_s > 0.0 && dt_s > 0.0 ? lag_s / dt_s : 0.0),
      before_(std::max<std::size_t>(static_cast<std::size_t>(std::lround(0.5 * rows_)), 1))
{
}

double SpeedForward::at(double w_m_rad_s)
{
    const double oldest = kept_ == 0 ? w_m_rad_s : kept_ < before_.size() ? before_.front() : before_[next_];
    const double slope = kept_ == 0 ? 0.0 : (w_m_rad_s - oldest) / static_cast<double>(kept_);
    before_[next_] = w_m_rad_s;
    next_ = (next_ + 1) % before_.size();
    kept_ = std::min(kept_ + 1, before_.size());
    return w_m_rad_s + rows_ * slope;
}

void SpeedForward::over(Log& rows)
{
    if (!(rows_ > 0.0)) return;
    auto gap = rows.segments.begin();
    for (std::size_t k = 0; k < rows.w_m_rad_s.size(); ++k) {
        if (gap != rows.segments.end() && *gap == k) ++gap, next_ = kept_ = 0;
        rows.w_m_rad_s[k] = at(rows.w_m_rad_s[k]);
    }
}

}  // namespace dqw
