#include "ref/trace/predicts.hpp"

#include "ref/model/averaged.hpp"
#include "ref/trace/rest.hpp"
#include "ref/trace/rules.hpp"

namespace dqw {
namespace {

constexpr int kPasses = 12;  ///< as a fit of the search has

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
    if (is_off(at.base, own.point.base, deviations(*setup.full, own).head(2), setup.hat_noise_part)) return false;
    return better(*setup.full, own.left, averaged.left).t < kClearlyT;
}

}  // namespace dqw
