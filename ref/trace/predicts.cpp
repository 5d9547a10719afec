#include "ref/trace/predicts.hpp"

#include <cmath>

#include "ref/trace/rules.hpp"

namespace dqw {
namespace {

constexpr int kPasses = 12;  ///< as a fit of the search has
/// Deviations of the means' own fit, which a normal exceeds in 3 of 1000 cases, and the part of a value that its own
/// errors take: what noise is left in its slopes, and half a hat of what is fast.
constexpr double kFar = 3.0, kOwnErrors = 0.01;

}  // namespace

bool predicts_means(const TraceSetup& setup, const Refined& averaged, const Point& predicted)
{
    if (!averaged.ok) return true;
    Point at = predicted;
    at.gain.resize(0);
    const Refined own = refine(*setup.full, at, kPasses);
    if (!own.ok) return true;
    const Eigen::VectorXd sd = deviations(*setup.full, own);
    for (Eigen::Index j = 0; j < at.base.size(); ++j) {
        const double value = own.point.base[j];
        if (std::abs(at.base[j] - value) > kFar * sd[j] + kOwnErrors * std::abs(value)) return false;
    }
    return better(*setup.full, swept(*setup.full, at).left, averaged.left).t < kClearlyT;
}

}  // namespace dqw
