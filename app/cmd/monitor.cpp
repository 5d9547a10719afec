#include "app/cmd/monitor.hpp"

#include <fmt/format.h>

#include "app/base/output.hpp"
#include "app/base/progress.hpp"
#include "app/cmd/logs.hpp"
#include "app/cmd/monitor_looks.hpp"
#include "app/firmware/q15_config.hpp"
#include "app/learn/inputs.hpp"
#include "app/monitor/notes.hpp"
#include "app/monitor/page.hpp"
#include "app/q15/fixed_point.hpp"

namespace dqw {
namespace {

/// Notes go to the page as well.
void note(MonitorReport& report, const std::vector<std::string>& notes)
{
    print_notes(notes);
    report.notes.insert(report.notes.end(), notes.begin(), notes.end());
}

MonitorRun watched(const Log& log, const MonitorSetup& setup, const Options& options, MonitorReport& report)
{
    Progress progress("monitoring");
    MonitorWatch watch;
    watch.progress = progress.callback();
    watch.event = [&](const MonitorEvent& event) {
        progress.wipe();
        print(options.json ? event_json(event) : event_text(event));
    };
    watch.back = [&](double t_s, const dqw_stage& stage) {
        progress.wipe();
        // One that goes to and fro is told once, and counted.
        if (stage.times_back == 1) note(report, {way_back_text(t_s, stage)});
    };
    const auto monitor = monitor_engine(setup, options.fixed_point());
    return run_monitor(log, setup, *monitor, watch);
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

}  // namespace

int monitor_command(const Options& options)
{
    MonitorReport report;
    report.log = options.logs.front();
    std::vector<std::string> notes;
    LearnConfig asked;
    if (!options.config_file.empty()) asked = read_learn_config(options.config_file);
    for (const std::string& name : options.effects) asked.inputs.push_back({name, {}, {}});
    const std::vector<Log> logs = read_logs(options.logs, options, true, notes, false, true);
    if (const Regime r = logs.front().regime; r == Regime::polled || r == Regime::steady)
        return monitor_looks_command(logs.front(), options, notes);
    // What cannot be written is said before the work, not after.
    make_directory(options.out_dir);
    std::string config;
    with_logs(logs, [&] {
        const MonitorSetup setup = monitor_setup(logs, asked);
        notes.insert(notes.end(), setup.notes.begin(), setup.notes.end());
        if (options.fixed_point()) config = q15_header(setup, report.log, notes);
        note(report, notes);
        report.run = watched(logs.front(), setup, options, report);
    });
    note(report, closing_notes(report.run));
    if (!config.empty()) write_file(path_in(options.out_dir, "dqw_q15_monitor.h"), config);
    write_file(path_in(options.out_dir, "monitor.html"), monitor_page(report));
    print(options.json ? sensitivity_json(report.run) : monitor_text(report.run));
    return exit_done;
}

}  // namespace dqw
