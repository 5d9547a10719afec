// The correction gain of one axis, from a segment's first row to its steady value.
#ifndef DQW_REF_MODEL_GAIN_HPP
#define DQW_REF_MODEL_GAIN_HPP

#include <algorithm>
#include <cstddef>
#include <vector>

namespace dqw {

/// Gains K_k of the scalar Riccati recursion whose steady gain is g, for a state that decays by `decay` per row and
/// whose first row is the measurement itself (K_0 = 1): so a noisy first sample is forgotten as fast as it should be.
///   P-_{k+1} = decay^2 K_k + q,  K = P- / (1 + P-),  q = g / (1 - g) - decay^2 g   (in units of the sensor's variance)
struct GainSchedule {
    std::vector<double> gain;        ///< K_1, K_2, ... until K is steady, at most `kLongest` of them
    std::vector<double> derivative;  ///< dK/dg
    std::vector<double> weight;      ///< sqrt of steady over present innovation variance
    std::size_t settled = 0;         ///< rows until K is steady and the start has decayed, at most kLongestStart
    static constexpr std::size_t kLongest = 20000, kLongestStart = 500;

    /// Weight of the innovation of row n + 1; 0 before the gain has settled, unless those rows count.
    double weight_at(std::size_t n, bool count_start) const
    {
        return !count_start && n < settled ? 0.0 : n < weight.size() ? weight[n] : 1.0;
    }
};

/// 0 <= steady_gain <= 1, 0 < decay <= 1.
GainSchedule gain_schedule(double steady_gain, double decay);

/// A gain brought onto [0, 1], or, to try again whether it leaves a bound, a little inside.
inline double confined_gain(double g, bool wake)
{
    constexpr double kAwake = 2e-3;
    return wake ? std::clamp(g, kAwake, 1.0 - kAwake) : std::clamp(g, 0.0, 1.0);
}

}  // namespace dqw
#endif
