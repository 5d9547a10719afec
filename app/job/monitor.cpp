#include "app/job/monitor.hpp"

#include <fmt/format.h>

#include <cmath>

#include "app/base/interrupt.hpp"
#include "app/base/output.hpp"
#include "app/base/progress.hpp"
#include "app/base/text.hpp"
#include "app/firmware/q15_config.hpp"
#include "app/job/logs.hpp"
#include "app/job/monitor_looks.hpp"
#include "app/monitor/notes.hpp"
#include "app/monitor/store.hpp"
#include "app/q15/fixed_point.hpp"
#include "app/read/log_stream.hpp"
#include "ref/log/speed_lag.hpp"
#include "ref/log/turns.hpp"

namespace dqw {
namespace {

/// Of a pipe what gives the bases; where they are said, what gives the period.
constexpr double kWindow_s = 10.0, kShortWindow_s = 1.0;
constexpr std::size_t kFewestRows = 100;
/// Seconds of rows from one writing of the store to the next.
constexpr double kStore_s = 60.0;

LearnConfig effects_to_monitor(const Options& options)
{
    LearnConfig asked = asked_effects(options, {});
    for (const std::string& name : options.effects) asked.inputs.push_back({name, {}, {}});
    return asked;
}

/// With which the healthy values were learned.
std::optional<double> lag_of(const std::optional<MonitorStore>& store)
{
    return store ? std::optional<double>(store->speed_lag_s) : std::nullopt;
}

/// Where nobody says them and the log's own angle does.
void find_pole_pairs(std::vector<Log>& logs, std::vector<std::string>& notes)
{
    if (logs.front().machine.pole_pairs || logs.front().regime != Regime::dynamic) return;
    const double p = pole_pairs_of_angles(logs);
    if (!(p > 0.0)) return;
    for (Log& log : logs) log.machine.pole_pairs = p;
    notes.push_back(fmt::format("pole pairs found: {:g}, from the electrical angle", p));
}

/// The header with which firmware runs the same; a note of it.
std::string q15_header(const MonitorSetup& setup, const std::string& log, std::vector<std::string>& notes)
{
    const dqw_monitor_q15_config c = q15_monitor_config(setup);
    const FullScales full = full_scales(c.estimator.scale);
    notes.push_back(fmt::format(
        "fixed point; full scales {:.4g} V, {:.4g} A, {:.4g} rad/s; its configuration is in dqw_q15_monitor.h",
        full.v_V, full.i_A, full.w_rad_s));
    return q15_monitor_text(c, log, setup.inputs);
}

/// One run, over a log or over a pipe.
class Watching {
public:
    Watching(const Options& options, const MonitorListener& listener)
        : options_(options), listener_(listener), progress_("monitoring", options.progress)
    {
        out_.report.log = options.logs.front();
        asked_ = effects_to_monitor(options);
        if (!options.store_file.empty()) store_ = read_store(options.store_file);
    }

    Monitored log(const std::vector<Log>& logs, std::vector<std::string> notes)
    {
        notes_ = std::move(notes);
        if (!store_) return over(logs);
        std::vector<Log> known = logs;
        take_from_store(*store_, options_.store_file, options_.arith, known.front());
        return over(known);
    }

    Monitored pipe()
    {
        catch_interrupts();
        ReadOptions read = read_options(options_);
        read.notes = &notes_;
        LogStream stream(options_.logs.front(), read);
        const bool known = all_known(stream);
        std::vector<Log> logs = {stream.begin(known ? kShortWindow_s : kWindow_s, kFewestRows)};
        if (store_) take_from_store(*store_, options_.store_file, options_.arith, logs.front());
        find_pole_pairs(logs, notes_);
        bring_speed_forward(logs, true, notes_, lag_of(store_));
        SpeedForward forward(logs.front().speed_lag_s, logs.front().dt_s);
        begin(logs);
        stream.on_note([&](const std::string& said) { note({said}); });
        with_logs(logs, [&] {
            MonitorRunner runner(setup_, *engine_, watch_, logs.front().dt_s, 0);
            for (Log rows; stream.next(rows);) {
                forward.over(rows);
                runner.take(rows);
                store_now_and_then(rows.t_s.back());
            }
            out_.report.run = runner.end();
        });
        tell_left_out(stream);
        end();
        return std::move(out_);
    }

private:
    /// Notes go to the page as well.
    void note(const std::vector<std::string>& notes)
    {
        if (listener_.notes) listener_.notes(notes);
        out_.report.notes.insert(out_.report.notes.end(), notes.begin(), notes.end());
    }

    /// Is everything said that a window would tell?
    bool all_known(const LogStream& stream) const
    {
        if (store_) return true;
        for (const auto value : {&Machine::v_rated_V, &Machine::i_rated_A, &Machine::w_max_rad_s, &Machine::R_ohm,
                                 &Machine::Ld_H, &Machine::Lq_H, &Machine::psi_Wb})
            if (!(stream.machine().*value) && !(asked_.start.*value)) return false;
        return !stream.modulation().empty() && stream.modulation() != "unknown";
    }

    Monitored over(const std::vector<Log>& logs)
    {
        begin(logs);
        with_logs(logs, [&] {
            MonitorRunner runner(setup_, *engine_, watch_, logs.front().dt_s, logs.front().rows());
            runner.take(logs.front());
            out_.report.run = runner.end();
        });
        end();
        return std::move(out_);
    }

    void begin(const std::vector<Log>& logs)
    {
        const bool rated = logs.front().machine.v_rated_V && logs.front().machine.i_rated_A &&
                           logs.front().machine.w_max_rad_s;
        with_logs(logs, [&] {
            if (store_ && store_->dead_time_width_A > 0.0)
                asked_.inputs.push_back({"dead_time", {store_->dead_time_width_A}, {}});
            setup_ = monitor_setup(logs, asked_);
            if (store_) take_from_store(*store_, options_.store_file, setup_);
            notes_.insert(notes_.end(), setup_.notes.begin(), setup_.notes.end());
            if (!store_ && !rated && options_.logs.front() == "-") tell_bases(logs.front());
            if (options_.fixed_point()) out_.q15_header = q15_header(setup_, out_.report.log, notes_);
            engine_ = monitor_engine(setup_, options_.fixed_point());
            restore();
        });
        note(notes_);
        watch_.progress = progress_.callback();
        watch_.event = [&](const MonitorEvent& event) {
            progress_.wipe();
            if (listener_.event) listener_.event(event);
        };
        watch_.back = [&](double t_s, const dqw_stage& stage) {
            progress_.wipe();
            // One that goes to and fro is told once, and counted.
            if (stage.times_back == 1) note({way_back_text(t_s, stage)});
        };
    }

    void tell_bases(const Log& first)
    {
        const dqw_estimator_config& c = setup_.config.estimator;
        notes_.push_back(fmt::format("bases from the first {:.3g} s: {:.4g} V, {:.4g} A, {:.4g} rad/s; v_V, i_A "
                                     "and w_m_rad_s under [nameplate] in a machine file (--machine) would say them",
                                     first.t_s.back() - first.t_s.front(), c.v_base_V, c.i_base_A, c.w_base_rad_s));
    }

    void restore()
    {
        if (options_.store_file.empty()) return;
        if (!store_) {
            notes_.push_back(options_.store_file + ": not there yet; what is healthy is learned");
            return;
        }
        const std::string refused = engine_->restore(store_->healthy);
        if (!refused.empty())
            throw InputError(options_.store_file, 1, refused + "; expected the same motor, or another file");
        notes_.push_back(options_.store_file + ": healthy values taken from it");
    }

    void store()
    {
        if (options_.store_file.empty()) return;
        // None stand while they are taken anew: those before stay.
        const std::string healthy = engine_->store();
        if (healthy.empty()) return;
        try {
            write_store(options_.store_file, store_of(setup_, options_.arith, healthy));
            stored_ = true;
        } catch (const OutputError& error) {
            if (!store_failed_) note({fmt::format("warning: {}; watching goes on", error.what())});
            store_failed_ = true;
        }
    }

    void store_now_and_then(double t_s)
    {
        if (options_.store_file.empty() || (stored_ && t_s < stored_s_ + kStore_s)) return;
        stored_s_ = t_s;
        store();
    }

    void tell_left_out(const LogStream& stream)
    {
        std::vector<std::string> told;
        for (const LeftOut& reason : stream.left_out())
            told.push_back(fmt::format("{}: {} left out in all, the first at line {}: {}", out_.report.log,
                                       counted(reason.rows, "row"), reason.first_line, reason.why));
        note(told);
    }

    void end()
    {
        store();
        progress_.wipe();
        if (stored_) note({options_.store_file + ": healthy values written"});
        if (!options_.store_file.empty() && !stored_ && !store_failed_)
            note({fmt::format("{}: {}, no healthy values stood before the rows ended", options_.store_file,
                              store_ ? "left as it was" : "not written")});
        note(closing_notes(out_.report.run));
    }

    const Options& options_;
    const MonitorListener& listener_;
    Progress progress_;
    LearnConfig asked_;
    Monitored out_;
    std::vector<std::string> notes_;
    MonitorSetup setup_;
    std::unique_ptr<MonitorEngine> engine_;
    MonitorWatch watch_;
    std::optional<MonitorStore> store_;
    double stored_s_ = -HUGE_VAL;
    bool stored_ = false, store_failed_ = false;
};

}  // namespace

std::vector<Log> logs_to_monitor(const Options& options, std::vector<std::string>& notes)
{
    std::vector<Log> logs = read_logs(options.logs, options, true, notes, false, true);
    const auto store = options.store_file.empty() ? std::nullopt : read_store(options.store_file);
    find_pole_pairs(logs, notes);
    bring_speed_forward(logs, true, notes, lag_of(store));
    return logs;
}

MonitorSetup setup_to_monitor(const Options& options)
{
    std::vector<std::string> notes;
    const LearnConfig asked = effects_to_monitor(options);
    const std::vector<Log> logs = logs_to_monitor(options, notes);
    return with_logs(logs, [&] { return monitor_setup(logs, asked); });
}

Monitored monitor_logs(const std::vector<Log>& logs, const Options& options, std::vector<std::string> notes,
                       const MonitorListener& listener)
{
    if (is_slow(logs.front())) return monitor_looks(logs.front(), options, std::move(notes), listener);
    return Watching(options, listener).log(logs, std::move(notes));
}

Monitored monitor_pipe(const Options& options, const MonitorListener& listener)
{
    return Watching(options, listener).pipe();
}

}  // namespace dqw
