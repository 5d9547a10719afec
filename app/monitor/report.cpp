#include "app/monitor/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "app/base/quantity.hpp"
#include "app/base/text.hpp"
#include "app/monitor/names.hpp"
#include "app/monitor/notes.hpp"
#include "dqw_text.h"

namespace dqw {
namespace {

using Json = nlohmann::ordered_json;

/// Single precision's digits, without those that come of writing it as a double.
Json number(double x)
{
    if (!std::isfinite(x)) return nullptr;
    return std::strtod(fmt::format("{:.7g}", x).c_str(), nullptr);
}

/// By this part of itself, and by so many deviations, a value learned anew is another one.
constexpr double kMoved = 0.03, kDeviations = 5.0;

/// The prefix of the largest of value, deviation and healthy value.
Quantity prefix_of(const char* name, const MonitorReading& r)
{
    double most = 0.0;
    for (const double x : {r.value, r.sd, r.healthy})
        if (std::isfinite(x)) most = std::max(most, std::fabs(x));
    return quantity(name, most, 0.0);
}

std::string in_unit(const char* name, const MonitorReading& r, double value, double sd)
{
    return std::isfinite(value) ? with_minus(with_sd(quantity_like(prefix_of(name, r), name, value, sd))) : "–";
}

std::string now_text(const char* name, const MonitorReading& r) { return in_unit(name, r, r.value, r.sd); }

/// With the decimals of the deviation, and without it.
std::string healthy_text(const char* name, const MonitorReading& r)
{
    if (!std::isfinite(r.healthy)) return "–";
    Quantity q = quantity_like(prefix_of(name, r), name, r.healthy, r.sd);
    q.sd.clear();
    return with_minus(with_sd(q));
}

/// Where the healthy value is not about zero.
bool has_percent(int channel)
{
    return dqw_watch_is_part(channel) || channel == DQW_WATCH_DEAD_TIME || channel == DQW_WATCH_FRICTION ||
           channel == DQW_WATCH_RESIDUAL;
}

std::string changed(int channel, const MonitorReading& r)
{
    if (!has_percent(channel) || !std::isfinite(r.value) || !(r.healthy > 0.0) || r.healthy < kDeviations * r.sd)
        return "";
    const double percent = 100.0 * (r.value / r.healthy - 1.0);
    if (percent > 1000.0) return fmt::format("{:.0f} times", r.value / r.healthy);
    return std::fabs(percent) < 0.05 ? "0 %" : with_minus(fmt::format("{:+.1f} %", percent));
}

/// A flux map's weights are nobody's matter where there is no map.
bool concerns(int channel, const MonitorSight& sight)
{
    return !dqw_watch_is_map(channel) || sight.why != DQW_WHY_NOT_ASKED;
}

/// The smallest change that would be told; of temperature and residual the limit.
std::string told_from(int channel, const char* name, const MonitorSights& sights)
{
    const double least = sights[static_cast<std::size_t>(channel)].least;
    if (!std::isfinite(least)) return "–";
    const bool limit = channel == DQW_WATCH_TEMPERATURE || channel == DQW_WATCH_RESIDUAL;
    Quantity q = quantity(name, least, 0.1 * least);
    q.sd.clear();
    return (limit ? "above " : "±") + with_sd(q);
}

std::string refused_text(const MonitorRun& run)
{
    const dqw_gate& g = run.end.gate;
    const std::uint32_t samples = g.nonfinite + g.saturated + g.stale;
    std::string out = samples == 0 ? "no sample"
                                   : fmt::format("{}: {} not finite, {} beyond ten times their base, {} stuck",
                                                 counted(samples, "sample"), g.nonfinite, g.saturated, g.stale);
    if (g.incomplete > 0) out += fmt::format("; {} incomplete", counted(g.incomplete, "block"));
    return out;
}

std::string stage_text(const MonitorRun& run)
{
    const MonitorStage& last = run.stages.back();
    return fmt::format("{}{} {:.3f} s", stage_spoken(last.name),
                       last.name == DQW_STAGE_IN_SERVICE ? " since" : ", from", last.from_s);
}

/// Seconds in service.
double served_s(const MonitorRun& run)
{
    double sum = run.served_before_s;
    for (std::size_t k = 0; k < run.stages.size(); ++k)
        if (run.stages[k].name == DQW_STAGE_IN_SERVICE)
            sum += (k + 1 < run.stages.size() ? run.stages[k + 1].from_s : run.end_s) - run.stages[k].from_s;
    return sum;
}

Json refused_json(const dqw_gate& g)
{
    return {{"not_finite", g.nonfinite},
            {"saturated", g.saturated},
            {"stuck", g.stale},
            {"incomplete_blocks", g.incomplete}};
}

}  // namespace

std::string event_json(const MonitorEvent& e)
{
    Json json = {{"schema", "dqwatch.event/1"},
                 {"t_s", number(e.t_s)},
                 {"parameter", channel_named(e.parameter).parameter},
                 {"value", number(e.reading.value)},
                 {"sd", number(e.reading.sd)},
                 {"fault", dqw_fault_text(e.fault.name)},
                 {"confidence", number(static_cast<double>(e.fault.confidence))},
                 {"since_s", number(e.since_s)},
                 {"healthy", number(e.reading.healthy)}};
    const std::string phase = phase_of(e.fault);
    if (!phase.empty()) json["phase"] = phase;
    return json.dump() + "\n";
}

std::string event_text(const MonitorEvent& e)
{
    const char* name = channel_named(e.parameter).parameter;
    const std::string percent = changed(e.parameter, e.reading);
    return fmt::format("{:.3f} s  {}: {} {}{}{}, since {:.3f} s, confidence {:.2f}\n", e.t_s, fault_spoken(e.fault),
                       name, now_text(name, e.reading),
                       std::isfinite(e.reading.healthy) ? ", healthy " + healthy_text(name, e.reading) : "",
                       percent.empty() ? "" : " (" + percent + ")", e.since_s, e.fault.confidence);
}

std::string sensitivity_json(const MonitorRun& run)
{
    Json channels = Json::object();
    for (int channel = 0; channel < DQW_WATCH_CHANNELS; ++channel) {
        const MonitorSight& s = run.sights[static_cast<std::size_t>(channel)];
        if (!concerns(channel, s)) continue;
        Json& json = channels[channel_named(channel).parameter];
        const bool watched = s.why == DQW_WHY_IN_SERVICE;
        json = {{"least_change", number(s.least)}, {"watched", watched}};
        if (!watched) json["why"] = s.said ? s.said : why_not_watched(channel, s.why);
    }
    return Json{{"schema", "dqwatch.sensitivity/1"}, {"t_s", number(run.sights_s)}, {"parameters", channels}}.dump() +
           "\n";
}

std::string status_json(const MonitorEngine& monitor)
{
    const MonitorState state = monitor.state();
    const MonitorReadings readings = readings_of(monitor.measures());
    const MonitorSights sights = monitor.sights();
    Json channels = Json::object();
    for (int channel = 0; channel < DQW_WATCH_CHANNELS; ++channel) {
        const auto at = static_cast<std::size_t>(channel);
        const MonitorReading& r = readings[at];
        const MonitorSight& s = sights[at];
        if (!concerns(channel, s)) continue;
        const bool watched = s.why == DQW_WHY_IN_SERVICE;
        Json& json = channels[channel_named(channel).parameter];
        json = {{"value", number(r.value)},
                {"sd", number(r.sd)},
                {"healthy", number(r.healthy)},
                {"band", number(s.band)},
                {"least_change", number(s.least)},
                {"watched", watched},
                {"why", watched ? "" : why_not_watched(channel, s.why)}};
    }
    return Json{{"stage", dqw_stage_text(state.stage.name)},
                {"in_service", state.stage.name == DQW_STAGE_IN_SERVICE},
                {"blocks", state.blocks},
                {"residual_pu", number(state.residual_pu)},
                {"parameters", channels},
                {"refused", refused_json(state.gate)}}
        .dump();
}

std::string status_json(const EstimatorEngine& estimator)
{
    const auto whole = [](double x) { return std::isfinite(x) ? Json(x) : Json(nullptr); };
    const EstimatorState s = estimator.state();
    const auto readings = estimator.read();
    Json parameters = Json::object();
    for (int i = 0; i < DQW_PARAMETERS; ++i) {
        const EstimatorReading& r = readings[static_cast<std::size_t>(i)];
        parameters[estimator_name(i)] = {
            {"value", std::isfinite(r.sd) ? whole(r.value) : Json(nullptr)}, {"sd", whole(r.sd)}, {"usable", r.usable}};
    }
    return Json{{"stage", dqw_stage_text(s.stage)},
                {"in_service", s.stage == DQW_STAGE_IN_SERVICE},
                {"blocks", s.blocks},
                {"residual_pu", whole(s.residual_pu)},
                {"pole_pairs", s.pole_pairs > 0 ? Json(s.pole_pairs) : Json(nullptr)},
                {"parameters", parameters},
                {"refused", refused_json(s.gate)}}
        .dump();
}

std::string monitor_outcome(const MonitorRun& run)
{
    if (!run.served) return "The monitor did not enter service: " + why_no_service(run) + ".";
    if (!run.watched)
        return "The monitor entered service, but the log ends before healthy values were taken: a longer log would "
               "help.";
    if (run.events.empty() && !run.relearned.empty()) return capital(relearned_text(run.relearned.front())) + ".";
    if (run.events.empty())
        return fmt::format("No parameter left its healthy band in {:.3g} s of service, watched since {:.3f} s.",
                           served_s(run), run.watched_from_s);
    const MonitorEvent& e = run.events.front();
    const MonitorChannel& c = channel_named(e.parameter);
    const std::string healthy = std::isfinite(e.reading.healthy) ? ", healthy " + healthy_text(c.parameter, e.reading)
                                                                 : "";
    return fmt::format(
        "{} ({}): {} {}{}. It began to show at {:.3f} s and was named at {:.3f} s, with a confidence of {:.2f}.",
        capital(fault_told(e.fault)), fault_spoken(e.fault), c.title, now_text(c.parameter, e.reading), healthy,
        e.since_s, e.t_s, e.fault.confidence);
}

std::string relearned_text(const MonitorRelearned& r)
{
    std::string out = fmt::format("at {:.3f} s the residual rose above its threshold, and the monitor learned anew",
                                  r.t_s);
    if (!r.again) return out + "; the log ends before it is in service again";
    std::vector<std::string> moved;
    for (int channel = 0; channel <= DQW_WATCH_DEAD_TIME; ++channel) {
        MonitorReading now = r.after[static_cast<std::size_t>(channel)];
        const MonitorReading& before = r.before[static_cast<std::size_t>(channel)];
        now.healthy = std::isfinite(before.healthy) ? before.healthy : before.value;
        const double off = std::fabs(now.value - now.healthy);
        if (!(off > kMoved * std::fabs(now.healthy)) || !(off > kDeviations * now.sd)) continue;
        const MonitorChannel& c = channel_named(channel);
        moved.push_back(
            fmt::format("{} {} instead of {}", c.title, now_text(c.parameter, now), healthy_text(c.parameter, now)));
    }
    return out + (moved.empty() ? "; what it learned then is as before" : "; since then it reads " + list(moved));
}

MonitorRows value_rows(const MonitorRun& run, bool titles)
{
    MonitorRows rows = {{titles ? "" : "parameter", "healthy", "last", "change", "would be told"}};
    for (int channel = 0; channel < DQW_WATCH_CHANNELS; ++channel) {
        MonitorReading r = run.last[static_cast<std::size_t>(channel)];
        r.healthy = run.healthy[static_cast<std::size_t>(channel)].healthy;
        if (!std::isfinite(r.value) && !std::isfinite(r.healthy)) continue;
        const MonitorChannel& c = channel_named(channel);
        rows.push_back({titles ? c.title : c.parameter, healthy_text(c.parameter, r), now_text(c.parameter, r),
                        changed(channel, r), told_from(channel, c.parameter, run.sights)});
    }
    return rows;
}

MonitorRows unwatched_rows(const MonitorRun& run, bool titles)
{
    MonitorRows rows;
    for (int channel = 0; channel < DQW_WATCH_CHANNELS; ++channel) {
        const MonitorSight& s = run.sights[static_cast<std::size_t>(channel)];
        if (s.why == DQW_WHY_IN_SERVICE || !concerns(channel, s)) continue;
        const MonitorChannel& c = channel_named(channel);
        const std::string name = titles ? c.title : c.parameter,
                          text = s.said ? s.said : why_not_watched(channel, s.why);
        const auto same = std::find_if(rows.begin(), rows.end(), [&](const auto& row) { return row[1] == text; });
        if (same == rows.end())
            rows.push_back({name, text});
        else
            (*same)[0] += ", " + name;
    }
    return rows;
}

MonitorRows summary_rows(const MonitorRun& run)
{
    MonitorRows rows = {{"stage", stage_text(run)}};
    if (run.served && run.end.stage.times_back > 0)
        rows.push_back({"", fmt::format("first in service at {:.3f} s; {} to stage 1", run.entered_s,
                                        counted(run.end.stage.times_back, "way") + " back")});
    rows.push_back({"rows", fmt::format("{}, {:.4g} s", run.rows, run.end_s - run.begin_s)});
    if (!run.averages) rows.push_back({"refused", refused_text(run)});
    rows.push_back({"events", std::to_string(run.event_count)});
    return rows;
}

MonitorRows event_rows(const MonitorRun& run, std::size_t most)
{
    MonitorRows rows = {{"", "named at", "since", "fault", "parameter", "value", "healthy", "confidence"}};
    for (const MonitorEvent& e : run.events) {
        if (rows.size() > most) break;
        const MonitorChannel& c = channel_named(e.parameter);
        rows.push_back({std::to_string(rows.size()), fmt::format("{:.3f} s", e.t_s), fmt::format("{:.3f} s", e.since_s),
                        fault_spoken(e.fault), c.title, now_text(c.parameter, e.reading),
                        healthy_text(c.parameter, e.reading), fmt::format("{:.2f}", e.fault.confidence)});
    }
    return rows;
}

std::string monitor_text(const MonitorRun& run)
{
    std::string out = run.events.empty() ? "" : "\n";
    for (const auto& row : summary_rows(run)) out += fmt::format("{:<9}{}\n", row[0], row[1]);
    const MonitorRows values = value_rows(run, false);
    if (values.size() > 1) out += "\n" + table(values);
    const MonitorRows unwatched = unwatched_rows(run, false);
    if (!run.watched || unwatched.empty()) return out;
    out += fmt::format("\nnot watched at {:.3f} s\n", run.sights_s);
    for (const auto& row : unwatched) out += fmt::format("  {}: {}\n", row[0], row[1]);
    return out;
}

}  // namespace dqw
