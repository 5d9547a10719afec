#include "app/job/monitor_looks.hpp"

#include <fmt/format.h>

#include "app/base/columns.hpp"
#include "app/base/progress.hpp"
#include "app/job/logs.hpp"
#include "app/monitor/looks.hpp"

namespace dqw {
namespace {

void check(const Log& log, const Options& options)
{
    const std::string regime = name_of(log.regime);
    if (options.fixed_point() || !options.effects.empty() || !options.config_file.empty() ||
        !options.store_file.empty())
        throw InputError(
            log.path, 1,
            fmt::format("a {} log: looks of it know neither --arith q15 nor --config, --effect or --store; "
                        "expected a dynamic log, or none of these",
                        regime));
    if (log.t_s.empty()) throw InputError(log.path, 1, fmt::format("a {} log without t_s; expected a time", regime));
    if (!log.machine.pole_pairs)
        throw InputError(log.path, 1,
                         "the pole pairs are not known; expected --pole-pairs N, or pole_pairs in the machine file");
}

}  // namespace

bool is_slow(const Log& log) { return log.regime == Regime::polled || log.regime == Regime::steady; }

Monitored monitor_looks(const Log& log, const Options& options, std::vector<std::string> notes,
                        const MonitorListener& listener)
{
    check(log, options);
    if (listener.notes) listener.notes(notes);
    Monitored out;
    out.report.log = options.logs.front();
    Progress progress("monitoring", options.progress);
    MonitorWatch watch;
    watch.progress = progress.callback();
    watch.event = [&](const MonitorEvent& event) {
        progress.wipe();
        if (listener.event) listener.event(event);
    };
    MonitorRun& run = out.report.run;
    run = with_logs(std::vector<Log>{log}, [&] { return watch_looks(log, watch); });
    progress.wipe();
    if (listener.notes) listener.notes(run.notes);
    notes.insert(notes.end(), run.notes.begin(), run.notes.end());
    out.report.notes = std::move(notes);
    return out;
}

}  // namespace dqw
