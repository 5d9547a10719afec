#include "ref/trace/inverter_loss.hpp"

#include <algorithm>
#include <cmath>

#include "ref/effect/range.hpp"
#include "ref/trace/spread.hpp"

namespace dqw {
namespace {

constexpr int kPasses = 12;  ///< as a fit of the search has

Term* dead_time_of(Point& at)
{
    for (Term& t : at.terms)
        if (is_dead_time(t.input.law)) return &t;
    return nullptr;
}

/// Width at which a law has half of its loss, over its own.
double half_of(LossLaw law)
{
    switch (law) {
    case LossLaw::tanh: return 0.55;
    case LossLaw::ramp: return 0.5;
    // Ripple, which blurs the other laws, is in it.
    case LossLaw::edges: return 2.0;
    default: return 1.0;
    }
}

/// Whether the legs' losses are another matter than their pulses: one rests, and loses as much as those that switch.
bool loses_at_rest(const TraceSetup& setup, const Input& input)
{
    return input.modulation == Modulation::centred && states_a_rest(*setup.logs);
}

Refined with_law(const TraceSetup& setup, const Model& model, const Refined& found, LossLaw law,
                 double worth = -HUGE_VAL)
{
    Point start = found.point;
    Input& input = dead_time_of(start)->input;
    // A settled row is a mean over pulses; a leg that rests has no edge.
    if (law == LossLaw::edges && (setup.regime != Regime::dynamic || loses_at_rest(setup, input))) return {};
    input.shape[0] *= half_of(input.loss) / half_of(law);
    input.shape[2] = law == LossLaw::edges ? link_to_fit_V(*setup.logs) : 0.0;
    input.loss = law;
    return refine(model, start, kPasses, worth);
}

/// Beside what the legs lose, what a controller gives back by the currents that it saw. (E173)
Refined with_given_back(const Model& model, const Refined& found, double width_A)
{
    Point start = found.point;
    Term& term = *dead_time_of(start);
    term.input.law = Law::dead_given_back;
    term.input.shape[3] = width_A;
    const double lost = std::abs(term.weights[0]);
    term.weights[2] = term.weights[0] - lost, term.weights[0] = lost;
    return refine(model, start, kPasses);
}

Refined without_given_back(const Model& model, const Refined& found)
{
    Point start = found.point;
    Term& term = *dead_time_of(start);
    const double width_A = term.input.shape[0];
    term.input.law = dead_time_input(term.input.modulation, width_A, 0.0, false).law;
    term.input.shape[3] = 0.0, term.weights[2] = 0.0;
    return refine(model, start, kPasses);
}

Refined with_modulation(const Model& model, const Refined& found, Modulation modulation, double turned_rad,
                        double worth = -HUGE_VAL)
{
    Point start = found.point;
    Term& term = *dead_time_of(start);
    const Input old = term.input;
    term.input = dead_time_input(modulation, old.shape[0], old.shape[1] + turned_rad, old.free_angle);
    term.input.loss = old.loss, term.input.averaged = old.averaged;
    term.input.shape[2] = old.shape[2], term.input.shape[3] = old.shape[3];
    if (old.law == Law::dead_given_back) term.input.law = old.law;
    term.weights[1] = 0.0;
    return refine(model, start, kPasses, worth);
}

/// What the rows seen have to say of a rival that those held out may prefer.
double worth_of(const Refined& best) { return best.left.seen - kLeastNats; }

bool leads(const Refined& rival, const Refined& best) { return rival.ok && rival.left.heldout > best.left.heldout; }

/// The same of one that was fitted no further than to `worth`: to its end, where it leads.
bool leads(const Model& model, Refined& rival, const Refined& best, double worth)
{
    if (leads(rival, best) && rival.left.seen < worth) rival = refine(model, std::move(rival), kPasses);
    return leads(rival, best);
}

}  // namespace

std::string stated_modulation(const std::vector<Log>& logs)
{
    for (const Log& log : logs)
        if (log.modulation != logs.front().modulation) return "";
    return logs.front().modulation == "unknown" ? "" : logs.front().modulation;
}

bool states_a_rest(const std::vector<Log>& logs)
{
    const std::string said = stated_modulation(logs);
    return !said.empty() && modulation_named(said) != Modulation::centred;
}

double link_to_fit_V(const std::vector<Log>& logs)
{
    if (everywhere(logs, &Log::v_dc_V)) return 0.0;
    double most_V = 0.0;
    for (const Log& log : logs)
        for (std::size_t k = 0; k < log.rows(); ++k) most_V = std::max(most_V, std::hypot(log.v_d_V[k], log.v_q_V[k]));
    constexpr double kUsualRoom = 1.6, kRoot3 = 1.7320508075688772;
    return kUsualRoom * kRoot3 * most_V;
}

Refined settle_loss(const TraceSetup& setup, const Model& model, Refined found)
{
    const Term* term = dead_time_of(found.point);
    if (term == nullptr) return found;
    if (stated_modulation(*setup.logs).empty() && !term->input.averaged) {
        Refined best = found;
        const Modulation first = term->input.modulation;
        for (const Modulation m : kModulations) {
            // Three phases look the same every third of a turn, and a sixth further with high for low.
            const bool other_half = term->input.free_angle && m == Modulation::clamped_low;
            if (m == first || (term->input.free_angle && m == Modulation::clamped_high)) continue;
            for (const double turned_rad : {0.0, M_PI / 3.0}) {
                if (turned_rad > 0.0 && !other_half) continue;
                const double worth = worth_of(best);
                Refined rival = with_modulation(model, found, m, turned_rad, worth);
                if (leads(model, rival, best, worth) &&
                    (m == Modulation::centred || confirmed(model, better(model, found.left, rival.left))))
                    best = std::move(rival);
            }
        }
        found = std::move(best);
    }
    const Input& loss = dead_time_of(found.point)->input;
    if (states_a_rest(*setup.logs) && !loss.averaged && loss.law != Law::dead_given_back) {
        const bool all = loss.modulation == Modulation::centred;
        const Modulation said = modulation_named(stated_modulation(*setup.logs));
        Refined other = with_modulation(model, found, all ? said : Modulation::centred, 0.0);
        const Refined &as_said = all ? other : found, &at_rest = all ? found : other;
        const bool confirms = as_said.ok && at_rest.ok && leads(at_rest, as_said) &&
                              confirmed(model, better(model, as_said.left, at_rest.left));
        if (other.ok && confirms != all) found = std::move(other);
    }
    Refined best = found, at_edges;
    for (const LossLaw law : kLossLaws) {
        if (law == dead_time_of(found.point)->input.loss) continue;
        // What is given back stands beside edges alone.
        if (dead_time_of(found.point)->input.law == Law::dead_given_back) continue;
        // The edges' own is where what is given back begins.
        const bool edges = law == LossLaw::edges;
        const double worth = edges ? -HUGE_VAL : worth_of(best);
        Refined rival = with_law(setup, model, found, law, worth);
        if (edges) at_edges = rival;
        if (leads(model, rival, best, worth)) best = std::move(rival);
    }
    if (dead_time_of(found.point)->input.law == Law::dead_given_back) {
        const Refined rival = without_given_back(model, found);
        return rival.ok && !confirmed(model, better(model, rival.left, best.left)) ? rival : best;
    }
    if (!at_edges.ok) return best;
    Refined rival = with_given_back(model, at_edges, dead_time_of(found.point)->input.shape[0]);
    if (leads(rival, best) && dead_time_of(rival.point)->weights[2] < 0.0 &&
        confirmed(model, better(model, best.left, rival.left)))
        best = std::move(rival);
    return best;
}

Point as_firmware_learns(const TraceSetup& setup, const Refined& best)
{
    Point start = best.point;
    Term* const term = dead_time_of(start);
    if (term == nullptr || term->input.loss != LossLaw::edges) return start;
    // The ripple that edges leave out of their width is in a sample's: usual ones have a hundredth of the currents.
    constexpr double kLeastWidth = 0.01;
    const Input old = term->input;
    const double width_A = std::max(old.shape[0] * half_of(old.loss) / half_of(LossLaw::tanh),
                                    kLeastWidth * setup.i_base_A);
    term->input = dead_time_input(old.modulation, width_A, old.shape[1], old.free_angle);
    // Beside current what is given back is of the other sign.
    term->weights[0] += term->weights[2], term->weights[2] = 0.0;
    Refined refined = refine(setup.search(), start, kPasses);
    return refined.ok ? refined.point : start;
}

namespace {

/// A ramp stands for what blurs edges, noise or an output's capacitance: by how much each column would be another without
/// it.
Eigen::VectorXd spread_over_blur(const TraceSetup& setup, const Refined& best)
{
    Eigen::VectorXd spread = Eigen::VectorXd::Zero(best.point.columns());
    const Refined here = refine(setup.search(), best.point, kPasses);
    if (!here.ok) return spread;
    const Eigen::MatrixXd cov = covariance(setup.search(), here);
    const Eigen::Index first = here.point.base.size() + here.point.gain.size();
    Eigen::Index j = first;
    for (const Term& t : here.point.terms) {
        const Eigen::Index width = j + weights_of(t.input.law);
        if (is_dead_time(t.input.law) && cov(width, width) > 0.0)
            spread = (cov.col(width) / cov(width, width) * t.input.shape[0]).cwiseAbs();
        j = width + free_shapes_of(t.input);
    }
    spread.segment(here.point.base.size(), here.point.gain.size()).setZero();
    j = first;
    for (const Term& t : here.point.terms) {
        j += weights_of(t.input.law);
        spread.segment(j, free_shapes_of(t.input)).setZero();
        j += free_shapes_of(t.input);
    }
    return spread.allFinite() ? spread : Eigen::VectorXd::Zero(best.point.columns());
}

}  // namespace

Eigen::VectorXd spread_over_laws(const TraceSetup& setup, const Refined& best)
{
    Point at = best.point;
    const Term* term = dead_time_of(at);
    if (term == nullptr) return Eigen::VectorXd::Zero(best.point.columns());
    // What is given back stands beside edges alone.
    if (term->input.law == Law::dead_given_back) return spread_over_blur(setup, best);
    const Eigen::VectorXd laws = spread_over(setup, best,
                                             [&setup, own = term->input.loss](const Model& model, const Refined& here) {
                                                 std::vector<Refined> out;
                                                 for (const LossLaw law : kLossLaws)
                                                     if (law != own) out.push_back(with_law(setup, model, here, law));
                                                 return out;
                                             });
    return term->input.loss == LossLaw::edges ? laws.cwiseMax(spread_over_blur(setup, best)) : laws;
}

Eigen::VectorXd hidden_loss(const TraceSetup& setup, const Point& plain, const Point& lossy)
{
    const Model& model = setup.search();
    Eigen::VectorXd hidden = Eigen::VectorXd::Zero(plain.columns());
    const Refined without = refine(model, plain, kPasses), with = refine(model, lossy, kPasses);
    if (!without.ok || !with.ok) return hidden;
    double most_V = 0.0;
    for (const Log& log : *setup.logs)
        for (std::size_t k = 0; k < log.v_d_V.size(); ++k)
            most_V = std::max(most_V, std::hypot(log.v_d_V[k], log.v_q_V[k]));
    const Eigen::Index weight = plain.base.size() + plain.gain.size();
    const Eigen::VectorXd sd = deviations(model, with);
    const double sd_V = sd[weight], loss_V = with.point.values()[weight];
    if (!std::isfinite(sd_V) || !(sd_V > 0.0)) return hidden;
    const double odds = std::exp(0.5 * std::pow(loss_V / sd_V, 2)) / std::hypot(1.0, kUsualLoss * most_V / sd_V);
    const double probable = std::isfinite(odds) ? odds / (1.0 + odds) : 1.0;
    for (Eigen::Index j = 0; j < plain.base.size(); ++j)
        if (std::isfinite(sd[j]))
            hidden[j] = std::sqrt(probable) * std::hypot(with.point.base[j] - without.point.base[j], sd[j]);
    return hidden;
}

}  // namespace dqw
