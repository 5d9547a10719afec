#include "ref/trace/named.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "ref/effect/effect.hpp"
#include "ref/fit/explain.hpp"
#include "ref/fit/fit.hpp"
#include "ref/fit/publish.hpp"
#include "ref/trace/determined.hpp"
#include "ref/trace/inverter_loss.hpp"
#include "ref/trace/predicts.hpp"
#include "ref/trace/rest.hpp"
#include "ref/trace/result.hpp"
#include "ref/trace/sense.hpp"
#include "ref/trace/shapes.hpp"
#include "ref/trace/state.hpp"

namespace dqw {
namespace {

using Names = std::vector<std::string>;

bool has(const Names& names, const std::string& name)
{
    return std::find(names.begin(), names.end(), name) != names.end();
}

struct Fitted {
    std::unique_ptr<TraceSetup> setup;
    Refined refined;
    std::vector<ReportBlock> blocks;
    double rms = HUGE_VAL;
};

Fitted fitted(const std::vector<Log>& logs, const Names& effects, bool averaged, const std::function<void()>& tick)
{
    Fitted out;
    out.setup = trace_setup(logs, effects, averaged ? Variant::averaged : Variant::usual);
    out.refined = fit_named(*out.setup, effects, tick);
    if (!out.refined.ok)
        throw std::invalid_argument(
            logs.front().path + ": a sampling period spans many time constants of the machine; is this log steady?");
    out.blocks = out.setup->full->report(out.refined.point, 0);
    out.rms = rms_of(out.blocks, out.setup->full->channels());
    return out;
}

/// Of a mechanical log, the averaged model where the predicting one does not hold of means, as in a trace.
Fitted fitted(const std::vector<Log>& logs, const Names& effects, const std::function<void()>& tick)
{
    Fitted predicted = fitted(logs, effects, false, tick);
    if (predicted.setup->regime != Regime::mechanical) return predicted;
    Fitted averaged = fitted(logs, effects, true, tick);
    if (predicts_means(*averaged.setup, averaged.refined, predicted.refined.point)) return predicted;
    averaged.setup->notes.push_back("prediction does not hold of the torque's means; fitted to these");
    return averaged;
}

void check_effects(const std::vector<Log>& logs, const Names& effects)
{
    const bool mechanical = logs.front().regime == Regime::mechanical;
    for (const std::string& name : effects) {
        const Effect* effect = find_effect(name);
        if (effect == nullptr) throw std::invalid_argument("unknown effect " + name);
        if (effect->mechanical() != mechanical)
            throw std::invalid_argument(logs.front().path + ": " + name + " is of " +
                                        (effect->mechanical() ? "a mechanical" : "an electrical") +
                                        " log; this one is " + (mechanical ? "mechanical" : "electrical"));
    }
}

/// Parameters that the joint fit has columns for.
Names joint_parameters(const TraceSetup& setup)
{
    if (setup.regime == Regime::standstill) return {"R_ohm"};
    return setup.full->base_names();
}

/// What was asked for and no effect bears on, as the plain fit has it.
void take_plain(const std::vector<Log>& logs, const Names& asked, Result& result)
{
    FitOptions options;
    options.parameters = asked;
    const Result plain = fit(logs, options);
    for (const Estimate& e : plain.parameters)
        if (has(asked, e.name)) result.parameters.push_back(e);
    for (const NotIdentifiable& n : plain.not_identifiable)
        if (has(asked, n.name)) result.not_identifiable.push_back(n);
}

void put_parameters(const std::vector<Log>& logs, const Fitted& f, const Determined& determined, Names asked,
                    Result& result)
{
    const TraceSetup& setup = *f.setup;
    const Names joint = joint_parameters(setup);
    if (asked.empty()) asked = joint;
    const bool electrical = setup.regime != Regime::mechanical,
               turns = electrical && setup.regime != Regime::standstill;
    Task task{logs, asked, {}, {}, {}};
    for (std::size_t j = 1; turns && !setup.pole_pairs_known && j < joint.size(); ++j)
        if (determined.base[j].verdict == Verdict::determined)
            withhold_product(task, joint[j], determined.base[j].value, determined.base[j].sd, result);
    for (std::size_t j = 0; j < joint.size(); ++j) {
        if (!has(task.asked, joint[j])) continue;
        if (determined.base[j].verdict == Verdict::determined)
            result.parameters.push_back({joint[j], determined.base[j].value, determined.base[j].sd, false});
        else
            result.not_identifiable.push_back(explain(joint[j], determined.base[j], determined.names, logs));
    }
    Names others;
    for (const std::string& name : task.asked)
        if (!has(joint, name) && !(name == "pole_pairs" && turns && setup.pole_pairs_known)) others.push_back(name);
    if (turns && setup.pole_pairs_known)
        result.parameters.push_back({"pole_pairs", setup.pole_pairs, 0.0, logs.front().machine.pole_pairs.has_value()});
    if (!others.empty()) take_plain(logs, others, result);
}

void put_effect(const Fitted& f, const Determined& determined, const std::string& name, EffectFit& out)
{
    TraceEffect effect;
    effect.name = name;
    effect.heldout_rms_after = std::nan("");
    put_channel(*f.setup, f.refined.point, effect);
    std::string values;
    for (const Estimate& e : effect_parameters(*f.setup, f.refined.point, determined.sd, name)) {
        if (!e.given)
            values += (values.empty() ? "" : ", ") + e.name +
                      (std::isfinite(e.sd) ? " " + figure(e.value) + " with a standard deviation of " + figure(e.sd)
                                           : " cannot be told");
        if (e.given || std::isfinite(e.sd)) effect.parameters.push_back(e);
    }
    if (determined.knows(f.refined.point, name))
        out.effects.push_back(effect);
    else
        out.result.not_identifiable.push_back(
            {name, "none of its weights stands out (it stayed in the fit): " + values, find_effect(name)->separate});
}

void put_notes(const std::vector<Log>& logs, const Fitted& f, bool all_told, Result& result)
{
    result.notes = f.setup->notes;
    std::size_t gaps = 0;
    for (const Log& log : logs) gaps += log.segments.empty() ? 0 : log.segments.size() - 1;
    if (gaps > 0 && f.setup->full->gains() > 0)
        result.notes.push_back(std::to_string(gaps) + " gap" + (gaps > 1 ? "s" : "") +
                               " in time: the simulation starts anew after each");
    // What is not told apart has no value to make sense.
    const std::string nonsense = sense_of(*f.setup, f.refined.point);
    if (!nonsense.empty() && all_told)
        result.notes.push_back("warning: this explanation makes no physical sense: " + nonsense);
    const Eigen::VectorXd& gain = f.refined.point.gain;
    if (gain.size() == 2)
        result.notes.push_back("correction gain of the currents: d " + figure(gain[0]) + ", q " + figure(gain[1]));
    if (gain.size() == 1) result.notes.push_back("correction gain of the speed: " + figure(gain[0]));
}

}  // namespace

EffectFit fit_effects(const std::vector<Log>& logs, const std::vector<std::string>& effects,
                      const std::vector<std::string>& parameters, std::function<void(double)> progress)
{
    if (logs.empty()) throw std::invalid_argument("no log to fit");
    if (effects.empty()) return {fit(logs, {parameters, std::move(progress)}), {}};
    check_effects(logs, effects);
    Names names;
    for (const std::string& name : effects)
        if (!has(names, name)) names.push_back(name);
    int ticks = 0;
    const Fitted f = fitted(logs, names, [&] {
        ++ticks;  // of how many is not known: half of it after ten
        if (progress) progress(0.95 * ticks / (ticks + 10.0));
    });
    Determined determined = determined_of(*f.setup, f.refined);
    determined.widen(spread_over_laws(*f.setup, f.refined) + spread_over_states(*f.setup, f.refined));

    EffectFit out;
    Result& result = out.result;
    for (const Log& log : logs) result.rows += log.rows();
    result.regime = f.setup->regime;
    result.residual_rms = f.rms;
    result.residual_unit = result.regime == Regime::mechanical ? "Nm" : "V";
    result.axes = axes_of(*f.setup, f.blocks);
    put_parameters(logs, f, determined, parameters, result);
    for (const std::string& name : names) put_effect(f, determined, name, out);
    put_notes(logs, f, out.effects.size() == names.size(), result);
    if (progress) progress(1.0);
    return out;
}

std::optional<NamedLook> look_at_named(const std::vector<Log>& logs, const Names& effects, double pole_pairs)
{
    constexpr std::size_t kRows = 20000, kWindow = 1000, kLeast = 100;
    const std::vector<Piece> pieces = pieces_of(logs, kLeast);
    if (rows_of(pieces) < kWindow) return {};
    std::vector<Log> windows = copies_of(spread_sample(pieces, kRows, kWindow));
    for (Log& log : windows) log.machine.pole_pairs = pole_pairs;
    std::unique_ptr<TraceSetup> setup;
    try {
        setup = trace_setup(windows, effects, Variant::usual);
    } catch (const std::invalid_argument&) {
        return {};
    }
    const Refined refined = fit_named(*setup, effects, {});
    if (!refined.ok || refined.point.base.size() != 4 || !(refined.point.base.head(3).minCoeff() > 0.0)) return {};
    const Replanned all(*setup->full, all_seen(*setup->full));
    return NamedLook{refined.point.base, deviations(all, refined).head(4)};
}

}  // namespace dqw
