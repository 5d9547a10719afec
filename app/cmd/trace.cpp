#include "app/cmd/trace.hpp"

#include "app/cmd/logs.hpp"
#include <algorithm>
#include <memory>

#include "app/base/effect_names.hpp"
#include "app/base/output.hpp"
#include "app/base/progress.hpp"
#include "app/base/text.hpp"
#include "app/firmware/model_config.hpp"
#include "app/firmware/q15_config.hpp"
#include "app/learn/trace.hpp"
#include "app/report/report.hpp"
#include "app/trace/page.hpp"
#include "app/trace/report.hpp"
#include "app/trace/text.hpp"

namespace dqw {
namespace {

struct Options : CommonOptions {
    std::vector<std::string> logs;
    std::vector<std::string> effects;
};

/// The tracer says what is wrong with all logs; the first stands for them.
TraceResult traced(const std::vector<Log>& logs, const Options& options)
{
    TraceOptions how;
    how.effects = options.effects;
    Progress progress("tracing");
    how.progress = progress.callback();
    try {
        return trace(logs, how);
    } catch (const std::invalid_argument& error) {
        std::string what = error.what();
        const std::string path = logs.front().path + ": ";
        if (what.rfind(path, 0) == 0) what.erase(0, path.size());
        throw InputError(logs.front().path, logs.front().rows() + 1, what);
    }
}

/// The learners on the same rows; where they can tell nothing, their residual says nothing.
void learn_as_well(const std::vector<Log>& logs, TraceReport& report)
{
    try {
        report.learner_before = learn_fit(logs, report.trace, false);
        report.learner_after = learn_fit(logs, report.trace, true);
        const auto& learned = report.learner_after->parameters;
        if (std::any_of(learned.begin(), learned.end(), [](const Estimate& e) { return !e.given; })) return;
        report.trace.notes.emplace_back("no learners: this log determines none of their parameters");
    } catch (const std::invalid_argument& error) {
        // The trace holds without them.
        report.trace.notes.push_back(std::string("no learners: ") + error.what());
    }
    report.learner_before.reset();
    report.learner_after.reset();
}

void write_file(const std::string& path, const std::string& text)
{
    OutputFile file(path);
    file.write(text);
    file.close();
}

void write_q15_config(const std::vector<Log>& logs, TraceReport& report, const Options& options)
{
    try {
        write_file(path_in(options.out_dir, "dqw_q15_config.h"),
                   q15_config_text(logs, report.trace.after.parameters, report.trace.inputs));
    } catch (const std::invalid_argument& error) {
        report.trace.notes.push_back(std::string("no dqw_q15_config.h: ") + error.what());
    }
}

int run_trace(const Options& options)
{
    std::vector<std::string> notes;
    const std::vector<Log> logs = read_logs(options.logs, options, notes);
    // What cannot be written is said before the work, not after.
    make_directory(options.out_dir);
    TraceReport report;
    report.logs = options.logs;
    report.trace = traced(logs, options);
    report.trace.notes.insert(report.trace.notes.begin(), notes.begin(), notes.end());
    learn_as_well(logs, report);
    const std::string json = json_text(trace_json(report));
    write_file(path_in(options.out_dir, "trace.json"), json);
    write_file(path_in(options.out_dir, "report.html"), report_page(report));
    write_file(path_in(options.out_dir, "dqw_model_config.h"), model_config_text(report.trace, report.logs));
    if (report.trace.regime != Regime::mechanical) write_q15_config(logs, report, options);
    print_notes(report.trace.notes);
    print(options.json ? json : trace_text(report));
    return exit_done;
}

}  // namespace

Command add_trace(CLI::App& app)
{
    CLI::App* command = app.add_subcommand("trace", "find the physical effect that the model of a log lacks");
    auto options = std::make_shared<Options>();
    options->all_columns = true;
    command->add_option("LOG.csv", options->logs, "log, or several of one machine and regime")
        ->required()
        ->type_name("");
    add_common(*command, *options);
    command->add_option("--effect", options->effects, "try this effect alone, or these: " + list(effect_names(), 99))
        ->take_all()
        ->allow_extra_args(false)
        ->check(CLI::IsMember(effect_names()))
        ->type_name("NAME");
    command->footer("Writes trace.json, report.html, dqw_model_config.h and, where the log is not mechanical, "
                    "dqw_q15_config.h for port_q15/ into DIR.");
    return {command, [=] { return run_trace(*options); }};
}

}  // namespace dqw
