#include "app/cmd/sim.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "app/base/output.hpp"
#include "app/base/quantity.hpp"
#include "app/base/text.hpp"
#include "app/cmd/simulate.hpp"
#include "app/read/machine_file.hpp"
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

/// The speed up to which the drive has the voltage for its largest current.
double speed_base(const dqw_sim_scenario& s)
{
    const dqw_sim_machine& m = s.machine;
    const double flux = m.psi_Wb + std::fmin(m.Ld_H, m.Lq_H) * s.drive.i_max_A;
    return s.drive.v_dc_V / std::sqrt(3.0) / (m.pole_pairs * flux);
}

/// What a poll of a VESC is like.
void poll(dqw_sim_scenario& scenario, const std::string& rate_Hz)
{
    set(scenario, "polled.rate_Hz=" + rate_Hz);
    dqw_sim_polled& p = scenario.polled;
    if (!(p.rate_Hz > 0)) throw ValueError("polled.rate_Hz must be above 0");
    p.step_i_A = 0.01, p.step_v_V = 0.001, p.step_erpm = 1, p.step_v_dc_V = 0.1;
    p.jitter_s = 1e-3, p.lost_fraction = 0.02, p.repeated_fraction = 0.01;
}

/// Settings that say nothing of it leave the speed's noise to the drive that they make.
void add_speed_noise(dqw_sim_scenario& scenario, const std::vector<std::string>& settings)
{
    const std::string key = "polled.speed_noise_rad_s=";
    for (const auto& setting : settings)
        if (setting.compare(0, key.size(), key) == 0) return;
    const double base = speed_base(scenario);
    // Where it is not, the scenario is refused by what it lacks.
    if (std::isfinite(base) && base > 0) scenario.polled.speed_noise_rad_s = 0.005 * base;
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
    dqw_sim_scenario scenario = scenario_named(options.scenario);
    std::vector<std::string> notes;
    if (!options.machine_file.empty()) take_machine(scenario, options.machine_file, notes);
    if (options.pole_pairs) scenario.machine.pole_pairs = *options.pole_pairs;
    if (options.polled) poll(scenario, *options.polled);
    if (options.modulation) set(scenario, "inverter.modulation=" + *options.modulation);
    for (const auto& setting : options.settings) set(scenario, setting);
    if (options.polled) add_speed_noise(scenario, options.settings);
    if (options.seed) scenario.seed = *options.seed;

    const Written written = simulate_into(options.out_dir, scenario, command_of(options));
    const std::size_t rows = written.simulation.rows.size();
    print_notes(notes);
    if (options.json) {
        auto truth = truth_json(written.simulation);
        truth["pole_pairs"] = scenario.machine.pole_pairs;
        print(json_text({{"schema", "dqwatch.simulation/1"},
                         {"scenario", options.scenario},
                         {"regime", regime_of(scenario)},
                         {"rows", rows},
                         {"seed", scenario.seed},
                         {"csv", written.csv},
                         {"toml", written.toml},
                         {"truth", truth},
                         {"notes", notes}}));
    } else {
        print(fmt::format("{}: {}, {}; its machine: {}\n", written.csv, regime_of(scenario), counted(rows, "row"),
                          written.toml));
    }
    return exit_done;
}

}  // namespace dqw
