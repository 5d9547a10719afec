#include "app/cmd/trace.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "app/base/learnable.hpp"
#include "app/base/output.hpp"
#include "app/base/progress.hpp"
#include "app/cmd/logs.hpp"
#include "app/firmware/model_config.hpp"
#include "app/firmware/q15_config.hpp"
#include "app/learn/trace.hpp"
#include "app/report/compare.hpp"
#include "app/report/report.hpp"
#include "app/trace/flux_map.hpp"
#include "app/trace/page.hpp"
#include "app/trace/report.hpp"

namespace dqw {
namespace {

TraceResult traced(const std::vector<Log>& logs, const Options& options)
{
    TraceOptions how;
    how.effects = options.effects;
    Progress progress("tracing");
    how.progress = progress.callback();
    return with_logs(logs, [&] { return trace(logs, how); });
}

/// The learners on the same rows; where they can tell nothing, their residual says nothing.
void learn_as_well(const std::vector<Log>& logs, TraceReport& report)
{
    try {
        report.learner_before = learn_fit(logs, report.trace, false);
        report.learner_after = learn_fit(logs, report.trace, true);
        const auto& learned = report.learner_after->parameters;
        if (std::any_of(learned.begin(), learned.end(), [](const Estimate& e) { return !e.given; })) {
            for (const std::string& note :
                 disagreements(learned, "the learners", report.trace.after.parameters, "the reference"))
                report.trace.notes.push_back(note);
            return;
        }
        report.trace.notes.emplace_back("no learners: this log determines none of their parameters");
    } catch (const std::invalid_argument& error) {
        // The trace holds without them.
        report.trace.notes.push_back(std::string("no learners: ") + error.what());
    }
    report.learner_before.reset();
    report.learner_after.reset();
}

void write_q15_config(const std::vector<Log>& logs, TraceReport& report, const Options& options)
{
    try {
        write_file(path_in(options.out_dir, "dqw_q15_config.h"),
                   q15_config_text(logs, report.trace.after.parameters, learnable(report.trace.inputs)));
    } catch (const std::invalid_argument& error) {
        report.trace.notes.push_back(std::string("no dqw_q15_config.h: ") + error.what());
    }
}

void write_flux_map(const TraceResult& trace, const Options& options)
{
    if (trace.map.empty()) return;
    write_file(path_in(options.out_dir, "flux_map.csv"), flux_map_csv(trace.map));
    if (const double p = pole_pairs_of(trace); p > 0.0 && !mtpa(trace.map, p).empty())
        write_file(path_in(options.out_dir, "mtpa.csv"), mtpa_csv(trace.map, p));
}

}  // namespace

int trace_command(const Options& options)
{
    std::vector<std::string> notes;
    const std::vector<Log> logs = read_logs(options.logs, options, true, notes, false, true);
    if (logs.front().regime == Regime::polled)
        throw InputError(logs.front().path, 1,
                         "a polled log: errors of its rows last longer than those that trace can judge, and would be "
                         "given names; expected a log of another regime (fit takes this one)");
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
    write_flux_map(report.trace, options);
    if (report.trace.regime != Regime::mechanical) write_q15_config(logs, report, options);
    print_notes(report.trace.notes);
    print(options.json ? json : trace_text(report));
    return exit_done;
}

}  // namespace dqw
