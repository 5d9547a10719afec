#include "ref/trace/sampled_instant.hpp"

#include <algorithm>
#include <cmath>

#include "ref/effect/effect.hpp"
#include "ref/model/electrical.hpp"

namespace dqw {
namespace {

constexpr int kPasses = 12;  ///< as a fit of the search has

bool is_pulsed(Law law) { return law == Law::pulsed_shift || law == Law::pulsed_lag; }

Input without_pulses(Law law)
{
    if (law == Law::pulsed_lag) return {Law::sensor_lag, {static_cast<double>(Channel::currents)}};
    return {Law::sample_shift, {static_cast<double>(Instant::currents_after)}};
}

/// The law that says between the pulses what a term says of the currents' instant; its own where it says nothing of it.
Law with_pulses(const Input& term)
{
    if (filters_currents(term)) return Law::pulsed_lag;
    return term.law == Law::sample_shift && term.shape[0] == without_pulses(Law::pulsed_shift).shape[0]
               ? Law::pulsed_shift
               : term.law;
}

Refined with_input(const Model& model, const Refined& found, std::size_t k, const Input& input, double from_s,
                   double worth)
{
    Point start = found.point;
    start.terms[k].input = input, start.terms[k].weights[0] = from_s;
    return refine(model, start, kPasses, worth);
}

}  // namespace

Refined settle_instant(const TraceSetup& setup, const Model& model, Refined found)
{
    Refined best = found;
    const auto take = [&](const Refined& rival) {
        if (rival.ok && rival.left.heldout > best.left.heldout &&
            confirmed(model, better(model, found.left, rival.left)))
            best = rival;
    };
    for (std::size_t k = 0; k < found.point.terms.size(); ++k) {
        const Term& term = found.point.terms[k];
        const Law law = with_pulses(term.input);
        if (!is_pulsed(law)) continue;
        // What is told without pulses lies near the right one of their valleys, or beyond it, towards a whole period.
        double from_s = term.weights[0];
        if (is_pulsed(term.input.law)) {
            const Refined plain = with_input(model, found, k, without_pulses(law), from_s, -HUGE_VAL);
            if (plain.ok) from_s = plain.point.terms[k].weights[0];
            take(plain);
        }
        for (const Candidate& c : setup.candidates)
            if (c.inputs.front().law == law)
                for (const double part : {1.0, 0.9, 0.75, 0.5})
                    take(with_input(model, found, k, c.inputs.front(), part * from_s, best.left.seen));
    }
    return best;
}

bool may_be_sampling(const Point& at, const std::string& name)
{
    for (const Term& t : at.terms) {
        if (name != name_of(t.input.law)) continue;
        const bool shift = t.input.law == Law::sample_shift || filters_currents(t.input);
        if (!shift && t.input.law != Law::iron_loss && t.input.law != Law::turn_short) return false;
        const double L_H = std::max(at.base[ElectricalModel::kLd], at.base[ElectricalModel::kLq]);
        return std::abs(t.weights[0]) * (shift ? 1.0 : L_H) < kSampling_s;
    }
    return false;
}

}  // namespace dqw
