// Runs a condition monitor over a log, as firmware would, sample by sample.
#ifndef DQW_APP_MONITOR_RUN_HPP
#define DQW_APP_MONITOR_RUN_HPP

#include <functional>
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
    std::vector<MonitorEvent> events;
    std::vector<MonitorStage> stages;
    std::vector<MonitorRelearned> relearned;
    std::vector<MonitorPoint> points;  ///< evenly chosen, 100 000 at most
    MonitorReadings healthy;           ///< `healthy` of each when they first stood
    MonitorReadings last;
    MonitorState end{};  ///< what it says of itself then
    /// what it could see, when it last learned while it watched; at the end where it never did
    MonitorSights sights;
    double sights_s = 0.0;
    bool averages = false;           ///< looks of a slow log, not samples
    std::vector<std::string> notes;  ///< of what it did
    bool angle = false, ripple_watched = false, friction_wanted = false;
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

/// Throws std::invalid_argument where the monitor refuses its configuration.
MonitorRun run_monitor(const Log& log, const MonitorSetup& setup, MonitorEngine& monitor, const MonitorWatch& watch);

}  // namespace dqw
#endif
