#include "app/cmd/sim.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "app/base/output.hpp"
#include "app/base/quantity.hpp"
#include "app/base/text.hpp"
#include "app/job/scenario.hpp"
#include "app/report/report.hpp"

namespace dqw {
namespace {

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
        char expected[400];
        dqw_sim_expected(key, expected, sizeof expected);
        keys.push_back(key);
        text += fmt::format("{:<44} {}\n", key, expected);
    }
    print(json ? json_text({{"schema", "dqwatch.keys/1"}, {"keys", keys}}) : text);
    return exit_done;
}

/// An option and a --set that name one key: nobody knows which was meant. Of one key's --sets the last counts.
void refuse_twice(const Options& options)
{
    for (const std::string& setting : options.settings) {
        const std::string key = setting.substr(0, setting.find('='));
        if ((options.seed && key == "seed") || (options.pole_pairs && key == "machine.pole_pairs"))
            throw UsageError(fmt::format("--set {}: an option said it before", shown(key)));
    }
}

std::string command_of(const Options& options)
{
    std::string command = "dqwatch sim " + options.scenario;
    if (!options.machine_file.empty()) command += " --machine " + options.machine_file;
    if (options.pole_pairs) command += fmt::format(" --pole-pairs {}", *options.pole_pairs);
    if (options.seed) command += fmt::format(" --seed {}", *options.seed);
    if (options.polled) command += " --polled " + *options.polled;
    if (options.modulation) command += " --modulation " + *options.modulation;
    for (const auto& setting : options.settings) command += " --set " + setting;
    for (char& c : command)
        if (static_cast<unsigned char>(c) < 0x20) c = '?';
    return command;
}

}  // namespace

int sim_command(const Options& options)
{
    if (options.list) return list_scenarios(options.json);
    if (options.list_keys) return list_keys(options.json);
    if (options.scenario.empty()) throw UsageError("sim: SCENARIO is missing; `dqwatch sim --list` names all");
    refuse_twice(options);
    std::vector<std::string> notes;
    const dqw_sim_scenario scenario = scenario_asked(options, notes);
    const Written written = simulate_into(options.out_dir, scenario, command_of(options));
    const std::size_t rows = written.simulation.rows.size();
    print_notes(notes);
    if (options.json) {
        print(simulation_json(written.simulation, written.csv, written.toml, notes));
    } else {
        print(fmt::format("{}: {}, {}; its machine: {}\n", written.csv, regime_of(scenario), counted(rows, "row"),
                          written.toml));
    }
    return exit_done;
}

}  // namespace dqw
