#include "ref/model/gain.hpp"

#include <algorithm>
#include <cmath>

namespace dqw {
namespace {

/// Near 1 the recursion is at its end after one row, and q grows without bound.
double inside(double g) { return std::min(g, 0.99); }

}  // namespace

GainSchedule::GainSchedule(double steady, double rate_dt)
    : steady_(std::clamp(steady, 0.0, 1.0)), steady_slope_(steady == steady_ ? 1.0 : 0.0),
      decay_(std::exp(-std::clamp(rate_dt, 1e-9, 5.0)))
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
        if (std::abs(k - g) < 1e-7 && std::abs(dk - 1.0) < 1e-3) break;
    }
}

StartWeights::StartWeights(const GainSchedule& schedule, bool count)
{
    const double g = inside(schedule.steady_);
    std::size_t settled = 0;
    for (double k : schedule.gain_) {
        weight.push_back(std::sqrt((1.0 - k) / (1.0 - g)));
        if (k - g > 0.002) settled = weight.size();
    }
    const double forgotten = 8.0 / std::max(-std::log(schedule.decay_), 1e-3);
    if (!count) left_out = std::min(std::max(settled, static_cast<std::size_t>(forgotten)), kMostLeftOut);
}

}  // namespace dqw
