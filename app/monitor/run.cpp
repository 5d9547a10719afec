#include "app/monitor/run.hpp"

#include <algorithm>
#include <cmath>

#include "app/learn/parts.hpp"
#include "app/learn/signals.hpp"
#include "app/monitor/session.hpp"

namespace dqw {
namespace {

constexpr std::size_t kMostPoints = 100000, kMostPointsOfPipe = 4096;

/// What needs signals beyond voltages, currents and speed.
std::vector<TraceInput> signals_of(const MonitorSetup& setup)
{
    std::vector<TraceInput> inputs = setup.inputs;
    if (setup.config.estimator.angle) inputs.push_back({"dead_time", {}, {}});
    return inputs;
}

}  // namespace

class MonitorRunner::Impl {
public:
    Impl(const MonitorSetup& setup, MonitorEngine& monitor, const MonitorWatch& watch, double dt_s,
         std::size_t rows_ahead)
        : setup_(setup), monitor_(monitor), watch_(watch), signals_(signals_of(setup)), dt_s_(dt_s), total_(rows_ahead)
    {
    }

    void take(const Log& rows)
    {
        if (rows.rows() == 0) return;
        if (!session_) begin(rows.t_s.front());
        LearnOptions options;
        options.progress = total_ > 0 ? watch_.progress : nullptr;
        const SampleSource sample(rows, setup_.config.estimator.pole_pairs, signals_, end_);
        walk(
            rows, rows_, total_, options, [&] { gap_ = true; },
            [&](std::size_t k, bool) { step(rows.t_s[k], sample(k)); });
    }

    MonitorRun end()
    {
        if (!session_) begin(0.0);
        return session_->end(rows_, last_s_);
    }

private:
    void begin(double t_s)
    {
        const std::size_t half = std::max<std::size_t>(setup_.config.estimator.half_window, 1);
        session_ = std::make_unique<MonitorSession>(setup_, monitor_, watch_, t_s, 1 + total_ / half / kMostPoints,
                                                    total_ > 0 ? 2 * kMostPoints : kMostPointsOfPipe);
    }

    void step(double t_s, const dqw_sample& s)
    {
        if (gap_) session_->gap(rows_ == 0 ? 0.0 : std::round((t_s - last_s_) / dt_s_) - 1.0);
        gap_ = false;
        last_s_ = t_s;
        session_->take(t_s, dt_s_, s);
    }

    const MonitorSetup& setup_;
    MonitorEngine& monitor_;
    const MonitorWatch& watch_;
    const std::vector<TraceInput> signals_;
    const double dt_s_;
    const std::size_t total_;
    std::unique_ptr<MonitorSession> session_;
    SampleSource::End end_;
    std::size_t rows_ = 0;
    double last_s_ = 0.0;
    bool gap_ = false;
};

MonitorRunner::MonitorRunner(const MonitorSetup& setup, MonitorEngine& monitor, const MonitorWatch& watch, double dt_s,
                             std::size_t rows_ahead)
    : impl_(std::make_unique<Impl>(setup, monitor, watch, dt_s, rows_ahead))
{
}
MonitorRunner::~MonitorRunner() = default;
void MonitorRunner::take(const Log& rows) { impl_->take(rows); }
MonitorRun MonitorRunner::end() { return impl_->end(); }

MonitorRun run_monitor(const Log& log, const MonitorSetup& setup, MonitorEngine& monitor, const MonitorWatch& watch)
{
    MonitorRunner runner(setup, monitor, watch, log.dt_s, log.rows());
    runner.take(log);
    return runner.end();
}

}  // namespace dqw
