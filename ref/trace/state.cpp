#include "ref/trace/state.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "ref/trace/spread.hpp"

namespace dqw {
namespace {

constexpr int kPasses = 12;  ///< as a fit of the search has

bool has_state(const Term& t)
{
    return t.input.heat > 0 && (t.input.law == Law::winding_temperature || t.input.law == Law::magnet_temperature);
}

/// The first and the last of its kind; 0 and 0 of a law without a state, and of settled rows without time.
std::pair<int, int> kind_of(const Term& t)
{
    if (t.input.law == Law::voltage_scale && t.input.heat > 0) return {1, kLinks};
    if (!has_state(t) || t.input.heat >= kOwnHeat) return {0, 0};
    return by_time(t.input) ? std::pair{kHeatsOfAKind + 1, kHeats} : std::pair{1, kHeatsOfAKind};
}

/// With another state of the terms from `from` to before `to`.
Refined with_state(const Model& model, const Refined& at, int heat, std::size_t from, std::size_t to)
{
    Point start = at.point;
    for (std::size_t n = from; n < to; ++n)
        if (start.terms[n].input.heat > 0) start.terms[n].input.heat = heat;
    return refine(model, start, kPasses);
}

/// Its neighbours of its kind, and of heats those of either kind that a search begins with.
std::vector<int> states_beside(const Term& t)
{
    const auto [least, most] = kind_of(t);
    std::vector<int> out;
    for (const int state : {t.input.heat - 1, t.input.heat + 1})
        if (state >= least && state <= most) out.push_back(state);
    if (!has_state(t)) return out;
    for (const int heat : kSoughtHeats)
        for (const int of_kind : {heat, heat + kHeatsOfAKind})
            if (of_kind != t.input.heat && std::find(out.begin(), out.end(), of_kind) == out.end())
                out.push_back(of_kind);
    return out;
}

}  // namespace

Refined settle_state(const Model& model, Refined found)
{
    for (std::size_t n = 0; n < found.point.terms.size(); ++n) {
        const auto [least, most] = kind_of(found.point.terms[n]);
        if (most == 0) continue;
        for (const int step : {1, -1})
            for (int state = found.point.terms[n].input.heat + step; state >= least && state <= most; state += step) {
                Refined next = with_state(model, found, state, n, n + 1);
                if (!next.ok || !(next.left.heldout > found.left.heldout)) break;
                found = std::move(next);
            }
    }
    return found;
}

Eigen::VectorXd spread_over_states(const TraceSetup& setup, const Refined& best)
{
    const auto& terms = best.point.terms;
    const auto counts = [](const Term& t) { return has_state(t) || kind_of(t).second > 0; };
    if (std::none_of(terms.begin(), terms.end(), counts)) return Eigen::VectorXd::Zero(best.point.columns());
    // A state between two is told from both.
    static constexpr double kHalf = 0.5;
    Eigen::VectorXd between = Eigen::VectorXd::Zero(best.point.columns());
    Eigen::VectorXd spread = spread_over(setup, best, [&between](const Model& model, const Refined& here) {
        std::vector<Refined> out;
        const auto put = [&](int heat, std::size_t from, std::size_t to) {
            out.push_back(with_state(model, here, heat, from, to));
        };
        const std::size_t all = here.point.terms.size();
        int own = 0, of_own = kOwnHeat;
        for (std::size_t n = 0; n < all; ++n) {
            const Term& t = here.point.terms[n];
            if (kind_of(t).second > 0)
                for (const int state : states_beside(t)) {
                    put(state, n, n + 1);
                    if (out.back().ok && std::abs(state - t.input.heat) == 1)
                        between = between.cwiseMax(kHalf *
                                                   (out.back().point.values() - here.point.values()).cwiseAbs());
                }
            if (!has_state(t) || t.input.heat < kOwnHeat) continue;
            ++own, of_own = t.input.heat < kOwnHeatAcross ? kOwnHeat : kOwnHeatAcross;
            for (int heat = of_own; heat < of_own + kOwnHeats; ++heat)
                if (heat != t.input.heat) put(heat, n, n + 1);
        }
        // Winding and magnet may have another memory together.
        for (int heat = of_own; own > 1 && heat < of_own + kOwnHeats; ++heat) put(heat, 0, all);
        return out;
    });
    spread = spread.cwiseMax(between);
    spread.segment(best.point.base.size(), best.point.gain.size()).setZero();
    // A weight counts in its own heat's unit; settled rows' heats have one, and so have a link's states.
    Eigen::Index j = best.point.base.size() + best.point.gain.size();
    for (const Term& t : best.point.terms) {
        const Eigen::Index n = weights_of(t.input.law) + free_shapes_of(t.input);
        if (has_state(t) ? t.input.heat < kOwnHeat : kind_of(t).second == 0) spread.segment(j, n).setZero();
        j += n;
    }
    return spread;
}

}  // namespace dqw
