// Runs a condition monitor over a log, as firmware would, sample by sample.
#ifndef DQW_APP_MONITOR_RUN_HPP
#define DQW_APP_MONITOR_RUN_HPP

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "app/monitor/engine.hpp"
#include "ref/log/log.hpp"

namespace dqw {

struct MonitorEvent {
    double t_s, since_s;
    dqw_monitor_channel parameter;
    MonitorReading reading;  ///< healthy: as it was before
    dqw_fault_verdict fault;
};

/// From when on a stage.
struct MonitorStage {
    double from_s;
    dqw_stage_name name;
};

/// A way back to stage 1 from service: healthy values before it, and after it where they were taken again.
struct MonitorRelearned {
    double t_s;
    dqw_stage stage;
    MonitorReadings before, after;
    bool again;
};

struct MonitorPoint {
    double t_s;
    bool in_service;
    MonitorReadings readings;
};

struct MonitorRun {
    std::size_t rows = 0;
    double begin_s = 0.0, end_s = 0.0;
    std::vector<MonitorEvent> events;         ///< the first of them, 10 000 at most
    std::size_t event_count = 0;              ///< all
    std::vector<MonitorStage> stages;         ///< the last of them, 10 000 at least
    double served_before_s = 0.0;             ///< in service, before those
    std::vector<MonitorRelearned> relearned;  ///< the first of them, 1000 at most
    std::vector<MonitorPoint> points;         ///< evenly chosen, 100 000 at most; of rows without end 4096
    MonitorReadings healthy;                  ///< `healthy` of each when they first stood
    MonitorReadings last;
    MonitorState end{};  ///< what it says of itself then
    /// what it could see, when it last learned while it watched; at the end where it never did
    MonitorSights sights;
    double sights_s = 0.0;
    bool averages = false;           ///< looks of a slow log, not samples
    std::vector<std::string> notes;  ///< of what it did
    bool angle = false, observed = false, ripple_watched = false, friction_wanted = false;
    double watched_from_s = 0.0;           ///< healthy values stand from here; of use where `watched` is
    double entered_s = 0.0;                ///< service, for the first time; of use where `served` is
    bool served = false, watched = false;  ///< in service at all; for long enough to have healthy values
};

struct MonitorWatch {
    std::function<void(const MonitorEvent&)> event;
    /// A way back to stage 1, and what had been wrong.
    std::function<void(double t_s, const dqw_stage&)> back;
    std::function<void(double)> progress;
};

/// A run over rows that come in pieces, in bounded memory; the same events whatever the pieces.
class MonitorRunner {
public:
    /// `rows_ahead`: how many will come, 0 where nobody knows. All that is given stays in use.
    MonitorRunner(const MonitorSetup& setup, MonitorEngine& monitor, const MonitorWatch& watch, double dt_s,
                  std::size_t rows_ahead);
    ~MonitorRunner();
    MonitorRunner(const MonitorRunner&) = delete;
    MonitorRunner& operator=(const MonitorRunner&) = delete;
    /// The next rows; a gap stands before those of rows.segments.
    void take(const Log& rows);
    /// What came of it, once.
    MonitorRun end();

private:
    class Impl;
    std::unique_ptr<Impl> impl_;
};

/// Throws std::invalid_argument where the monitor refuses its configuration.
MonitorRun run_monitor(const Log& log, const MonitorSetup& setup, MonitorEngine& monitor, const MonitorWatch& watch);

}  // namespace dqw
#endif
