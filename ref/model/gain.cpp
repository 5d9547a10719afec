#include "ref/model/gain.hpp"

#include <algorithm>
#include <cmath>

namespace dqw {

GainSchedule gain_schedule(double steady_gain, double decay)
{
    // Near 1 the recursion is at its end after one row, and q grows without bound.
    const double g = std::clamp(steady_gain, 0.0, 0.99);
    const double a = decay * decay;
    const double q = g / (1.0 - g) - a * g;
    const double dq = 1.0 / ((1.0 - g) * (1.0 - g)) - a;
    GainSchedule s;
    double k = 1.0, dk = 0.0;
    while (s.gain.size() < GainSchedule::kLongest) {
        const double p = a * k + q;
        dk = (a * dk + dq) / ((1.0 + p) * (1.0 + p));
        k = p / (1.0 + p);
        s.gain.push_back(k);
        s.derivative.push_back(dk);
        if (k - g > 0.002) s.settled = s.gain.size();
        s.weight.push_back(std::sqrt((1.0 - k) / (1.0 - g)));
        if (std::abs(k - g) < 1e-7 && std::abs(dk - 1.0) < 1e-3) break;
    }
    const double forgotten = 8.0 / std::max(-std::log(decay), 1e-3);
    s.settled = std::min(std::max(s.settled, static_cast<std::size_t>(forgotten)), GainSchedule::kLongestStart);
    return s;
}

}  // namespace dqw
