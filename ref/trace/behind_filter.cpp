#include "ref/trace/behind_filter.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "ref/fit/explain.hpp"
#include "ref/trace/confidence.hpp"
#include "ref/trace/firmware_filter.hpp"
#include "ref/trace/rules.hpp"
#include "ref/trace/sampled_instant.hpp"

namespace dqw {
namespace {

/// Whether what was named may stand in for a filter of the currents.
bool is_late(const TraceEffect& e)
{
    return e.name == "delay" || e.name == "sample_shift" || (e.name == "sensor_lag" && e.channel == "currents");
}

double rows_of(const Refined& r) { return std::accumulate(r.left.rows.begin(), r.left.rows.end(), 0.0); }

/// Log-likelihood of a row, the mean: a long log's is that of a part of its rows.
double nats_each(const Refined& r) { return (r.left.seen + r.left.heldout) / rows_of(r); }

/// What a filter has to reach beside what was found.
double likelier(const Refined& r) { return nats_each(r) + kLeastNats / rows_of(r); }

/// And beside the plain machine, where nothing else is known.
double far_likelier(const Refined& plain)
{
    constexpr double kEach = 0.4;  // nats: of what is left on both axes the square a third less
    return nats_each(plain) + kEach;
}

/// Late rows of the filter that makes the currents as logged likeliest beside the plain machine, of some; 0 where none
/// makes them likelier than `most`.
double likeliest_rows(const std::vector<Log>& logs, double pole_pairs, const Point& plain, double most)
{
    constexpr double kTried[] = {0.5, 1.0, 2.0, 4.0, 8.0};
    double best = 0.0;
    for (const bool stator : {false, true})
        for (const double rows : kTried) {
            const double nats = nats_each_beside(logs, pole_pairs, plain, {rows, 0.0, stator});
            if (nats > most) most = nats, best = rows;
        }
    return best;
}

/// Effects of a trace but for what each drive's sampling has.
std::size_t effects_of(const Traced& t)
{
    const auto counts = [&t](const TraceEffect& e) {
        const bool late = e.name == name_of(Law::sample_shift) || e.name == name_of(Law::sensor_lag);
        return !late || !may_be_sampling(t.best.point, e.name);
    };
    return static_cast<std::size_t>(std::count_if(t.result.effects.begin(), t.result.effects.end(), counts));
}

/// Whether a trace finds the plain machine, but for what each drive's sampling has.
bool is_plain(const Traced& t)
{
    return t.result.verdict == "clean" || (t.result.verdict == "explained" && effects_of(t) == 0);
}

/// Whether the plain machine alone makes the currents from before some filter far likelier than those as logged.
bool may_be_filtered(const std::vector<Log>& logs, const TraceSetup& setup)
{
    if (!setup.pole_pairs_known) return false;
    constexpr int kPasses = 12;
    const Refined plain = refine_gains(setup.search(), setup.starts.front(), kPasses);
    return plain.ok && likeliest_rows(logs, setup.pole_pairs, plain.point, far_likelier(plain)) > 0.0;
}

/// Whether all that is late and all that iron or a short takes of the currents together make a row of them `nats`
/// likely: where they do not, no name or two of these does.
bool is_late_as_well(const std::vector<Log>& logs, double pole_pairs, const Point& plain, double nats)
{
    std::vector<std::string> names;
    for (const Law law : {Law::delay, Law::sample_shift, Law::sensor_lag, Law::iron_loss, Law::turn_short})
        names.emplace_back(name_of(law));
    const std::unique_ptr<TraceSetup> setup = trace_setup(logs, names, Variant::usual, pole_pairs);
    const Model& model = setup->search();
    constexpr int kPasses = 6;
    Refined best = swept_seen(model, plain);
    const Candidate* taken = nullptr;
    for (const Candidate& c : setup->candidates) {
        Point one = plain;
        for (const Input& i : c.inputs) one.terms.push_back({i, {}});
        Refined r = refine_gains(model, one, kPasses);
        if (r.ok && nats_each(r) > nats) return true;
        if (r.ok && r.left.seen > best.left.seen) best = std::move(r), taken = &c;
    }
    Point all = best.point;
    for (const Candidate& c : setup->candidates)
        for (const Input& i : c.inputs)
            if (&c != taken) all.terms.push_back({i, {}});
    const Refined r = refine(model, all, 2 * kPasses);
    return !r.ok || nats_each(r) > nats;
}

bool is_explained(const Traced& t) { return t.result.verdict == "clean" || t.result.verdict == "explained"; }

/// The catalogue, or what of it is asked for, but for one.
TraceOptions but_for(TraceOptions options, const std::string& name)
{
    std::vector<std::string>& names = options.effects;
    if (names.empty())
        for (const Effect& e : effects()) names.emplace_back(e.name);
    names.erase(std::remove(names.begin(), names.end(), name), names.end());
    return options;
}

/// In place of a loss or a short that takes no more of the currents than a converter and its amplifier leave, which the
/// noise that the filter is undone with hardly tells from these: the trace without it, where that explains the log by
/// fewer effects. (E196)
Traced but_for_sampling(Traced before, TraceOptions options, const std::function<Traced(const TraceOptions&)>& of)
{
    std::vector<TraceRejected> gone;
    for (const Law law : {Law::iron_loss, Law::turn_short}) {
        const std::string name = name_of(law);
        const auto is_it = [&name](const TraceEffect& e) { return e.name == name; };
        const auto& named = before.result.effects;
        if (std::none_of(named.begin(), named.end(), is_it) || !may_be_sampling(before.best.point, name)) continue;
        const TraceOptions less = but_for(options, name);
        Traced other = of(less);
        if (!is_explained(other) || effects_of(other) >= effects_of(before)) continue;
        gone.push_back({name, "what it takes is a converter's own", before.result.after.heldout_rms});
        options = less;
        before = std::move(other);
    }
    before.result.rejected.insert(before.result.rejected.end(), gone.begin(), gone.end());
    return before;
}

/// Of logs whose currents firmware has filtered, the trace of those from before, with the filter as its first effect.
/// `alone`: where nothing else is found.
std::optional<TraceResult> behind_filter(const std::vector<Log>& logs, const TraceOptions& options,
                                         const TraceOf& trace_of, const Traced& as_is, bool alone)
{
    const TraceResult& was = as_is.result;
    if (!(as_is.pole_pairs > 0.0) || !as_is.plain.ok || was.verdict == "clean") return {};
    const bool named = !was.effects.empty();
    // A name that is late stands alone where it leaves noise: a filter's own is in single rows, and not in blocks.
    constexpr double kFiltered = 0.7;
    const auto late = std::count_if(was.effects.begin(), was.effects.end(), is_late);
    if (named && late < 2 && (late == 0 || !(was.after.heldout_rms < kFiltered * was.noise_floor))) return {};
    double most = likelier(as_is.best);
    if (!named) most = std::min(most, far_likelier(as_is.plain));
    const double rows = likeliest_rows(logs, as_is.pole_pairs, as_is.plain.point, most);
    const bool sampling = is_asked(options, Law::sample_shift);
    std::optional<FilterFit> filter;
    if (rows > 0.0) filter = fit_filter(logs, as_is.pole_pairs, as_is.plain.point, rows, sampling);
    if (!filter) return {};
    const auto before_it = [&](const TraceOptions& by) {
        return trace_of(before_filter(logs, as_is.pole_pairs, filter->filter), by);
    };
    if (alone &&
        (!is_plain(before_it(with_effect(options, Law::sample_shift))) ||
         is_late_as_well(logs, as_is.pole_pairs, as_is.plain.point, filter->nats_each - kLeastNats / filter->rows)))
        return {};
    Traced before = but_for_sampling(before_it(options), options, before_it);
    if (alone && effects_of(before) > 0) return {};
    if (effects_of(before) > 0) {
        // What else there is moves the filter's rows.
        const FirmwareFilter first = filter->filter;
        filter = fit_filter(logs, as_is.pole_pairs, before.best.point, first.rows, sampling);
        if (!filter) return {};
        if (filter->filter.stator != first.stator || std::abs(filter->filter.rows - first.rows) > filter->filter.sd)
            before = but_for_sampling(before_it(options), options, before_it);
    }
    // All of it, and as many effects as before or fewer, of which the filter is one.
    if (!is_explained(before) ||
        (named && (effects_of(before) + 1 > effects_of(as_is) || !(filter->nats_each > likelier(as_is.best)))))
        return {};
    TraceResult out = std::move(before.result);
    const double dt_s = logs.front().dt_s;
    TraceEffect lag;
    lag.name = name_of(Law::sensor_lag), lag.channel = "currents";
    Estimate tau{"tau_s", filter->filter.rows * dt_s, filter->filter.sd * dt_s};
    const double told_s = tau.sd;
    // What a converter leaves at most, or eddies as small, which nothing tells from it: an even spread from none on.
    tau.sd = std::hypot(tau.sd, kSampling_s / std::sqrt(3.0));
    const double wider = told_s > 0.0 ? tau.sd / told_s : 1.0;
    for (std::size_t k = out.effects.size(); k-- > 0;) {
        if (out.effects[k].name != lag.name) continue;
        // An amplifier's before the firmware's is one lag with it; one of the speed is another.
        if (out.effects[k].channel != lag.channel) return {};
        tau.value += out.effects[k].parameters.front().value;
        tau.sd = std::hypot(tau.sd, out.effects[k].parameters.front().sd);
        out.effects.erase(out.effects.begin() + static_cast<std::ptrdiff_t>(k));
    }
    lag.parameters.push_back(tau);
    lag.heldout_rms_after = out.before.heldout_rms;
    const double part = part_of_rest(was.before.heldout_rms, out.after.heldout_rms, out.noise_floor);
    lag.confidence = confidence_of({lag.name, {}, 0, {HUGE_VAL, HUGE_VAL, HUGE_VAL}, {}, {}}, part);
    for (Estimate& p : out.after.parameters)
        for (Eigen::Index j = 0; j < filter->moves.size(); ++j)
            if (p.name == as_is.base_names[static_cast<std::size_t>(j)])
                p.sd = std::hypot(p.sd, wider * filter->moves[j], filter->frames[j]);
    for (std::size_t c = 0; c < out.blocks.axes.size(); ++c)
        out.blocks.axes[c].residual_before = was.blocks.axes[c].residual_before;
    for (std::size_t c = 0; c < out.blocks.spectra.size() && c < was.blocks.spectra.size(); ++c)
        out.blocks.spectra[c].before = was.blocks.spectra[c].before,
        out.blocks.spectra[c].before_at = was.blocks.spectra[c].before_at;
    out.effects.insert(out.effects.begin(), std::move(lag));
    out.before = was.before, out.structure = was.structure;
    if (out.verdict == "clean") out.verdict = "explained";
    out.rejected.erase(std::remove_if(out.rejected.begin(), out.rejected.end(),
                                      [](const TraceRejected& r) { return r.name == name_of(Law::sensor_lag); }),
                       out.rejected.end());
    out.notes.push_back("sensor lag: the currents' filter is firmware's, y += (i - y)/(1 + n) of the " +
                        std::string(filter->filter.stator ? "stator's" : "rotor's") +
                        " axes, n = " + figure(filter->filter.rows) +
                        "; what is told of other effects, and of what is left, is of the currents before it");
    return out;
}

}  // namespace

bool is_asked(const TraceOptions& options, Law law)
{
    const std::vector<std::string>& only = options.effects;
    return only.empty() || std::find(only.begin(), only.end(), name_of(law)) != only.end();
}

TraceOptions without_effects(TraceOptions options)
{
    options.effects = {name_of(Law::coulomb_friction)};  // none of a log that has voltages
    return options;
}

TraceOptions with_effect(const TraceOptions& options, Law law)
{
    TraceOptions out = without_effects(options);
    if (is_asked(options, law)) out.effects = {name_of(law)};
    return out;
}

TraceResult trace_behind_filter(const std::vector<Log>& logs, const TraceOptions& options, const TraceOf& trace_of,
                                const TraceSetup& plain)
{
    if (!is_asked(options, Law::sensor_lag) || logs.front().regime != Regime::dynamic)
        return trace_of(logs, options).result;
    // A search for effects beside filtered currents is long, and finds none.
    if (may_be_filtered(logs, plain)) {
        const Traced none = trace_of(logs, without_effects(options));
        if (std::optional<TraceResult> filtered = behind_filter(logs, options, trace_of, none, true))
            return *std::move(filtered);
    }
    Traced as_is = trace_of(logs, options);
    std::optional<TraceResult> filtered = behind_filter(logs, options, trace_of, as_is, false);
    return filtered ? *std::move(filtered) : std::move(as_is.result);
}

}  // namespace dqw
