#include "app/learn/learn.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "app/base/learnable.hpp"
#include "app/base/parameters.hpp"
#include "app/learn/electrical.hpp"
#include "app/learn/mechanical.hpp"
#include "app/learn/parts.hpp"
#include "app/learn/q15.hpp"
#include "ref/fit/dynamic.hpp"
#include "ref/trace/named.hpp"

namespace dqw {
namespace {

void check(const std::vector<Log>& logs, const LearnOptions& options)
{
    const std::vector<std::string>& known = known_parameters();
    for (const std::string& name : options.parameters)
        if (std::find(known.begin(), known.end(), name) == known.end())
            throw std::invalid_argument("unknown parameter '" + name + "'");
    if (logs.empty()) throw std::invalid_argument("no log");
    for (const Log& log : logs) {
        if (log.regime != logs.front().regime)
            throw std::invalid_argument(log.path + ": its regime differs from " + logs.front().path);
        const bool timed = log.regime == Regime::dynamic || log.regime == Regime::mechanical;
        if (timed && std::abs(log.dt_s / logs.front().dt_s - 1.0) > 1e-3)
            throw std::invalid_argument(log.path + ": its sampling period differs from " + logs.front().path +
                                        "; learn them one at a time");
    }
}

}  // namespace

namespace {

Learned learn_those(const std::vector<Log>& logs, const LearnOptions& options)
{
    if (logs.front().regime == Regime::mechanical) return learn_mechanical(logs, options);
    return options.fixed_point ? learn_q15(logs, options) : learn_electrical(logs, options);
}

std::size_t place_of_dead_time(const std::vector<TraceInput>& inputs)
{
    const auto is = [](const TraceInput& in) { return in.effect == "dead_time"; };
    return static_cast<std::size_t>(std::find_if(inputs.begin(), inputs.end(), is) - inputs.begin());
}

/// What a width that may be anywhere within an octave to either side moves is in the deviation: blocks of many rows blur
/// it, so that what leaves least may be the next one.
void allow_for_width(std::vector<Estimate>& learned, const std::vector<Estimate>& half,
                     const std::vector<Estimate>& twice)
{
    constexpr double kOfTwoOctaves = 0.29;  // an even spread of two octaves has 0.58 octaves
    for (Estimate& e : learned) {
        const Estimate *a = find_estimate(half, e.name), *b = find_estimate(twice, e.name);
        if (!e.given && a && b) e.sd = std::hypot(e.sd, kOfTwoOctaves * (b->value - a->value));
    }
}

/// R and the voltage go with the width: where a width next to it teaches neither, or rows at standstill leave the same
/// with each, nobody knows them.
void unless_told_either_side(const Learned& half, const Learned& twice, Learned& here, bool standstill)
{
    const auto lacks = [](const Learned& l) { return find_estimate(l.result.parameters, "R_ohm") == nullptr; };
    if (!standstill && !lacks(half) && !lacks(twice)) return;
    const char* why = "it goes with the width of the dead time, which nobody said and this log does not tell";
    const char* help = "the width, by --config of a trace; or fit --effect dead_time";
    auto& known = here.result.parameters;
    const auto is_R = [](const Estimate& e) { return e.name == "R_ohm"; };
    if (std::any_of(known.begin(), known.end(), is_R)) here.result.not_identifiable.push_back({"R_ohm", why, help});
    known.erase(std::remove_if(known.begin(), known.end(), is_R), known.end());
    const auto is_it = [](const TraceEffect& e) { return e.name == "dead_time"; };
    if (std::any_of(here.effects.begin(), here.effects.end(), is_it))
        here.result.not_identifiable.push_back({"dead_time", why, help});
    here.effects.erase(std::remove_if(here.effects.begin(), here.effects.end(), is_it), here.effects.end());
}

/// Dead time whose width nobody gave: of widths an octave apart the one that leaves least, from the usual one on.
/// `loss_V`: its voltage, 0 where it is not told, whatever is known of R.
Learned over_widths(const std::vector<Log>& logs, LearnOptions options, double* loss_V = nullptr)
{
    constexpr int kMostSteps = 5;
    Learned here = learn_those(logs, options);
    const std::size_t at = place_of_dead_time(here.inputs), asked = place_of_dead_time(options.inputs);
    if (loss_V != nullptr) *loss_V = told_loss_V(here);
    if (at >= here.inputs.size() || here.inputs[at].shape.empty()) return here;
    double width_A = here.inputs[at].shape[0];
    options.progress = {}, options.block = {};
    const auto learned_at = [&](double width) {
        options.inputs[asked].shape = {width};
        return learn_those(logs, options);
    };
    Learned half = learned_at(0.5 * width_A), twice = learned_at(2.0 * width_A);
    for (int step = 0; step < kMostSteps; ++step) {
        const double left = here.result.residual_rms;
        if (half.result.residual_rms < left && half.result.residual_rms <= twice.result.residual_rms) {
            width_A *= 0.5;
            twice = std::move(here), here = std::move(half), half = learned_at(0.5 * width_A);
        } else if (twice.result.residual_rms < left) {
            width_A *= 2.0;
            half = std::move(here), here = std::move(twice), twice = learned_at(2.0 * width_A);
        } else {
            break;
        }
    }
    if (loss_V != nullptr) *loss_V = told_loss_V(here);
    unless_told_either_side(half, twice, here, logs.front().regime == Regime::standstill);
    allow_for_width(here.result.parameters, half.result.parameters, twice.result.parameters);
    for (TraceEffect& e : here.effects)
        for (std::size_t k = 0; k < half.effects.size() && k < twice.effects.size(); ++k)
            if (half.effects[k].name == e.name && twice.effects[k].name == e.name)
                allow_for_width(e.parameters, half.effects[k].parameters, twice.effects[k].parameters);
    here.result.notes.push_back(fmt::format(
        "dead_time: nobody said its width; of those an octave apart {:.3g} A leaves least, and what an octave "
        "moves is in the deviations; fit --effect finds it, learn --config takes it",
        width_A));
    return here;
}

bool has_angle(const Log& log) { return !log.theta_e_rad.empty() || !log.theta_m_rad.empty(); }

/// Of R, L_d, L_q, psi as a fit has them; -1: none of them, or given.
Eigen::Index index_of(const Estimate& e)
{
    static const char* const kNames[] = {"R_ohm", "Ld_H", "Lq_H", "psi_Wb"};
    const auto at = std::find(std::begin(kNames), std::end(kNames), e.name);
    return at == std::end(kNames) || e.given ? -1 : at - std::begin(kNames);
}

/// Whether the logs are such that learners can tell a dead time, and nobody asked for it.
bool may_hide_a_loss(const std::vector<Log>& logs, const std::vector<TraceInput>& inputs)
{
    return logs.front().regime == Regime::dynamic && place_of_dead_time(inputs) == inputs.size() &&
           std::all_of(logs.begin(), logs.end(), has_angle);
}

/// What the model lacks and an angle shows, a dead time first of all, moves the values alike in all blocks, so that their
/// scatter does not tell. By how much stands in the deviations: of all values where that dead time is told, else of the
/// ones that differ by more than the wider model's deviation allows two consistent estimates to. (E185)
bool allow_for_hidden_loss(const std::vector<Log>& logs, LearnOptions options, Learned& learned)
{
    constexpr double kBeyond = 3.0;  // deviations
    options.inputs.push_back({"dead_time", {}, {}});
    options.progress = {}, options.block = {};
    double loss_V = 0.0;
    const Learned with = over_widths(logs, options, &loss_V);
    auto& known = learned.result.parameters;
    std::vector<std::string> moved;
    for (Estimate& e : known) {
        const Estimate* other = e.given ? nullptr : find_estimate(with.result.parameters, e.name);
        if (other == nullptr) continue;
        const double by = other->value - e.value;
        const bool beyond = std::abs(by) > kBeyond * other->sd;
        if (beyond) moved.push_back(e.name);
        if (beyond || loss_V != 0.0) e.sd = std::hypot(e.sd, by);
    }
    if (loss_V == 0.0 && moved.empty()) return false;
    const auto hangs_on_it = [&](const Estimate& e) {
        return loss_V != 0.0 && !e.given && !find_estimate(with.result.parameters, e.name);
    };
    for (const Estimate& e : known)
        if (hangs_on_it(e))
            learned.result.not_identifiable.push_back(
                {e.name, fmt::format("a dead time of {:.2g} V that the log shows may stand in its place", loss_V),
                 "--effect dead_time, and a log with several currents and speeds"});
    known.erase(std::remove_if(known.begin(), known.end(), hangs_on_it), known.end());
    const std::string what = loss_V != 0.0
                                 ? fmt::format("a dead time of {:.2g} V would explain part of what this model leaves",
                                               loss_V)
                                 : fmt::format("with a dead time and the angle {} is another", fmt::join(moved, ", "));
    learned.result.notes.push_back(what + "; by how much it moves the values is in their deviations; "
                                          "--effect dead_time learns it");
    return true;
}

/// A value's third deviation that is worth a note.
bool tells(const Estimate& e, double sd)
{
    constexpr double kTelling = 0.02;
    return 3.0 * sd > kTelling * std::abs(e.value);
}

/// Where what another estimator makes of a value is further away than both deviations allow, one of the two is wrong:
/// all of it is in the deviation, and the name among those `apart` where that tells. (E187)
void hold_beside(double value, double sd, Estimate& e, std::vector<std::string>& apart)
{
    constexpr double kBeyond = 3.0;  // deviations
    const double by = value - e.value;
    if (!(std::abs(by) > kBeyond * std::hypot(sd, e.sd))) return;
    e.sd = std::hypot(e.sd, by);
    if (tells(e, std::abs(by)) && std::find(apart.begin(), apart.end(), e.name) == apart.end()) apart.push_back(e.name);
}

/// Beside a fit with a dead time, whose law has a width and a shape that fit.
void hold_beside_a_loss(const std::vector<Log>& logs, Learned& learned, std::vector<std::string>& apart)
{
    if (!std::all_of(logs.begin(), logs.end(), has_angle)) return;
    const std::optional<NamedLook> fit = look_at_named(logs, {"dead_time"}, learned.model.pole_pairs);
    if (!fit) return;
    for (Estimate& e : learned.result.parameters)
        if (const Eigen::Index at = index_of(e); at >= 0) hold_beside(fit->value[at], fit->sd[at], e, apart);
}

/// What a plain fit of the same logs knows and blocks do not: a filter of the currents, and, where no dead time is
/// learned, or none is told, an inverter's loss move the learners' values as they move the fit's; and what the two make
/// of one value differs by no more than both deviations allow, or one of them is wrong. By how much stands in the
/// deviations.
/// `comparable`: the learners' model is the fit's, or has a dead time more; `said`: that a loss shows. (E166), (E187)
void hold_beside_a_fit(const std::vector<Log>& logs, bool comparable, bool learns_loss, bool said, Learned& learned)
{
    const std::optional<PlainLook> fit = plain_look(logs, learned.model.pole_pairs);
    if (!fit) return;
    const bool told = learns_loss && told_loss_V(learned) != 0.0;
    bool filtered = false, lossy = false;
    std::vector<std::string> apart;
    for (Estimate& e : learned.result.parameters) {
        const Eigen::Index at = index_of(e);
        if (at < 0) continue;
        if (fit->filtered) {
            filtered = filtered || tells(e, fit->hidden.filter_sd[at]);
            e.sd = std::hypot(e.sd, fit->hidden.filter_sd[at]);
        }
        if (!told && tells(e, fit->hidden.loss_sd[at])) {
            lossy = !learns_loss;
            e.sd = std::hypot(e.sd, fit->hidden.loss_sd[at]);
        }
        if (comparable) hold_beside(fit->value[at], fit->sd[at], e, apart);
    }
    if (learns_loss && comparable) hold_beside_a_loss(logs, learned, apart);
    if (filtered)
        learned.result.notes.push_back(
            fmt::format("currents filtered by a time constant of about {:.3g} us would explain part of what this model "
                        "leaves; by how much they move the values is in their deviations; dqwatch trace tells",
                        1e6 * fit->hidden.filter_s));
    if (lossy && !said)
        learned.result.notes.push_back("an inverter whose legs lose voltage with the sign of their current would move "
                                       "the values; by how much is in their deviations; --effect dead_time learns it");
    if (!apart.empty())
        learned.result.notes.push_back(fmt::format("warning: a fit of the same rows makes {} another; by how much is "
                                                   "in the deviations; dqwatch trace tells why",
                                                   fmt::join(apart, ", ")));
}

/// A flux map is the machine's where its bend counts once.
void note_weights(Learned& learned)
{
    constexpr double kOff = 0.05, kDeviations = 4.0;
    for (const TraceEffect& effect : learned.effects)
        for (const Estimate& e : effect.parameters)
            if (effect.name == "flux_map" && !e.given && std::isfinite(e.sd) &&
                std::abs(e.value - 1.0) > std::max(kOff, kDeviations * e.sd))
                learned.result.notes.push_back(
                    fmt::format("warning: the flux map is not this machine's, or the iron has changed: {} is {:.3g} ± "
                                "{:.2g}, expected 1",
                                e.name, e.value, e.sd));
}

}  // namespace

Learned learn_all(const std::vector<Log>& logs, const LearnOptions& options)
{
    check(logs, options);
    if (options.heldout_row != nullptr && options.heldout_row->size() != all_rows(logs))
        throw std::invalid_argument("not one mark for each row of what is held out");
    LearnOptions those = options;
    those.inputs = learnable(options.inputs);
    const std::size_t dead_time = place_of_dead_time(those.inputs);
    const bool any_width = dead_time < those.inputs.size() && those.inputs[dead_time].shape.empty();
    Learned learned = any_width ? over_widths(logs, those) : learn_those(logs, those);
    const bool said = options.allow_for_hidden_loss && may_hide_a_loss(logs, those.inputs) &&
                      allow_for_hidden_loss(logs, those, learned);
    if (options.allow_for_hidden_loss && logs.front().regime == Regime::dynamic && learned.model.pole_pairs > 0.0) {
        const bool loss = dead_time < those.inputs.size();
        hold_beside_a_fit(logs, those.inputs.size() == (loss ? 1 : 0), loss, said, learned);
    }
    note_weights(learned);
    for (const std::string& note : notes_on_others(options.inputs)) learned.result.notes.push_back(note);
    return learned;
}

double told_loss_V(const Learned& learned)
{
    constexpr double kTold = 3.0;  // deviations
    for (const TraceEffect& effect : learned.effects)
        if (const Estimate* e = effect.name == "dead_time" ? find_estimate(effect.parameters, "voltage_V") : nullptr)
            return std::abs(e->value) > kTold * e->sd ? e->value : 0.0;
    return 0.0;
}

Result learn(const std::vector<Log>& logs, const LearnOptions& options) { return learn_all(logs, options).result; }

}  // namespace dqw
