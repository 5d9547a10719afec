#include "ref/trace/pulses.hpp"

#include <algorithm>
#include <cmath>

#include "ref/effect/range.hpp"
#include "ref/trace/inverter_loss.hpp"

namespace dqw {
namespace {

constexpr int kPasses = 12;  ///< as a fit of the search has

/// Late iron of a point, or nullptr.
Term* late_iron_of(Point& at)
{
    for (Term& t : at.terms)
        if (t.input.law == Law::iron_loss && t.input.shape[0] > 0.0) return &t;
    return nullptr;
}

}  // namespace

double start_link_V(const std::vector<Log>& logs)
{
    if (everywhere(logs, &Log::v_dc_V)) return 0.0;
    double most_V = 0.0;
    for (const Log& log : logs)
        for (std::size_t k = 0; k < log.rows(); ++k) most_V = std::max(most_V, std::hypot(log.v_d_V[k], log.v_q_V[k]));
    // A pass of refine() halves or doubles it: what the largest vector needs, and three times that, are one pass away.
    constexpr double kUsualRoom = 1.6, kRoot3 = 1.7320508075688772;
    return kUsualRoom * kRoot3 * most_V;
}

Refined settle_iron(const TraceSetup& setup, const Model& model, Refined found)
{
    const Term* term = late_iron_of(found.point);
    const std::vector<Log>& logs = *setup.logs;
    if (term == nullptr || (!everywhere(logs, &Log::theta_e_rad) && !everywhere(logs, &Log::theta_m_rad))) return found;
    const double periods = term->input.shape[0], link_V = start_link_V(logs);
    const std::string stated = stated_modulation(logs);
    Refined best = found;
    for (const Modulation m : kModulations) {
        if (!stated.empty() && m != modulation_named(stated)) continue;
        // The steps between what the search tries.
        for (const double times : {0.7, 1.0, 1.4}) {
            Point start = found.point;
            Term& late = *late_iron_of(start);
            late.input = pulsed_input(Law::pulsed_iron, m, link_V, 0.0, false);
            late.input.shape[2] = times * periods;
            Refined r = refine(model, start, kPasses);
            if (r.ok && r.left.heldout > best.left.heldout && confirmed(model, better(model, found.left, r.left)))
                best = std::move(r);
        }
    }
    return best;
}

}  // namespace dqw
