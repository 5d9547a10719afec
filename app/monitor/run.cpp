#include "app/monitor/run.hpp"

#include <algorithm>
#include <cmath>

#include "app/learn/parts.hpp"
#include "app/learn/signals.hpp"

namespace dqw {
namespace {

constexpr std::size_t kMostPoints = 100000;
constexpr double kLongestGap = 4e9;  // periods
/// Learned blocks from one question what it could see to the next: a look.
constexpr std::uint32_t kSightBlocks = DQW_WATCH_TICK_BLOCKS;

class Runner {
public:
    Runner(const Log& log, const MonitorSetup& setup, MonitorEngine& monitor, const MonitorWatch& watch)
        : log_(log), watch_(watch), sample_(log, setup.config.estimator.pole_pairs, signals_of(setup)), m_(monitor)
    {
        run_.rows = log.rows();
        run_.begin_s = log.t_s.front(), run_.end_s = log.t_s.back();
        run_.angle = setup.config.estimator.angle;
        run_.friction_wanted = setup.config.J_kgm2 > 0.0F;
        halves_.push_back({0, run_.begin_s});
        every_ = 1 + log.rows() / std::max<std::size_t>(setup.config.estimator.half_window, 1) / kMostPoints;
        stage_from(run_.begin_s);
    }

    MonitorRun run()
    {
        LearnOptions options;
        options.progress = watch_.progress;
        std::size_t done = 0;
        walk(
            log_, done, log_.rows(), options, [&] { gap_ = true; }, [&](std::size_t k, bool) { step(k); });
        run_.end = m_.state();
        if (!saw_) run_.sights = m_.sights(), run_.sights_s = run_.end_s;
        run_.last = readings_of(m_.measures());
        run_.watched = settled_;
        return std::move(run_);
    }

private:
    /// What needs signals beyond voltages, currents and speed.
    static std::vector<TraceInput> signals_of(const MonitorSetup& setup)
    {
        std::vector<TraceInput> inputs = setup.inputs;
        if (setup.config.estimator.angle) inputs.push_back({"dead_time", {}, {}});
        return inputs;
    }

    void step(std::size_t k)
    {
        if (gap_) {
            const double periods = k == 0 ? 0.0 : std::round((log_.t_s[k] - log_.t_s[k - 1]) / log_.dt_s) - 1.0;
            m_.gap(static_cast<std::uint32_t>(std::clamp(periods, 0.0, kLongestGap)));
            gap_ = false;
        }
        const bool waits = m_.sample(sample_(k));
        // Halves are counted by lib; of a gap a part of one is lost, so that their times are kept.
        if (m_.halves() != halves_.back().number) halves_.push_back({m_.halves(), log_.t_s[k] + log_.dt_s});
        if (waits) background(halves_.back().end_s);
    }

    void background(double t_s)
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
        if (halves_.size() % every_ == 0)
            run_.points.push_back({t_s, is.stage.name == DQW_STAGE_IN_SERVICE, readings_of(m_.measures())});
        if (settled_ && (was.friction_looks != is.friction_looks || was.witness_blocks != is.witness_blocks))
            complete();
    }

    /// A log that ends at rest, or behind an event, still says what could be seen before.
    void look(double t_s)
    {
        const MonitorSights now = m_.sights();
        if (now[DQW_WATCH_RESIDUAL].why != DQW_WHY_IN_SERVICE) return;
        run_.sights = now, run_.sights_s = t_s;
        saw_ = true;
    }

    void stage_from(double t_s)
    {
        const dqw_stage_name name = m_.state().stage.name;
        if (run_.stages.empty() || run_.stages.back().name != name) run_.stages.push_back({t_s, name});
    }

    /// Healthy values stand when the first rest in service ends.
    void serve(double t_s, const MonitorState& is)
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
    void complete()
    {
        const MonitorReadings now = readings_of(m_.measures());
        for (std::size_t channel = 0; channel < now.size(); ++channel)
            if (std::isnan(run_.healthy[channel].healthy)) run_.healthy[channel] = now[channel];
    }

    void tell(const MonitorMeasures& before, const MonitorTold& told)
    {
        MonitorReading reading = readings_of(before)[told.parameter];
        reading.value = told.value;
        reading.sd = told.sd;
        run_.events.push_back({at(told.half), at(told.since), told.parameter, reading, told.fault});
        if (watch_.event) watch_.event(run_.events.back());
    }

    double at(std::uint32_t half) const
    {
        const auto after = std::upper_bound(halves_.begin(), halves_.end(), half,
                                            [](std::uint32_t number, const Half& h) { return number < h.number; });
        return after == halves_.begin() ? run_.begin_s : std::prev(after)->end_s;
    }

    void go_back(double t_s, const MonitorMeasures& before, const dqw_stage& stage)
    {
        const bool lost = settled_ && stage.back == DQW_BACK_LEFT_BAND;
        if (lost && (run_.relearned.empty() || run_.relearned.back().again))
            run_.relearned.push_back({t_s, stage, readings_of(before), {}, false});
        if (watch_.back) watch_.back(t_s, stage);
        m_.define();
        stage_from(t_s);
    }

    const Log& log_;
    const MonitorWatch& watch_;
    const SampleSource sample_;
    MonitorEngine& m_;
    MonitorRun run_;
    // Each half of a window that ended: its number, and when.
    struct Half {
        std::uint32_t number;
        double end_s;
    };
    std::vector<Half> halves_;
    bool gap_ = false;
    std::size_t every_ = 1;
    bool settled_ = false, saw_ = false;
};

}  // namespace

MonitorRun run_monitor(const Log& log, const MonitorSetup& setup, MonitorEngine& monitor, const MonitorWatch& watch)
{
    return Runner(log, setup, monitor, watch).run();
}

}  // namespace dqw
