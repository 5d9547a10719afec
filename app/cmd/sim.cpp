#include "app/cmd/sim.hpp"

#include <fmt/format.h>

#include <charconv>
#include <memory>

#include "app/base/output.hpp"
#include "app/base/progress.hpp"
#include "app/base/quantity.hpp"
#include "app/base/text.hpp"
#include "app/cmd/simulate.hpp"
#include "app/read/machine_file.hpp"
#include "app/report/report.hpp"

namespace dqw {
namespace {

struct Options : CommonOptions {
    std::string scenario;
    std::vector<std::string> settings;
    std::optional<std::uint64_t> seed;
    bool list = false, list_keys = false;
};

int list_scenarios(bool json)
{
    auto all = nlohmann::ordered_json::array();
    std::vector<std::vector<std::string>> rows = {{"scenario", "regime", "rows"}};
    std::vector<std::string> about = {"what"};
    for (std::size_t i = 0; i < dqw_sim_scenario_count(); ++i) {
        const dqw_sim_scenario* s = dqw_sim_scenario_at(i);
        rows.push_back({s->name, s->regime, std::to_string(dqw_sim_rows(s))});
        about.push_back(s->about);
        all.push_back({{"name", s->name},
                       {"about", s->about},
                       {"regime", s->regime},
                       {"rows", dqw_sim_rows(s)},
                       {"duration_s", s->duration_s}});
    }
    if (json) {
        print(json_text({{"schema", "dqwatch.scenarios/1"}, {"scenarios", all}}));
        return exit_done;
    }
    // The description is left-aligned, unlike the table's own columns.
    std::string text, lines = table(rows);
    std::size_t width = 0, at = 0;
    for (const auto& row : rows) width = std::max(width, row[0].size());
    for (const auto& what : about) {
        const auto end = lines.find('\n', at);
        text += lines.substr(at, end - at) + "  " + what + "\n";
        at = end + 1;
    }
    print(text);
    return exit_done;
}

int list_keys(bool json)
{
    auto keys = nlohmann::ordered_json::array();
    std::string text;
    for (std::size_t i = 0; const char* key = dqw_sim_key_at(i); ++i) {
        keys.push_back(key);
        text += std::string(key) + "\n";
    }
    print(json ? json_text({{"schema", "dqwatch.keys/1"}, {"keys", keys}}) : text);
    return exit_done;
}

/// The scenario's machine takes the values of a machine file.
void take_machine(dqw_sim_scenario& scenario, const std::string& path, std::vector<std::string>& notes)
{
    const MachineFile file = read_machine_file(path);
    const Machine& m = file.machine;
    notes.insert(notes.end(), file.notes.begin(), file.notes.end());
    if (m.pole_pairs) scenario.machine.pole_pairs = static_cast<int>(*m.pole_pairs);
    const auto take = [](double& to, const std::optional<double>& from) { to = from.value_or(to); };
    take(scenario.machine.R_ohm, m.R_ohm);
    take(scenario.machine.Ld_H, m.Ld_H);
    take(scenario.machine.Lq_H, m.Lq_H);
    take(scenario.machine.psi_Wb, m.psi_Wb);
    take(scenario.machine.J_kgm2, m.J_kgm2);
    take(scenario.machine.B_Nms_rad, m.B_Nms_rad);
}

std::string command_of(const Options& options)
{
    std::string command = "dqwatch sim " + options.scenario;
    if (!options.machine_file.empty()) command += " --machine " + options.machine_file;
    if (options.pole_pairs) command += fmt::format(" --pole-pairs {}", *options.pole_pairs);
    if (options.seed) command += fmt::format(" --seed {}", *options.seed);
    for (const auto& setting : options.settings) command += " --set " + setting;
    for (char& c : command)
        if (static_cast<unsigned char>(c) < 0x20) c = '?';
    return command;
}

int run(const Options& options)
{
    if (options.list) return list_scenarios(options.json);
    if (options.list_keys) return list_keys(options.json);
    if (options.scenario.empty()) throw UsageError("sim: SCENARIO is missing; `dqwatch sim --list` names all");
    dqw_sim_scenario scenario = scenario_named(options.scenario);
    std::vector<std::string> notes;
    if (!options.machine_file.empty()) take_machine(scenario, options.machine_file, notes);
    if (options.pole_pairs) scenario.machine.pole_pairs = *options.pole_pairs;
    for (const auto& setting : options.settings) set(scenario, setting);
    if (options.seed) scenario.seed = *options.seed;

    make_directory(options.out_dir);
    const std::string csv = path_in(options.out_dir, options.scenario + ".csv"),
                      toml = path_in(options.out_dir, options.scenario + ".toml");
    Simulation simulation;
    {
        Progress progress("simulating");
        simulation = simulate(scenario, progress.callback());
    }
    write_csv(simulation, csv);
    write_toml(simulation, toml, command_of(options));
    print_notes(notes);
    if (options.json) {
        auto truth = nlohmann::ordered_json::object();
        for (const auto& name : known_parameters())
            if (const auto value = nominal_of(simulation.truth, name)) truth[name] = *value;
        truth["pole_pairs"] = scenario.machine.pole_pairs;
        print(json_text({{"schema", "dqwatch.simulation/1"},
                         {"scenario", options.scenario},
                         {"regime", scenario.regime},
                         {"rows", simulation.rows.size()},
                         {"seed", scenario.seed},
                         {"csv", csv},
                         {"toml", toml},
                         {"truth", truth},
                         {"notes", notes}}));
    } else {
        print(fmt::format("{}: {}, {}; its machine: {}\n", csv, scenario.regime, counted(simulation.rows.size(), "row"),
                          toml));
    }
    return exit_done;
}

/// A number that does not fit is no seed: the parser would take the nearest that does.
std::uint64_t seed_of(const std::string& text)
{
    std::uint64_t seed = 0;
    const char* const end = text.data() + text.size();
    const auto [last, error] = std::from_chars(text.data(), end, seed);
    if (error != std::errc{} || last != end)
        throw CLI::ValidationError("--seed", shown(text) + " is no whole number from 0 to 18446744073709551615");
    return seed;
}

}  // namespace

Command add_sim(CLI::App& app)
{
    CLI::App* command = app.add_subcommand("sim", "simulate a drive, write DIR/SCENARIO.csv and .toml");
    auto options = std::make_shared<Options>();
    command->add_option("SCENARIO", options->scenario, "which drive; --list names all")->type_name("");
    command->add_flag("--list", options->list, "name the scenarios");
    command->add_flag("--list-keys", options->list_keys, "name the keys of --set");
    command->add_option("--set", options->settings, "change one value, e.g. machine.R_ohm=0.5; repeatable")
        ->type_name("KEY=VALUE")
        ->allow_extra_args(false)
        ->take_all();
    command
        ->add_option_function<std::string>(
            "--seed", [options](const std::string& text) { options->seed = seed_of(text); },
            "of noise and random excitation")
        ->type_name("N");
    add_common(*command, *options);
    return {command, [=] { return run(*options); }};
}

}  // namespace dqw
