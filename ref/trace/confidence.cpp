#include "ref/trace/confidence.hpp"

#include <algorithm>
#include <cmath>

namespace dqw {
namespace {

/// Of a normal below `t`.
double below(double t) { return 0.5 * std::erfc(-t / std::sqrt(2.0)); }

/// Odds of what was left out against what was taken: by the blocks' signs of the gain, or by its size where each block
/// counts as one row, whichever says less.
double odds_against(const Better& over)
{
    const double by_t = below(-over.t) / std::max(below(over.t), 1e-9), by_nats = std::exp(-over.nats_each);
    if (by_t < 1.0 && by_nats < 1.0) return std::max(by_t, by_nats);
    if (by_t > 1.0 && by_nats > 1.0) return std::min(by_t, by_nats);
    return 1.0;
}

}  // namespace

double confidence_of(const Found& found, double share)
{
    constexpr double kCatalogue = 0.98;
    double against = odds_against(found.over);
    for (const Rival& r : found.rivals) against += odds_against(r.over);
    return kCatalogue * std::clamp(share, 0.0, 1.0) / (1.0 + against);
}

}  // namespace dqw
