#include "app/cmd/demo.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "app/base/output.hpp"
#include "app/base/parameters.hpp"
#include "app/base/quantity.hpp"
#include "app/base/text.hpp"
#include "app/job/estimate.hpp"
#include "app/job/logs.hpp"
#include "app/job/simulate.hpp"
#include "app/report/report.hpp"

namespace dqw {
namespace {

/// "370.2 ± 1.9 (+0.05 %)", in the unit of the row.
std::string cell(const Estimate* e, double truth)
{
    if (!e) return "not identifiable";
    if (e->given) return "given";
    return fmt::format("{} ({:+.2f} %)", with_sd(quantity(e->name, e->value, e->sd)), 100 * (e->value - truth) / truth);
}

std::string comparison(const Machine& truth, const Result& learned, const Result& fitted)
{
    std::vector<std::vector<std::string>> rows = {{"parameter", "truth", "float learner ± sd", "reference ± sd"}};
    for (const auto& name : known_parameters()) {
        const auto value = nominal_of(truth, name);
        const Estimate *by_learner = find_estimate(learned.parameters, name),
                       *by_fit = find_estimate(fitted.parameters, name);
        if (!value || (!by_learner && !by_fit)) continue;
        rows.push_back({name, with_sd(quantity(name, *value, 0)), cell(by_learner, *value), cell(by_fit, *value)});
    }
    return table(rows) + fmt::format("residual: learner {:.4g} {}, reference {:.4g} {}\n", learned.residual_rms,
                                     learned.residual_unit, fitted.residual_rms, fitted.residual_unit);
}

}  // namespace

int demo_command(const Options& options)
{
    dqw_sim_scenario scenario = scenario_named("servo");
    if (options.pole_pairs) scenario.machine.pole_pairs = *options.pole_pairs;
    const Written written = simulate_into(options.out_dir, scenario, "dqwatch sim servo");
    // The log takes the way that a measured one takes, through the file.
    std::vector<std::string> notes;
    const std::vector<Log> logs = read_logs({written.csv}, options, false, notes);
    const Result learned = estimate_by_learners(logs, options, {}).result,
                 fitted = estimate_by_fit(logs, options, {}).result;
    const std::string json = json_text({{"schema", "dqwatch.demo/1"},
                                        {"scenario", scenario.name},
                                        {"truth", truth_json(written.simulation)},
                                        {"float", result_json(learned, {})},
                                        {"reference", result_json(fitted, {})},
                                        {"notes", notes}});
    OutputFolder folder(options.out_dir);
    folder.write("demo.json", json);
    print_notes(learned.notes);
    print_notes(fitted.notes);
    folder.tell();
    print(options.json ? json
                       : fmt::format("{}: {}\n{}, {}\n\n{}", scenario.name, scenario.about, written.csv,
                                     counted(logs.front().rows(), "row"),
                                     comparison(written.simulation.truth, learned, fitted)));
    return exit_done;
}

}  // namespace dqw
