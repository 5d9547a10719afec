#include "ref/model/gain.hpp"

#include <algorithm>
#include <cmath>

namespace dqw {
namespace {

/// Near 1 the recursion is at its end after one row, and q grows without bound.
constexpr double kInside = 0.99;
/// Of a decay in a row: beyond it a state is forgotten to e^-5; below, no piece is long enough to tell.
constexpr double kMostRateDt = 5.0, kLeastRateDt = 1e-9;
/// Of a gain and of its slope, that are their steady ones: what a prediction shows of neither.
constexpr double kSteady = 1e-7, kSteadySlope = 1e-3;
/// Of a gain, which a start's rows no longer differ by; of time constants, after which e^-8 of a start is left; and the
/// least rate that is waited for, 8000 rows: kMostLeftOut ends it before.
constexpr double kNearlySteady = 0.002, kForgotten = 8.0, kLeastRate = 1e-3;
/// Of all rows, when what never forgets is taken for what never does.
constexpr double kNever = 1e-6;

double inside(double g) { return std::min(g, kInside); }

}  // namespace

GainSchedule::GainSchedule(double steady, double rate_dt)
    : steady_(std::clamp(steady, 0.0, 1.0)), steady_slope_(steady == steady_ ? 1.0 : 0.0),
      decay_(std::exp(-std::clamp(rate_dt, kLeastRateDt, kMostRateDt)))
{
    const double g = inside(steady_), a = decay_ * decay_;
    const double q = g / (1.0 - g) - a * g, dq = 1.0 / ((1.0 - g) * (1.0 - g)) - a;
    double k = 1.0, dk = 0.0;
    while (gain_.size() < kLongest) {
        const double p = a * k + q;
        dk = (a * dk + dq) / ((1.0 + p) * (1.0 + p));
        k = p / (1.0 + p);
        gain_.push_back(k);
        slope_.push_back(steady_slope_ * dk);
        if (std::abs(k - g) < kSteady && std::abs(dk - 1.0) < kSteadySlope) break;
    }
}

std::size_t GainSchedule::forgets_in() const
{
    const double g = inside(steady_);
    std::size_t n = 0;
    while (n < gain_.size() && (gain_[n] - g > kNearlySteady || std::abs(slope_[n] - steady_slope_) > kNearlySteady))
        ++n;
    // Where it is no number: kNever.
    const double rate = -std::log(decay_ * (1.0 - g));
    return n + static_cast<std::size_t>(std::ceil(kForgotten / std::max(kNever, rate)));
}

StartWeights::StartWeights(const GainSchedule& schedule, bool count)
{
    const double g = inside(schedule.steady_);
    std::size_t settled = 0;
    for (double k : schedule.gain_) {
        weight.push_back(std::sqrt((1.0 - k) / (1.0 - g)));
        if (k - g > kNearlySteady) settled = weight.size();
    }
    const double forgotten = kForgotten / std::max(-std::log(schedule.decay_), kLeastRate);
    if (!count) left_out = std::min(std::max(settled, static_cast<std::size_t>(forgotten)), kMostLeftOut);
}

}  // namespace dqw
