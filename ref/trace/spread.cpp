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

bool has_state(const Term& t)
{
    return t.input.heat > 0 && (t.input.law == Law::winding_temperature || t.input.law == Law::magnet_temperature);
}

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

Eigen::VectorXd spread_over_heats(const TraceSetup& setup, const Refined& best)
{
    const auto& terms = best.point.terms;
    if (std::none_of(terms.begin(), terms.end(), has_state)) return Eigen::VectorXd::Zero(best.point.columns());
    Eigen::VectorXd spread = spread_over(setup, best, [](const Model& model, const Refined& here) {
        std::vector<Refined> out;
        const auto put = [&](int heat, std::size_t from, std::size_t to) {
            Point start = here.point;
            for (std::size_t n = from; n < to; ++n)
                if (has_state(start.terms[n])) start.terms[n].input.heat = heat;
            out.push_back(refine(model, start, kPasses));
        };
        const std::size_t all = here.point.terms.size();
        int own = 0, of_own = kOwnHeat;
        for (std::size_t n = 0; n < all; ++n) {
            const Term& t = here.point.terms[n];
            if (!has_state(t)) continue;
            const bool is_own = t.input.heat >= kOwnHeat;
            const int first = !is_own                         ? 1
                              : t.input.heat < kOwnHeatAcross ? kOwnHeat
                                                              : kOwnHeatAcross,
                      end = first + (is_own ? kOwnHeats : kHeats);
            for (int heat = first; heat < end; ++heat)
                if (heat != t.input.heat) put(heat, n, n + 1);
            if (is_own) ++own, of_own = first;
        }
        // Winding and magnet may have another memory together.
        for (int heat = of_own; own > 1 && heat < of_own + kOwnHeats; ++heat) put(heat, 0, all);
        return out;
    });
    // A weight counts in its own state's unit; settled rows' states have one.
    Eigen::Index j = best.point.base.size() + best.point.gain.size();
    for (const Term& t : best.point.terms) {
        const Eigen::Index n = weights_of(t.input.law) + free_shapes_of(t.input);
        if (!(has_state(t) && t.input.heat >= kOwnHeat)) spread.segment(j, n).setZero();
        j += n;
    }
    return spread;
}

}  // namespace dqw
