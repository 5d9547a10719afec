#include "ref/trace/spread.hpp"

#include <algorithm>
#include <cmath>

#include "ref/trace/noise.hpp"
#include "ref/trace/rest.hpp"

namespace dqw {
namespace {

constexpr int kPasses = 12;  ///< as a fit of the search has
/// Rows held out tell two laws apart: a normal exceeds it, either way, in 3 of 1000 cases.
constexpr double kToldT = 3.0;

}  // namespace

Eigen::VectorXd spread_over(const TraceSetup& setup, const Refined& best,
                            const std::function<std::vector<Refined>(const Model&, const Refined&)>& rivals)
{
    Eigen::VectorXd spread = Eigen::VectorXd::Zero(best.point.columns());
    const Model& model = setup.search();
    const Refined here = refine(model, best.point, kPasses);
    if (!here.ok) return spread;
    const Eigen::VectorXd values = here.point.values();
    const auto square = [&](const Refined& r) {
        return std::pow(rms_of(setup.full->report(r.point, 0), setup.full->channels()), 2);
    };
    const double own = square(here), excess = std::max(own - std::pow(noise_of(setup, here.point).of_rows(), 2), 0.0);
    for (const Refined& other : rivals(model, here)) {
        if (!other.ok) continue;
        // Where the best itself leaves more than noise, no law is the true one.
        const bool as_near = square(other) - own <= excess;
        if (!as_near && better(model, other.left, here.left).t > kToldT) continue;
        // Of a law that fits a number more, the machine's alone.
        const Eigen::Index n = other.point.columns() == values.size() ? values.size() : best.point.base.size();
        spread.head(n) = spread.head(n).cwiseMax((other.point.values().head(n) - values.head(n)).cwiseAbs());
    }
    // A gain is none of the machine's, and each law has a width of its own.
    spread.segment(best.point.base.size(), best.point.gain.size()).setZero();
    Eigen::Index j = best.point.base.size() + best.point.gain.size();
    for (const Term& t : best.point.terms) {
        j += weights_of(t.input.law);
        const Eigen::Index shapes = free_shapes_of(t.input);
        spread.segment(j, shapes).setZero();
        j += shapes;
    }
    return spread;
}

}  // namespace dqw
