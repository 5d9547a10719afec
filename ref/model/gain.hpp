// The correction gain of one axis, from a piece's first row to its steady value.
#ifndef DQW_REF_MODEL_GAIN_HPP
#define DQW_REF_MODEL_GAIN_HPP

#include <cstddef>
#include <vector>

namespace dqw {

/// Gains K_k of the scalar Riccati recursion whose steady gain is g, for a state that decays by `decay` per row and
/// whose first row is the measurement itself (K_0 = 1): so a noisy first sample is forgotten as fast as it should be.
///   P-_{k+1} = decay^2 K_k + q,  K = P- / (1 + P-),  q = g / (1 - g) - decay^2 g   (in units of the sensor's variance)
class GainSchedule {
public:
    static constexpr std::size_t kLongest = 20000;

    /// `steady` is brought onto [0, 1]; beyond, derivatives by it are zero. `rate_dt`: the state decays by e^-rate_dt.
    GainSchedule(double steady, double rate_dt);
    /// K_{n+1}, and dK/dg.
    double gain(std::size_t n) const { return n < gain_.size() ? gain_[n] : steady_; }
    double slope(std::size_t n) const { return n < slope_.size() ? slope_[n] : steady_slope_; }
    /// Rows after which a prediction shows no more where it began.
    std::size_t forgets_in() const;

private:
    friend struct StartWeights;
    double steady_, steady_slope_, decay_;
    std::vector<double> gain_, slope_;  ///< until K is steady
};

/// What the innovations of a piece's first rows weigh.
struct StartWeights {
    std::vector<double> weight;  ///< sqrt of steady over present innovation variance
    std::size_t left_out = 0;    ///< rows that weigh nothing
    static constexpr std::size_t kMostLeftOut = 500;

    StartWeights() = default;
    /// Without `count` rows are left out until K is steady and the start has decayed.
    StartWeights(const GainSchedule& schedule, bool count);
    /// Of the innovation of row n + 1.
    double at(std::size_t n) const { return n < left_out ? 0.0 : n < weight.size() ? weight[n] : 1.0; }
};

}  // namespace dqw
#endif
