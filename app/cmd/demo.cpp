#include "app/cmd/demo.hpp"

#include "app/cmd/logs.hpp"
#include <fmt/format.h>

#include <memory>

#include "app/base/output.hpp"
#include "app/base/progress.hpp"
#include "app/base/quantity.hpp"
#include "app/base/text.hpp"
#include "app/cmd/simulate.hpp"
#include "app/learn/learn.hpp"
#include "app/report/report.hpp"
#include "ref/fit/fit.hpp"

namespace dqw {
namespace {

struct Options : CommonOptions {
    std::string scenario = "servo";
};

const Estimate* find(const Result& result, const std::string& name)
{
    for (const Estimate& e : result.parameters)
        if (e.name == name) return &e;
    return nullptr;
}

/// "370.2 ± 1.9 (+0.05 %)", in the unit of the row.
std::string cell(const Result& result, const std::string& name, double truth)
{
    const Estimate* e = find(result, name);
    if (!e) return "not identifiable";
    if (e->given) return "given";
    return fmt::format("{} ({:+.2f} %)", with_sd(quantity(name, e->value, e->sd)), 100 * (e->value - truth) / truth);
}

std::string comparison(const Machine& truth, const Result& learned, const Result& fitted)
{
    std::vector<std::vector<std::string>> rows = {{"parameter", "truth", "float learner ± sd", "reference ± sd"}};
    for (const auto& name : known_parameters()) {
        const auto value = nominal_of(truth, name);
        if (!value || (!find(learned, name) && !find(fitted, name))) continue;
        rows.push_back(
            {name, with_sd(quantity(name, *value, 0)), cell(learned, name, *value), cell(fitted, name, *value)});
    }
    std::string out = table(rows);
    out += fmt::format("residual: learner {:.4g} {}, reference {:.4g} {}\n", learned.residual_rms,
                       learned.residual_unit, fitted.residual_rms, fitted.residual_unit);
    return out;
}

int run(const Options& options)
{
    dqw_sim_scenario scenario = scenario_named(options.scenario);
    if (options.pole_pairs) scenario.machine.pole_pairs = *options.pole_pairs;
    make_directory(options.out_dir);
    const std::string csv = path_in(options.out_dir, options.scenario + ".csv");
    Simulation simulation;
    {
        Progress progress("simulating");
        simulation = simulate(scenario, progress.callback());
    }
    write_csv(simulation, csv);
    write_toml(simulation, path_in(options.out_dir, options.scenario + ".toml"), "dqwatch sim " + options.scenario);

    // The log takes the way that a measured one takes, through the file.
    std::vector<std::string> notes;
    CommonOptions read = options;
    const std::vector<Log> logs = read_logs({csv}, read, notes);
    LearnOptions learn_options;
    learn_options.parameters = options.parameters;
    FitOptions fit_options;
    fit_options.parameters = options.parameters;
    Result learned, fitted;
    {
        Progress progress("learning");
        learn_options.progress = progress.callback();
        learned = learn(logs, learn_options);
    }
    {
        Progress progress("fitting");
        fit_options.progress = progress.callback();
        fitted = fit(logs, fit_options);
    }
    auto truth = nlohmann::ordered_json::object();
    for (const auto& name : known_parameters())
        if (const auto value = nominal_of(simulation.truth, name)) truth[name] = *value;
    const std::string json = json_text({{"schema", "dqwatch.demo/1"},
                                        {"scenario", options.scenario},
                                        {"truth", truth},
                                        {"float", result_json(learned, {})},
                                        {"reference", result_json(fitted, {})},
                                        {"notes", notes}});
    OutputFile file(path_in(options.out_dir, "demo.json"));
    file.write(json);
    file.close();
    print_notes(learned.notes);
    print_notes(fitted.notes);
    if (options.json)
        print(json);
    else
        print(fmt::format("{}: {}\n{}, {}\n\n{}", scenario.name, scenario.about, csv,
                          counted(logs.front().rows(), "row"), comparison(simulation.truth, learned, fitted)));
    return exit_done;
}

}  // namespace

Command add_demo(CLI::App& app)
{
    CLI::App* command = app.add_subcommand("demo",
                                           "simulate a servo, learn it, fit it, and compare both with the truth");
    auto options = std::make_shared<Options>();
    add_common(*command, *options);
    add_parameters(*command, *options);
    command->footer("Writes DIR/servo.csv, DIR/servo.toml and DIR/demo.json.");
    return {command, [=] { return run(*options); }};
}

}  // namespace dqw
