#include "ref/trace/predicts.hpp"

#include <cmath>

#include "ref/trace/rest.hpp"
#include "ref/trace/rules.hpp"

namespace dqw {
namespace {

constexpr int kPasses = 12;  ///< as a fit of the search has
/// Deviations of the means' own fit, which a normal exceeds in 3 of 1000 cases, and the part of a value that half a hat
/// of what is fast takes.
constexpr double kFar = 3.0, kOwnErrors = 0.01;
/// Of the reported residual: a right J leaves up to this much more than one that fits the noise of the blocks' ends.
constexpr double kAlike = 1.05;

double reported(const TraceSetup& setup, const Point& at) { return rms_of(setup.full->report(at, 0), 1); }

}  // namespace

bool predicts_means(const TraceSetup& setup, const Refined& averaged, const Point& predicted)
{
    if (!averaged.ok) return true;
    Point at = predicted;
    at.gain.resize(0);
    if (!(reported(setup, averaged.point) < kAlike * reported(setup, at))) return true;
    const Refined own = refine(*setup.full, at, kPasses);
    if (!own.ok) return true;
    const Eigen::VectorXd sd = deviations(*setup.full, own);
    for (Eigen::Index j = 0; j < at.base.size(); ++j) {
        const double value = std::abs(own.point.base[j]), errors = kOwnErrors + (j == 0 ? setup.hat_noise_part : 0.0);
        if (std::abs(at.base[j] - own.point.base[j]) > kFar * sd[j] + errors * value) return false;
    }
    return better(*setup.full, own.left, averaged.left).t < kClearlyT;
}

}  // namespace dqw
