#include "app/job/trace.hpp"

#include <algorithm>

#include "app/base/progress.hpp"
#include "app/job/logs.hpp"
#include "app/learn/trace.hpp"
#include "app/report/compare.hpp"

namespace dqw {
namespace {

TraceResult traced(const std::vector<Log>& logs, const Options& options)
{
    TraceOptions how;
    how.effects = options.effects;
    Progress progress("tracing", options.progress);
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

}  // namespace

std::vector<Log> logs_to_trace(const Options& options, std::vector<std::string>& notes)
{
    std::vector<Log> logs = read_logs(options.logs, options, true, notes, false, true);
    if (logs.front().regime == Regime::polled)
        throw InputError(logs.front().path, 1,
                         "a polled log: errors of its rows last longer than those that trace can judge, and would be "
                         "given names; expected a log of another regime (fit takes this one)");
    return logs;
}

TraceReport trace_logs(const std::vector<Log>& logs, const Options& options, const std::vector<std::string>& notes)
{
    TraceReport report;
    report.logs = options.logs;
    report.trace = traced(logs, options);
    report.trace.notes.insert(report.trace.notes.begin(), notes.begin(), notes.end());
    learn_as_well(logs, report);
    return report;
}

}  // namespace dqw
