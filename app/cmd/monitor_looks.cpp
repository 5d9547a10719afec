#include "app/cmd/monitor_looks.hpp"

#include <fmt/format.h>

#include "app/base/columns.hpp"
#include "app/base/output.hpp"
#include "app/base/progress.hpp"
#include "app/cmd/logs.hpp"
#include "app/monitor/looks.hpp"
#include "app/monitor/page.hpp"
#include "app/monitor/report.hpp"

namespace dqw {
namespace {

void check(const Log& log, const Options& options)
{
    const std::string regime = name_of(log.regime);
    if (options.fixed_point() || !options.effects.empty() || !options.config_file.empty())
        throw InputError(log.path, 1,
                         fmt::format("a {} log: looks of it know neither --arith q15 nor --config nor --effect; "
                                     "expected a dynamic log, or none of these",
                                     regime));
    if (log.t_s.empty()) throw InputError(log.path, 1, fmt::format("a {} log without t_s; expected a time", regime));
    if (!log.machine.pole_pairs)
        throw InputError(log.path, 1,
                         "the pole pairs are not known; expected --pole-pairs N, or pole_pairs in the machine file");
}

}  // namespace

int monitor_looks_command(const Log& log, const Options& options, std::vector<std::string> notes)
{
    check(log, options);
    make_directory(options.out_dir);
    print_notes(notes);
    MonitorReport report;
    report.log = log.path;
    Progress progress("monitoring");
    MonitorWatch watch;
    watch.progress = progress.callback();
    watch.event = [&](const MonitorEvent& event) {
        progress.wipe();
        print(options.json ? event_json(event) : event_text(event));
    };
    report.run = with_logs({log}, [&] { return watch_looks(log, watch); });
    notes.insert(notes.end(), report.run.notes.begin(), report.run.notes.end());
    print_notes(report.run.notes);
    report.notes = notes;
    write_file(path_in(options.out_dir, "monitor.html"), monitor_page(report));
    print(options.json ? sensitivity_json(report.run) : monitor_text(report.run));
    return exit_done;
}

}  // namespace dqw
