#include "app/cmd/trace.hpp"

#include <nlohmann/json.hpp>

#include "app/base/learnable.hpp"
#include "app/base/output.hpp"
#include "app/firmware/model_config.hpp"
#include "app/firmware/q15_config.hpp"
#include "app/job/trace.hpp"
#include "app/report/report.hpp"
#include "app/trace/flux_map.hpp"
#include "app/trace/page.hpp"
#include "app/trace/report.hpp"

namespace dqw {
namespace {

void write_q15_config(const std::vector<Log>& logs, TraceReport& report, OutputFolder& folder)
{
    try {
        folder.write("dqw_q15_config.h",
                     q15_config_text(logs, report.trace.after.parameters, learnable(report.trace.inputs)));
    } catch (const std::invalid_argument& error) {
        report.trace.notes.push_back(std::string("no dqw_q15_config.h: ") + error.what());
    }
}

void write_flux_map(const TraceResult& trace, OutputFolder& folder)
{
    if (trace.map.empty()) return;
    folder.write("flux_map.csv", flux_map_csv(trace.map));
    if (const double p = pole_pairs_of(trace); p > 0.0 && !mtpa(trace.map, p).empty())
        folder.write("mtpa.csv", mtpa_csv(trace.map, p));
}

}  // namespace

int trace_command(const Options& options)
{
    std::vector<std::string> notes;
    const std::vector<Log> logs = logs_to_trace(options, notes);
    OutputFolder folder(options.out_dir);
    TraceReport report = trace_logs(logs, options, notes);
    const std::string json = json_text(trace_json(report));
    folder.write("trace.json", json);
    folder.write("report.html", report_page(report));
    folder.write("dqw_model_config.h", model_config_text(report.trace, report.logs));
    write_flux_map(report.trace, folder);
    if (report.trace.regime != Regime::mechanical) write_q15_config(logs, report, folder);
    print_notes(report.trace.notes);
    folder.tell();
    print(options.json ? json : trace_text(report));
    return exit_done;
}

}  // namespace dqw
