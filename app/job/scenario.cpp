#include "app/job/scenario.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "app/read/machine_file.hpp"
#include "app/report/report.hpp"

namespace dqw {
namespace {

/// The scenario's machine takes the values of a machine file.
void take_machine(dqw_sim_scenario& scenario, const MachineFile& file, std::vector<std::string>& notes)
{
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
    // A scenario that is logged now and then is polled instead.
    scenario.drive.log_every = 0, scenario.drive.log_window = 0;
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

}  // namespace

dqw_sim_scenario scenario_asked(const Options& options, std::vector<std::string>& notes)
{
    dqw_sim_scenario scenario = scenario_named(options.scenario);
    if (!options.machine_text.empty())
        take_machine(scenario, read_machine_text("machine", options.machine_text), notes);
    else if (!options.machine_file.empty())
        take_machine(scenario, read_machine_file(options.machine_file), notes);
    if (options.pole_pairs) scenario.machine.pole_pairs = *options.pole_pairs;
    if (options.polled) poll(scenario, *options.polled);
    if (options.modulation) set(scenario, "inverter.modulation=" + *options.modulation);
    for (const auto& setting : options.settings) set(scenario, setting);
    if (options.polled) add_speed_noise(scenario, options.settings);
    if (options.seed) scenario.seed = *options.seed;
    return scenario;
}

std::string simulation_json(const Simulation& simulation, const std::string& csv, const std::string& toml,
                            const std::vector<std::string>& notes)
{
    const auto file = [](const std::string& path) {
        return path.empty() ? nlohmann::ordered_json(nullptr) : nlohmann::ordered_json(path);
    };
    auto truth = truth_json(simulation);
    truth["pole_pairs"] = simulation.scenario.machine.pole_pairs;
    return json_text({{"schema", "dqwatch.simulation/1"},
                      {"scenario", simulation.scenario.name},
                      {"regime", regime_of(simulation.scenario)},
                      {"rows", simulation.rows.size()},
                      {"seed", simulation.scenario.seed},
                      {"csv", file(csv)},
                      {"toml", file(toml)},
                      {"truth", truth},
                      {"notes", notes}});
}

}  // namespace dqw
