#include "ref/trace/behind_filter.hpp"

#include <algorithm>
#include <cmath>

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

/// Log-likelihood of all rows.
double nats_of(const Refined& r) { return r.left.seen + r.left.heldout; }

/// Of a log whose currents may be filtered, the filter that is likeliest beside the plain machine: that which the reading
/// shows, or one that leaves more likely currents than what was found.
std::optional<FilterFit> filter_of(const std::vector<Log>& logs, const Traced& as_is)
{
    const Point& start = as_is.plain.point;
    if (as_is.reading && as_is.reading->kind == Reading::Kind::filter)
        return fit_filter(logs, as_is.pole_pairs, start, as_is.reading->late_rows);
    constexpr double kTried[] = {0.5, 1.0, 2.0, 4.0};
    double best = 0.0, most = nats_of(as_is.best) + kLeastNats;
    for (const bool stator : {false, true})
        for (const double rows : kTried) {
            const double nats = nats_beside(logs, as_is.pole_pairs, start, {rows, 0.0, stator});
            if (nats > most) most = nats, best = rows;
        }
    return best > 0.0 ? fit_filter(logs, as_is.pole_pairs, start, best) : std::nullopt;
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

/// Whether a reading of the logs as they stand says so, by more rows than an effect is late.
bool may_be_filtered(const std::vector<Log>& logs, const TraceOptions& options)
{
    const std::unique_ptr<TraceSetup> setup = trace_setup(logs, {name_of(Law::coulomb_friction)}, Variant::usual,
                                                          options.pole_pairs);
    const std::optional<Reading> reading = other_reading(*setup);
    constexpr double kNoShift = 2.5;  // rows; by less a shift or a delay may be what it is
    return reading && reading->kind == Reading::Kind::filter && reading->late_rows > kNoShift;
}

/// Of logs whose currents firmware has filtered, the trace of those from before, with the filter as its first effect.
/// `alone`: where nothing else is found.
std::optional<TraceResult> behind_filter(const std::vector<Log>& logs, const TraceOptions& options,
                                         const TraceOf& trace_of, Traced& as_is, bool alone)
{
    const TraceResult& was = as_is.result;
    if (!(as_is.pole_pairs > 0.0) || !as_is.plain.ok || was.verdict == "clean") return {};
    const bool named = !was.effects.empty();
    // A name that is late stands alone where it leaves noise: a filter's own is in single rows, and not in blocks.
    constexpr double kFiltered = 0.7;
    const auto late = std::count_if(was.effects.begin(), was.effects.end(), is_late);
    if (named && late < 2 && (late == 0 || !(was.after.heldout_rms < kFiltered * was.noise_floor))) return {};
    std::optional<FilterFit> filter = filter_of(logs, as_is);
    if (!filter) return {};
    Traced before = trace_of(before_filter(logs, as_is.pole_pairs, filter->filter), options);
    const auto is_explained = [&before] {
        return before.result.verdict == "clean" || before.result.verdict == "explained";
    };
    as_is.may_filter = is_explained();
    if (alone && (!is_explained() || effects_of(before) > 0)) return {};
    if (effects_of(before) > 0) {
        // What else there is moves the filter's rows.
        const FirmwareFilter first = filter->filter;
        filter = fit_filter(logs, as_is.pole_pairs, before.best.point, first.rows);
        if (!filter) return {};
        if (filter->filter.stator != first.stator || std::abs(filter->filter.rows - first.rows) > filter->filter.sd)
            before = trace_of(before_filter(logs, as_is.pole_pairs, filter->filter), options);
    }
    // All of it, and as many effects as before or fewer, of which the filter is one.
    if (!is_explained() ||
        (named && (effects_of(before) + 1 > effects_of(as_is) || !(filter->nats > nats_of(as_is.best) + kLeastNats))))
        return {};
    TraceResult out = std::move(before.result);
    const double dt_s = logs.front().dt_s;
    TraceEffect lag;
    lag.name = name_of(Law::sensor_lag), lag.channel = "currents";
    Estimate tau{"tau_s", filter->filter.rows * dt_s, filter->filter.sd * dt_s};
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
            if (p.name == as_is.base_names[static_cast<std::size_t>(j)]) p.sd = std::hypot(p.sd, filter->moves[j]);
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

TraceResult trace_behind_filter(const std::vector<Log>& logs, const TraceOptions& options, const TraceOf& trace_of)
{
    const std::vector<std::string>& only = options.effects;
    const bool asked = only.empty() || std::find(only.begin(), only.end(), name_of(Law::sensor_lag)) != only.end();
    bool may_filter = asked && logs.front().regime == Regime::dynamic;
    // A search for effects beside filtered currents is long, and finds none: where the plain machine's reading says
    // that they are, those from before are traced first.
    if (may_filter && may_be_filtered(logs, options)) {
        TraceOptions without = options;
        without.effects = {name_of(Law::coulomb_friction)};  // none of a log that has voltages
        Traced plain = trace_of(logs, without);
        if (std::optional<TraceResult> filtered = behind_filter(logs, options, trace_of, plain, true))
            return *std::move(filtered);
        may_filter = plain.may_filter;
    }
    Traced as_is = trace_of(logs, options);
    std::optional<TraceResult> filtered;
    if (may_filter) filtered = behind_filter(logs, options, trace_of, as_is, false);
    return filtered ? *std::move(filtered) : std::move(as_is.result);
}

}  // namespace dqw
