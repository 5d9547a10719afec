#include "app/cmd/monitor.hpp"

#include "app/cmd/logs.hpp"
#include <algorithm>
#include <memory>

#include "app/base/effect_names.hpp"
#include "app/base/output.hpp"
#include "app/base/progress.hpp"
#include "app/base/text.hpp"
#include "app/firmware/q15_config.hpp"
#include "app/learn/inputs.hpp"
#include "app/monitor/float.hpp"
#include "app/monitor/notes.hpp"
#include "app/monitor/page.hpp"
#include "app/monitor/q15.hpp"
#include "app/q15/fixed_point.hpp"

namespace dqw {
namespace {

struct Options : CommonOptions {
    std::string log;
    std::string arith = "float";
    std::vector<std::string> effects;
    std::string config_file;
};

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
    const auto monitor = options.arith == "q15" ? q15_monitor(setup) : float_monitor(setup);
    return run_monitor(log, setup, *monitor, watch);
}

int run(const Options& options)
{
    MonitorReport report;
    report.log = options.log;
    std::vector<std::string> notes;
    LearnConfig asked;
    if (!options.config_file.empty()) asked = read_learn_config(options.config_file);
    for (const std::string& name : options.effects) asked.inputs.push_back({name, {}, {}});
    const std::vector<Log> logs = read_logs({options.log}, options, notes);
    // What cannot be written is said before the work, not after.
    make_directory(options.out_dir);
    std::string config;
    try {
        const MonitorSetup setup = monitor_setup(logs, asked);
        notes.insert(notes.end(), setup.notes.begin(), setup.notes.end());
        if (options.arith == "q15") {
            const dqw_monitor_q15_config c = q15_monitor_config(setup);
            const FullScales full = full_scales(c.estimator.scale);
            notes.push_back(fmt::format(
                "fixed point; full scales {:.4g} V, {:.4g} A, {:.4g} rad/s; its configuration is in dqw_q15_monitor.h",
                full.v_V, full.i_A, full.w_rad_s));
            config = q15_monitor_text(c, options.log, setup.inputs);
        }
        note(report, notes);
        report.run = watched(logs.front(), setup, options, report);
    } catch (const std::invalid_argument& error) {
        throw InputError(options.log, logs.front().rows() + 1, error.what());
    }
    note(report, closing_notes(report.run));
    if (!config.empty()) {
        OutputFile header(path_in(options.out_dir, "dqw_q15_monitor.h"));
        header.write(config);
        header.close();
    }
    OutputFile file(path_in(options.out_dir, "monitor.html"));
    file.write(monitor_page(report));
    file.close();
    if (!options.json) print(monitor_text(report.run));
    return exit_done;
}

}  // namespace

Command add_monitor(CLI::App& app)
{
    CLI::App* command = app.add_subcommand("monitor", "watch a log for changes of the machine, and name the fault");
    auto options = std::make_shared<Options>();
    options->all_columns = true;
    command->add_option("LOG.csv", options->log, "dynamic log")->required()->type_name("");
    add_common(*command, *options);
    command->get_option("--json")->description(
        "print one JSON object an event, one a line, and nothing else on stdout");
    command
        ->add_option(
            "--effect", options->effects,
            "effect that the machine has, learned as well; repeatable; a note says where this log cannot have it: " +
                list(effect_names(), 99))
        ->take_all()
        ->allow_extra_args(false)
        ->check(CLI::IsMember(effect_names()))
        ->type_name("NAME");
    command->add_option("--config", options->config_file, "what a trace found: start values, and the effects to learn")
        ->type_name("trace.json");
    command->add_option("--arith", options->arith, "arithmetic of the monitor")
        ->check(CLI::IsMember({"float", "q15"}))
        ->capture_default_str();
    command->footer("Writes monitor.html into DIR, with --arith q15 dqw_q15_monitor.h as well. Exit code 0 with and "
                    "without events.");
    return {command, [=] { return run(*options); }};
}

}  // namespace dqw
