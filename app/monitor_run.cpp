#include "monitor_run.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "learn_parts.hpp"
#include "learn_signals.hpp"

namespace dqw {
namespace {

constexpr std::size_t kMostPoints = 100000;
constexpr double kLongestGap = 4e9;  // periods

class Runner {
public:
    Runner(const Log& log, const MonitorSetup& setup, const MonitorWatch& watch)
        : log_(log), setup_(setup), watch_(watch), sample_(log, setup.config.tracker.pole_pairs, angle_input(setup))
    {
        if (dqw_monitor_init(&m_, &setup.config, stage_2_memory()) != DQW_OK) throw std::invalid_argument("the monitor refuses these bases or nominal values");
        run_.rows = log.rows();
        run_.begin_s = log.t_s.front(), run_.end_s = log.t_s.back();
        run_.angle = setup.config.tracker.angle;
        run_.friction_wanted = setup.config.J_kgm2 > 0.0F;
        halves_.push_back({0, run_.begin_s});
        every_ = 1 + log.rows() / std::max<std::size_t>(setup.config.tracker.half_window, 1) / kMostPoints;
        stage_from(run_.begin_s);
    }

    MonitorRun run()
    {
        LearnOptions options;
        options.progress = watch_.progress;
        std::size_t done = 0;
        walk(
            log_, done, log_.rows(), options, [&] { gap_ = true; }, [&](std::size_t k, bool) { step(k); });
        run_.last = readings_of(m_);
        run_.watched = settled_;
        run_.stage = m_.stage;
        run_.gate = m_.tracker.gate;
        run_.residual_pu = static_cast<double>(dqw_tracker_residual_pu(&m_.tracker));
        run_.blocks = m_.tracker.blocks, run_.missed = m_.tracker.missed, run_.restarts = m_.tracker.restarts;
        return std::move(run_);
    }

private:
    static std::vector<TraceInput> angle_input(const MonitorSetup& setup)
    {
        return setup.config.tracker.angle ? std::vector<TraceInput>{{"dead_time", {}, {}}} : std::vector<TraceInput>{};
    }

    dqw_monitor_random* stage_2_memory()
    {
        dqw_monitor_random_init(&lent_);
        return &lent_;
    }

    void step(std::size_t k)
    {
        if (gap_) {
            const double periods = k == 0 ? 0.0 : std::round((log_.t_s[k] - log_.t_s[k - 1]) / log_.dt_s) - 1.0;
            dqw_tracker_gap(&m_.tracker, static_cast<std::uint32_t>(std::clamp(periods, 0.0, kLongestGap)));
            gap_ = false;
        }
        const dqw_sample s = sample_(k);
        (void)dqw_monitor_sample(&m_, &s, false);
        // Halves are counted by lib; of a gap a part of one is lost, so that their times are kept.
        if (m_.tracker.halves != halves_.back().number) halves_.push_back({m_.tracker.halves, log_.t_s[k] + log_.dt_s});
        if (m_.tracker.pending) background(halves_.back().end_s);
    }

    void background(double t_s)
    {
        const dqw_monitor before = m_;
        dqw_monitor_event event{};
        const bool told = dqw_monitor_background(&m_, &event);
        const dqw_stage_name stage = dqw_monitor_stage(&m_);
        if (stage != before.stage.name) stage_from(t_s);
        if (stage == DQW_STAGE_IN_SERVICE) serve(t_s);
        if (told) tell(before, event);
        if (stage == DQW_STAGE_DOMAIN) go_back(t_s, before);
        if (halves_.size() % every_ == 0) run_.points.push_back({t_s, stage == DQW_STAGE_IN_SERVICE, readings_of(m_)});
        if (settled_ && (before.watch.looks[DQW_WATCH_FRICTION] != m_.watch.looks[DQW_WATCH_FRICTION] || before.witness.blocks != m_.witness.blocks)) complete();
    }

    void stage_from(double t_s)
    {
        const dqw_stage_name name = dqw_monitor_stage(&m_);
        if (run_.stages.empty() || run_.stages.back().name != name) run_.stages.push_back({t_s, name});
    }

    /// Healthy values stand when the first rest in service ends.
    void serve(double t_s)
    {
        if (!run_.served) run_.served = true, run_.entered_s = t_s;
        run_.ripple_watched = run_.ripple_watched || m_.witness.blocks >= DQW_WITNESS_MEMORY;
        const bool anew = !run_.relearned.empty() && !run_.relearned.back().again;
        if ((settled_ && !anew) || m_.watch.resting) return;
        const MonitorReadings now = readings_of(m_);
        if (anew) run_.relearned.back().after = now, run_.relearned.back().again = true;
        if (!settled_) run_.healthy = now, run_.watched_from_s = t_s;
        settled_ = true;
    }

    /// What becomes known later.
    void complete()
    {
        const MonitorReadings now = readings_of(m_);
        for (std::size_t channel = 0; channel < now.size(); ++channel)
            if (std::isnan(run_.healthy[channel].healthy)) run_.healthy[channel] = now[channel];
    }

    void tell(const dqw_monitor& before, const dqw_monitor_event& event)
    {
        const double unit = channel_unit(m_, event.parameter);
        MonitorReading reading = readings_of(before)[event.parameter];
        reading.value = static_cast<double>(event.value) * unit;
        reading.sd = static_cast<double>(event.sd) * unit;
        run_.events.push_back({at(event.half), at(event.since), event.parameter, reading, event.fault});
        if (watch_.event) watch_.event(run_.events.back());
    }

    double at(std::uint32_t half) const
    {
        const auto after = std::upper_bound(halves_.begin(), halves_.end(), half, [](std::uint32_t number, const Half& h) { return number < h.number; });
        return after == halves_.begin() ? run_.begin_s : std::prev(after)->end_s;
    }

    void go_back(double t_s, const dqw_monitor& before)
    {
        const bool lost = settled_ && m_.stage.back == DQW_BACK_LEFT_BAND;
        if (lost && (run_.relearned.empty() || run_.relearned.back().again)) run_.relearned.push_back({t_s, m_.stage, readings_of(before), {}, false});
        if (watch_.back) watch_.back(t_s, m_.stage);
        if (dqw_monitor_define(&m_, &setup_.config, stage_2_memory()) != DQW_OK)
            throw std::invalid_argument("the monitor refuses these bases or nominal values");
        stage_from(t_s);
    }

    const Log& log_;
    const MonitorSetup& setup_;
    const MonitorWatch& watch_;
    const SampleSource sample_;
    dqw_monitor m_{};
    dqw_monitor_random lent_{};
    MonitorRun run_;
    // Each half of a window that ended: its number, and when.
    struct Half {
        std::uint32_t number;
        double end_s;
    };
    std::vector<Half> halves_;
    bool gap_ = false;
    std::size_t every_ = 1;
    bool settled_ = false;
};

}  // namespace

MonitorRun run_monitor(const Log& log, const MonitorSetup& setup, const MonitorWatch& watch) { return Runner(log, setup, watch).run(); }

}  // namespace dqw
