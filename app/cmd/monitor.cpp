#include "app/cmd/monitor.hpp"

#include <optional>

#include "app/base/output.hpp"
#include "app/job/logs.hpp"
#include "app/job/monitor.hpp"
#include "app/monitor/page.hpp"

namespace dqw {

namespace {

Monitored watched(const Options& options, const MonitorListener& listener, std::optional<OutputFolder>& folder)
{
    if (options.logs.front() == "-") {
        folder.emplace(options.out_dir);
        return monitor_pipe(options, listener);
    }
    std::vector<std::string> notes;
    const std::vector<Log> logs = logs_to_monitor(options, notes);
    folder.emplace(options.out_dir);
    return monitor_logs(logs, options, notes, listener);
}

}  // namespace

int monitor_command(const Options& options)
{
    // An unreadable trace.json is said before a log is read.
    (void)asked_effects(options, {});
    MonitorListener listener;
    listener.notes = print_notes;
    listener.event = [&](const MonitorEvent& event) { print(options.json ? event_json(event) : event_text(event)); };
    std::optional<OutputFolder> folder;
    const Monitored done = watched(options, listener, folder);
    if (!done.q15_header.empty()) folder->write("dqw_q15_monitor.h", done.q15_header);
    folder->write("monitor.html", monitor_page(done.report));
    folder->tell();
    print(options.json ? sensitivity_json(done.report.run) : monitor_text(done.report.run));
    return exit_done;
}

}  // namespace dqw
