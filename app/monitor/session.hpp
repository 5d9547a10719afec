// A condition monitor that is fed sample by sample, as firmware feeds it: when it looks, what it tells, and when that
// was.
#ifndef DQW_APP_MONITOR_SESSION_HPP
#define DQW_APP_MONITOR_SESSION_HPP

#include <cstddef>
#include <deque>
#include <string>
#include <string_view>

#include "app/monitor/run.hpp"

namespace dqw {

class MonitorSession {
public:
    /// `setup`, `monitor` and `watch` stay in use. A reading is kept of every `every`-th half of a window, 0: of
    /// none; where they are more than `most_points`, every second of them goes.
    MonitorSession(const MonitorSetup& setup, MonitorEngine& monitor, const MonitorWatch& watch, double begin_s,
                   std::size_t every, std::size_t most_points = 0);

    /// There is no sample in this many periods before the next.
    void gap(double periods);
    /// A sample that was taken at t_s, dt_s before the next.
    void take(double t_s, double dt_s, const dqw_sample& s);
    /// What came of it.
    MonitorRun end(std::size_t rows, double end_s);
    const MonitorRun& run() const { return run_; }

    /// What was told is not kept any longer: memory stays bounded however long it runs.
    void forget();

    /// All that forget() leaves, the monitor's own state apart; for the same build alone. False where it is not that.
    std::string kept() const;
    bool take_kept(std::string_view bytes);

private:
    // A half of a window that ended: its number, and when.
    struct Half {
        std::uint32_t number;
        double end_s;
    };
    struct Flags {
        MonitorReadings healthy;
        MonitorSights sights;
        double begin_s, end_s, sights_s, watched_from_s, entered_s;
        std::uint64_t rows, ended;
        dqw_stage_name stage;
        bool ripple_watched, served, watched, settled, saw;
    };

    void add_half(std::uint32_t number, double end_s);
    void add_point(double t_s, bool in_service);
    void background(double t_s);
    void look(double t_s);
    void stage_from(double t_s);
    void serve(double t_s, const MonitorState& is);
    void complete();
    void tell(const MonitorMeasures& before, const MonitorTold& told);
    double at(std::uint32_t half) const;
    void go_back(double t_s, const MonitorMeasures& before, const dqw_stage& stage);

    const MonitorWatch& watch_;
    MonitorEngine& m_;
    MonitorRun run_;
    std::deque<Half> halves_;
    std::size_t every_, most_points_, ended_ = 1;  // halves that ended, the beginning counted
    bool settled_ = false, saw_ = false;
};

}  // namespace dqw
#endif
