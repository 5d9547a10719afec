#include "app/monitor/session.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>
#include <type_traits>

namespace dqw {
namespace {

constexpr double kLongestGap = 4e9;  // periods
constexpr std::size_t kMostEvents = 10000, kMostStages = 20000, kMostRelearned = 1000;
/// Halves whose times are kept, at least the later half of them each: eight times those of the 255 looks that an event
/// may go back.
constexpr std::size_t kMostHalves = std::size_t{1} << 16;
/// Learned blocks from one question what it could see to the next: a look.
constexpr std::uint32_t kSightBlocks = DQW_WATCH_TICK_BLOCKS;
/// Halves whose times are kept: an event began to show in the last 255 looks.
constexpr std::size_t kHalvesKept = 2 * 255 * DQW_WATCH_TICK_BLOCKS + 64;

}  // namespace

MonitorSession::MonitorSession(const MonitorSetup& setup, MonitorEngine& monitor, const MonitorWatch& watch,
                               double begin_s, std::size_t every, std::size_t most_points)
    : watch_(watch), m_(monitor), every_(every), most_points_(most_points)
{
    run_.begin_s = run_.end_s = begin_s;
    run_.angle = setup.config.estimator.angle;
    run_.observed = setup.config.estimator.observed;
    run_.friction_wanted = setup.config.J_kgm2 > 0.0F;
    halves_.push_back({0, begin_s});
    stage_from(begin_s);
}

void MonitorSession::gap(double periods) { m_.gap(static_cast<std::uint32_t>(std::clamp(periods, 0.0, kLongestGap))); }

void MonitorSession::take(double t_s, double dt_s, const dqw_sample& s)
{
    const bool waits = m_.sample(s);
    // Halves are counted by lib; of a gap a part of one is lost, so that their times are kept.
    if (m_.halves() != halves_.back().number) add_half(m_.halves(), t_s + dt_s);
    if (waits) background(halves_.back().end_s);
}

void MonitorSession::add_half(std::uint32_t number, double end_s)
{
    halves_.push_back({number, end_s});
    ++ended_;
    if (halves_.size() <= kMostHalves) return;
    // The older half of them thinner: what began so long ago is told to a few of them.
    std::deque<Half> fewer;
    for (std::size_t k = 0; k < halves_.size(); ++k)
        if (k >= kMostHalves / 2 || k % 2 == 0) fewer.push_back(halves_[k]);
    halves_ = std::move(fewer);
}

void MonitorSession::add_point(double t_s, bool in_service)
{
    run_.points.push_back({t_s, in_service, readings_of(m_.measures())});
    if (run_.points.size() <= most_points_) return;
    for (std::size_t k = 0; 2 * k < run_.points.size(); ++k) run_.points[k] = run_.points[2 * k];
    run_.points.resize((run_.points.size() + 1) / 2);
    every_ *= 2;
}

MonitorRun MonitorSession::end(std::size_t rows, double end_s)
{
    run_.rows = rows, run_.end_s = end_s;
    run_.end = m_.state();
    if (!saw_) run_.sights = m_.sights(), run_.sights_s = run_.end_s;
    run_.last = readings_of(m_.measures());
    run_.watched = settled_;
    return std::move(run_);
}

void MonitorSession::background(double t_s)
{
    const MonitorMeasures before = m_.measures();
    const MonitorState was = m_.state();
    const std::optional<MonitorTold> told = m_.background();
    const MonitorState is = m_.state();
    if (is.stage.name != was.stage.name) stage_from(t_s);
    if (is.stage.name == DQW_STAGE_IN_SERVICE) serve(t_s, is);
    if (told) tell(before, *told);
    if (is.blocks != was.blocks && is.blocks % kSightBlocks == 0) look(t_s);
    if (is.stage.name == DQW_STAGE_DOMAIN) go_back(t_s, before, is.stage);
    if (every_ > 0 && ended_ % every_ == 0) add_point(t_s, is.stage.name == DQW_STAGE_IN_SERVICE);
    if (settled_ && (was.friction_looks != is.friction_looks || was.witness_blocks != is.witness_blocks)) complete();
}

/// A log that ends at rest, or behind an event, still says what could be seen before.
void MonitorSession::look(double t_s)
{
    const MonitorSights now = m_.sights();
    if (now[DQW_WATCH_RESIDUAL].why != DQW_WHY_IN_SERVICE) return;
    run_.sights = now, run_.sights_s = t_s;
    saw_ = true;
}

void MonitorSession::stage_from(double t_s)
{
    const dqw_stage_name name = m_.state().stage.name;
    if (run_.stages.empty() || run_.stages.back().name != name) run_.stages.push_back({t_s, name});
    if (run_.stages.size() <= kMostStages) return;
    const auto half = static_cast<std::ptrdiff_t>(kMostStages / 2);
    for (auto s = run_.stages.begin(); s != run_.stages.begin() + half; ++s)
        if (s->name == DQW_STAGE_IN_SERVICE) run_.served_before_s += (s + 1)->from_s - s->from_s;
    run_.stages.erase(run_.stages.begin(), run_.stages.begin() + half);
}

/// Healthy values stand when the first rest in service ends.
void MonitorSession::serve(double t_s, const MonitorState& is)
{
    if (!run_.served) run_.served = true, run_.entered_s = t_s;
    run_.ripple_watched = run_.ripple_watched || is.witness_blocks >= DQW_WITNESS_MEMORY;
    const bool anew = !run_.relearned.empty() && !run_.relearned.back().again;
    if (settled_ && !anew) return;
    const MonitorMeasures measures = m_.measures();
    if (measures.resting) return;
    const MonitorReadings now = readings_of(measures);
    if (anew) run_.relearned.back().after = now, run_.relearned.back().again = true;
    if (!settled_) run_.healthy = now, run_.watched_from_s = t_s;
    settled_ = true;
}

/// What becomes known later.
void MonitorSession::complete()
{
    const MonitorReadings now = readings_of(m_.measures());
    for (std::size_t channel = 0; channel < now.size(); ++channel)
        if (std::isnan(run_.healthy[channel].healthy)) run_.healthy[channel] = now[channel];
}

void MonitorSession::tell(const MonitorMeasures& before, const MonitorTold& told)
{
    MonitorReading reading = readings_of(before)[told.parameter];
    reading.value = told.value;
    reading.sd = told.sd;
    const MonitorEvent event = {at(told.half), at(told.since), told.parameter, reading, told.fault};
    ++run_.event_count;
    if (run_.events.size() < kMostEvents) run_.events.push_back(event);
    if (watch_.event) watch_.event(event);
}

double MonitorSession::at(std::uint32_t half) const
{
    // By how long ago: the numbers begin again behind 2^32.
    const std::uint32_t now = m_.halves();
    const auto after = std::upper_bound(
        halves_.begin(), halves_.end(), half,
        [now](std::uint32_t number, const Half& h) { return now - number > now - h.number; });
    return after == halves_.begin() ? run_.begin_s : std::prev(after)->end_s;
}

void MonitorSession::go_back(double t_s, const MonitorMeasures& before, const dqw_stage& stage)
{
    const bool lost = settled_ && stage.back == DQW_BACK_LEFT_BAND;
    if (lost && run_.relearned.size() < kMostRelearned && (run_.relearned.empty() || run_.relearned.back().again))
        run_.relearned.push_back({t_s, stage, readings_of(before), {}, false});
    if (watch_.back) watch_.back(t_s, stage);
    m_.define();
    stage_from(t_s);
}

void MonitorSession::forget()
{
    run_.events.clear();
    run_.points.clear();
    run_.stages.erase(run_.stages.begin(), run_.stages.end() - 1);
    if (run_.relearned.size() > 1) run_.relearned.erase(run_.relearned.begin(), run_.relearned.end() - 1);
    while (halves_.size() > kHalvesKept) halves_.pop_front();
}

std::string MonitorSession::kept() const
{
    static_assert(std::is_trivially_copyable_v<Flags> && std::is_trivially_copyable_v<Half>);
    Flags f;
    std::memset(static_cast<void*>(&f), 0, sizeof f);
    f.healthy = run_.healthy, f.sights = run_.sights;
    f.begin_s = run_.begin_s, f.end_s = run_.end_s, f.sights_s = run_.sights_s;
    f.watched_from_s = run_.watched_from_s, f.entered_s = run_.entered_s;
    f.rows = run_.rows, f.ended = ended_, f.stage = run_.stages.back().name;
    f.ripple_watched = run_.ripple_watched, f.served = run_.served, f.watched = run_.watched;
    f.settled = settled_, f.saw = saw_;
    std::string bytes(reinterpret_cast<const char*>(&f), sizeof f);
    for (const Half& half : halves_) bytes.append(reinterpret_cast<const char*>(&half), sizeof half);
    return bytes;
}

bool MonitorSession::take_kept(std::string_view bytes)
{
    if (bytes.size() < sizeof(Flags) + sizeof(Half) || (bytes.size() - sizeof(Flags)) % sizeof(Half) != 0) return false;
    Flags f;
    std::memcpy(&f, bytes.data(), sizeof f);
    run_.healthy = f.healthy, run_.sights = f.sights;
    run_.begin_s = f.begin_s, run_.end_s = f.end_s, run_.sights_s = f.sights_s;
    run_.watched_from_s = f.watched_from_s, run_.entered_s = f.entered_s;
    run_.rows = f.rows, ended_ = f.ended, run_.stages = {{f.begin_s, f.stage}};
    run_.ripple_watched = f.ripple_watched, run_.served = f.served, run_.watched = f.watched;
    settled_ = f.settled, saw_ = f.saw;
    halves_.clear();
    for (std::size_t at = sizeof f; at < bytes.size(); at += sizeof(Half)) {
        Half half;
        std::memcpy(&half, bytes.data() + at, sizeof half);
        halves_.push_back(half);
    }
    return true;
}

}  // namespace dqw
