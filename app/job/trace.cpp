#include "app/job/trace.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/base/parameters.hpp"
#include "app/base/progress.hpp"
#include "app/base/text.hpp"
#include "app/job/logs.hpp"
#include "app/learn/trace.hpp"
#include "app/report/compare.hpp"
#include "app/report/sense.hpp"
#include "ref/effect/effect.hpp"
#include "ref/fit/polled_points.hpp"

namespace dqw {
namespace {

/// What a look of many turns and of some seconds tells. Iron's loss turns the voltage as the delay does that is taken
/// out of polled rows, and comes out several times too small.
constexpr const char* kOfLooks[] = {"saturation",         "cross_saturation", "winding_temperature",
                                    "magnet_temperature", "dead_time",        "voltage_scale"};

/// Polled logs as looks of settled points, and what that is said of them.
std::vector<Log> looks_of(const std::vector<Log>& logs, std::vector<std::string>& notes)
{
    PolledPoints points = with_logs(logs, [&] { return polled_points(logs); });
    if (points.looks < kLeastLooks)
        throw InputError(logs.front().path, 1,
                         fmt::format("a polled log with {} settled at points of their own; a trace needs at least {}: "
                                     "a longer log, or more currents and speeds (fit takes this one)",
                                     counted(points.looks, "look"), kLeastLooks));
    notes.push_back(fmt::format("polled: traced in {} of settled rows, each of one operating point and of {:g} s at "
                                "most; of such a log only {} are told, all else leaves the same in their means, and "
                                "iron_loss the same as a delay",
                                counted(points.looks, "look"), points.look_s,
                                list({std::begin(kOfLooks), std::end(kOfLooks)})));
    return std::move(points.logs);
}

/// The effects to try; none: all that there are.
std::vector<std::string> tried(const std::vector<Log>& logs, const Options& options)
{
    const bool mechanical = logs.front().regime == Regime::mechanical;
    for (const std::string& name : options.effects)
        if (const Effect* effect = find_effect(name); effect && effect->mechanical() != mechanical)
            throw InputError(logs.front().path, 1,
                             fmt::format("{} is of {} log; this one is {}", name,
                                         effect->mechanical() ? "a mechanical" : "an electrical",
                                         mechanical ? "mechanical" : "electrical"));
    if (!logs.front().of_polled) return options.effects;
    std::vector<std::string> told(std::begin(kOfLooks), std::end(kOfLooks));
    if (options.effects.empty()) return told;
    for (const std::string& name : options.effects)
        if (std::find(told.begin(), told.end(), name) == told.end())
            throw InputError(logs.front().path, 1,
                             fmt::format("a polled log: it tells no {}; expected {}", name, list(told)));
    return options.effects;
}

/// An effect that was named and whose size may as well be nothing; "" where there is none.
std::string untold_of(const TraceResult& result)
{
    constexpr double kTold = 2.0;  // deviations
    // Neighbouring powers of a saturation are alike: none may stand out where all together do.
    const auto bends = [](const TraceEffect& e) { return e.name == "saturation" || e.name == "cross_saturation"; };
    for (const TraceEffect& e : result.effects)
        if (!bends(e) && !e.parameters.empty() &&
            !(std::abs(e.parameters.front().value) > kTold * e.parameters.front().sd))
            return e.name;
    return "";
}

TraceResult traced(const std::vector<Log>& logs, const Options& options)
{
    TraceOptions how;
    how.effects = tried(logs, options);
    Progress progress("tracing", options.progress);
    how.progress = progress.callback();
    return with_logs(logs, [&] {
        std::vector<std::string> untold;
        for (;;) {
            TraceResult result = trace(logs, how);
            const std::string name = logs.front().of_polled ? untold_of(result) : "";
            if (name.empty() || how.effects.size() == 1) {
                if (!untold.empty())
                    result.notes.push_back(list(untold) + " would be found, its size is not told: left out");
                return result;
            }
            untold.push_back(name);
            how.effects.erase(std::find(how.effects.begin(), how.effects.end(), name));
        }
    });
}

/// Points stand as their rows were turned and freed of L di/dt: what that leaves open no point shows.
void allow_for_rows(const Log& log, std::vector<Estimate>& parameters)
{
    constexpr const char* kNames[] = {"R_ohm", "Ld_H", "Lq_H", "psi_Wb"};
    for (Estimate& e : parameters)
        for (std::size_t k = 0; k < log.rows_sd.size(); ++k)
            if (e.name == kNames[k]) e.sd = std::max(e.sd, log.rows_sd[k]);
}

/// Of the same rows nobody knows more than the reference, which allows for what hides in them; and where the two differ
/// by more than both deviations allow, one of them is wrong. (E187)
void hold_beside(const std::vector<Estimate>& reference, std::vector<Estimate>& learned)
{
    constexpr double kBeyond = 3.0;
    for (Estimate& e : learned) {
        const Estimate* r = find_estimate(reference, e.name);
        if (!r || r->given || e.given || !std::isfinite(r->sd)) continue;
        const double by = r->value - e.value;
        if (std::abs(by) > kBeyond * std::hypot(r->sd, e.sd)) e.sd = std::hypot(e.sd, by);
        e.sd = std::max(e.sd, r->sd);
    }
}

/// The learners on the same rows; where they can tell nothing, their residual says nothing.
void learn_as_well(const std::vector<Log>& logs, TraceReport& report)
{
    try {
        report.learner_before = learn_fit(logs, report.trace, false);
        report.learner_after = learn_fit(logs, report.trace, true);
        allow_for_rows(logs.front(), report.learner_before->parameters);
        allow_for_rows(logs.front(), report.learner_after->parameters);
        const auto& learned = report.learner_after->parameters;
        if (std::any_of(learned.begin(), learned.end(), [](const Estimate& e) { return !e.given; })) {
            for (const std::string& note :
                 disagreements(learned, "the learners", report.trace.after.parameters, "the reference"))
                report.trace.notes.push_back(note);
            hold_beside(report.trace.before.parameters, report.learner_before->parameters);
            hold_beside(report.trace.after.parameters, report.learner_after->parameters);
            return;
        }
        report.trace.notes.emplace_back("no learners: this log determines none of their parameters");
    } catch (const std::invalid_argument& error) {
        // The trace holds without them.
        report.trace.notes.push_back(std::string("no learners: ") + error.what());
    }
    report.learner_before.reset();
    report.learner_after.reset();
}

}  // namespace

std::vector<Log> logs_to_trace(const Options& options, std::vector<std::string>& notes)
{
    std::vector<Log> logs = read_logs(options.logs, options, true, notes, false, true);
    if (logs.front().regime == Regime::polled) return looks_of(logs, notes);
    return logs;
}

TraceReport trace_logs(const std::vector<Log>& logs, const Options& options, const std::vector<std::string>& notes)
{
    TraceReport report;
    report.logs = options.logs;
    report.trace = traced(logs, options);
    allow_for_rows(logs.front(), report.trace.before.parameters);
    allow_for_rows(logs.front(), report.trace.after.parameters);
    report.trace.notes.insert(report.trace.notes.begin(), notes.begin(), notes.end());
    learn_as_well(logs, report);
    std::vector<std::vector<Estimate>*> all = {&report.trace.before.parameters, &report.trace.after.parameters};
    for (auto* learned : {&report.learner_before, &report.learner_after})
        if (*learned) all.push_back(&(*learned)->parameters);
    std::string slip;
    for (auto* parameters : all) {
        slip = allow_for_slip(logs, *parameters);
        for (Estimate& e : *parameters) {
            e.observed = !e.given && !why_observed(logs.front().observed, e.name).empty();
            if (e.observed) e.sd = INFINITY;
        }
    }
    if (!slip.empty() && report.trace.doubt.empty()) report.trace.notes.push_back(slip);
    return report;
}

}  // namespace dqw
