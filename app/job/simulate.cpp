#include "app/job/simulate.hpp"

#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>

#include "app/base/input_error.hpp"
#include "app/base/output.hpp"
#include "app/base/parameters.hpp"
#include "app/base/progress.hpp"
#include "app/base/text.hpp"
#include "app/job/options.hpp"
#include "app/read/flux_map.hpp"

namespace dqw {
namespace {

/// 1.9 GB of rows. A longer run can be logged more rarely (drive.log_every).
constexpr std::size_t most_rows = 20000000;

struct Field {
    const char* name;
    double dqw_sim_row::*value;
    bool mechanical;  ///< also in a log of the mechanical side alone
    bool polled;      ///< also in a vendor's tool's
};

const Field fields[] = {
    {"t_s", &dqw_sim_row::t_s, true, true},
    {"v_d_V", &dqw_sim_row::v_d_V, false, true},
    {"v_q_V", &dqw_sim_row::v_q_V, false, true},
    {"i_d_A", &dqw_sim_row::i_d_A, false, true},
    {"i_q_A", &dqw_sim_row::i_q_A, true, true},
    {"w_m_rad_s", &dqw_sim_row::w_m_rad_s, true, true},
    {"theta_e_rad", &dqw_sim_row::theta_e_rad, false, false},
    {"theta_m_rad", &dqw_sim_row::theta_m_rad, true, false},
    {"v_dc_V", &dqw_sim_row::v_dc_V, false, true},
    {"temp_winding_C", &dqw_sim_row::temp_winding_C, false, true},
    {"temp_magnet_C", &dqw_sim_row::temp_magnet_C, false, true},
    {"torque_Nm", &dqw_sim_row::torque_Nm, true, false},
};

[[noreturn]] void fail(const dqw_sim_scenario& scenario, int status, const dqw_sim_report& report)
{
    const std::string what = fmt::format("{}: {}", scenario.name,
                                         report.message[0] ? report.message : dqw_sim_status_text(status));
    if (status == DQW_SIM_ERR_SCENARIO) throw ValueError(what);
    if (status == DQW_SIM_ERR_MAP) {
        // The row at fault, where one is.
        if (scenario.machine.flux_map[0] != '\0') read_flux_map(scenario.machine.flux_map);
        const std::string curve = scenario.nonideal.inverter_curve,
                          said = report.message[0] ? report.message : dqw_sim_status_text(status);
        throw InputError(
            !curve.empty() && said.compare(0, curve.size(), curve) == 0 ? curve : scenario.machine.flux_map, 1, said);
    }
    throw std::runtime_error(what);
}

std::string chosen(const dqw_sim_scenario& scenario, const char* key)
{
    char name[64];
    dqw_sim_chosen(&scenario, key, name, sizeof name);
    return name;
}

/// What a reader of the log cannot see in its rows.
std::string about_drive(const dqw_sim_scenario& s)
{
    const bool switched = s.inverter.modulation != DQW_SIM_MODULATION_MEAN, polled = s.polled.rate_Hz > 0;
    std::string text;
    if (switched) text += fmt::format("modulation = \"{}\"\n", chosen(s, "inverter.modulation"));
    if (switched || s.sensing.observer)
        text += fmt::format("angle = \"{}\"\n", s.sensing.observer ? "observer" : "encoder");
    if (switched || polled) text += fmt::format("period_s = {}\n", s.drive.dt_s);
    // A link that is read in steps, for good by half of one.
    if (!polled)
        text += fmt::format("voltage_scale = {:.3g}\n", s.noise.step_v_dc_V / (s.drive.v_dc_V * std::sqrt(12.0)));
    return text;
}

}  // namespace

dqw_sim_scenario scenario_named(const std::string& name)
{
    if (const dqw_sim_scenario* found = dqw_sim_scenario_find(name.c_str())) return *found;
    std::vector<std::string> names;
    for (std::size_t i = 0; i < dqw_sim_scenario_count(); ++i) names.push_back(dqw_sim_scenario_at(i)->name);
    throw UsageError(fmt::format("no scenario {}; there are {}", shown(name), list(names, 100)));
}

void set(dqw_sim_scenario& scenario, const std::string& assignment)
{
    const auto equals = assignment.find('=');
    if (equals == assignment.npos || equals == 0)
        throw UsageError(fmt::format("--set {}: expected key=value", shown(assignment)));
    const std::string key = assignment.substr(0, equals), value = assignment.substr(equals + 1);
    const int status = dqw_sim_set(&scenario, key.c_str(), value.c_str());
    if (status == DQW_SIM_ERR_KEY)
        throw UsageError(fmt::format("--set: no key {}; `dqwatch sim --list-keys` names all", shown(key)));
    if (status == DQW_SIM_OK) return;
    char expected[400];
    dqw_sim_expected(key.c_str(), expected, sizeof expected);
    throw ValueError(fmt::format("{}: {} is no value for it; expected {}", key, shown(value), expected));
}

std::string regime_of(const dqw_sim_scenario& scenario)
{
    return scenario.polled.rate_Hz > 0 ? "polled" : scenario.regime;
}

Simulation simulate(const dqw_sim_scenario& scenario, const std::function<void(double)>& progress)
{
    Simulation run;
    run.scenario = scenario;
    // The drive's own rows, which a polled log is made of.
    dqw_sim_scenario unpolled = scenario;
    unpolled.polled = {};
    const std::size_t count = dqw_sim_rows(&scenario), most = dqw_sim_rows(&unpolled);
    if (most > most_rows)
        throw ValueError(fmt::format("{}: {} rows; at most {}: {}lower duration_s", scenario.name, most, most_rows,
                                     scenario.polled.rate_Hz > 0 ? "" : "raise drive.log_every or "));
    run.rows.resize(count);
    dqw_sim_report report = {};
    const auto forward = [](void* context, double fraction) {
        (*static_cast<const std::function<void(double)>*>(context))(fraction);
        return 0;
    };
    auto* context = const_cast<std::function<void(double)>*>(&progress);
    const int status = dqw_sim_run(&scenario, run.rows.data(), count, &report, forward, context);
    if (status != DQW_SIM_OK) fail(scenario, status, report);

    const dqw_sim_machine& m = scenario.machine;
    const bool map = m.flux_map[0] != '\0';
    run.truth.name = scenario.name;
    run.truth.pole_pairs = m.pole_pairs;
    run.truth.R_ohm = m.R_ohm;
    run.truth.Ld_H = map ? report.Ld_H : m.Ld_H;
    run.truth.Lq_H = map ? report.Lq_H : m.Lq_H;
    run.truth.psi_Wb = map ? report.psi_Wb : m.psi_Wb;
    run.truth.J_kgm2 = m.J_kgm2;
    run.truth.B_Nms_rad = m.B_Nms_rad;
    run.truth.torque_constant_Nm_A = 1.5 * m.pole_pairs * *run.truth.psi_Wb;
    return run;
}

void write_csv(const Simulation& simulation, const std::string& path)
{
    const std::string regime = regime_of(simulation.scenario);
    const bool mechanical = regime == "mechanical", polled = regime == "polled";
    std::vector<const Field*> written;
    for (const Field& f : fields)
        if ((!mechanical || f.mechanical) && (!polled || f.polled)) written.push_back(&f);
    OutputFile file(path);
    std::string text;
    for (const Field* f : written) text += (f == written.front() ? "" : ",") + std::string(f->name);
    text += '\n';
    auto out = std::back_inserter(text);
    for (const dqw_sim_row& row : simulation.rows) {
        for (const Field* f : written) {
            if (f != written.front()) text += ',';
            // Time keeps its steps in a long log; nine digits are more than any sensor has.
            fmt::format_to(out, f->value == &dqw_sim_row::t_s ? "{:.12g}" : "{:.9g}", row.*(f->value));
        }
        text += '\n';
        if (text.size() < (std::size_t{1} << 16)) continue;
        file.write(text);
        text.clear();
    }
    file.write(text);
    file.close();
}

void write_toml(const Simulation& simulation, const std::string& path, const std::string& command)
{
    const Machine& m = simulation.truth;
    std::string text = "# " + command + "\n# The values are the simulated machine's own.\n";
    if (simulation.scenario.method == DQW_SIM_RK4) text += "# Integrated by fixed steps.\n";
    text += fmt::format("[log]\nregime = \"{}\"\n", regime_of(simulation.scenario));
    if (!(simulation.scenario.polled.rate_Hz > 0)) text += "voltage_interval = \"next\"\n";
    text += about_drive(simulation.scenario);
    text += fmt::format("[machine]\nname = \"{}\"\npole_pairs = {}\n", m.name, simulation.scenario.machine.pole_pairs);
    for (const Parameter& p : kParameters)
        // What the reader would refuse is left out: a machine without inertia data has J = 0.
        if (p.nominal != &Machine::pole_pairs && m.*(p.nominal) > 0.0)
            text += fmt::format("{} = {}\n", p.name, *(m.*(p.nominal)));
    write_file(path, text);
}

Written simulate_into(const std::string& dir, const dqw_sim_scenario& scenario, const std::string& command)
{
    make_directory(dir);
    const std::string name = scenario.name;
    Written w{{}, path_in(dir, name + ".csv"), path_in(dir, name + ".toml")};
    {
        Progress progress("simulating");
        w.simulation = simulate(scenario, progress.callback());
    }
    write_csv(w.simulation, w.csv);
    write_toml(w.simulation, w.toml, command);
    return w;
}

nlohmann::ordered_json truth_json(const Simulation& simulation)
{
    auto truth = nlohmann::ordered_json::object();
    for (const Parameter& p : kParameters)
        if (const auto value = simulation.truth.*(p.nominal)) truth[p.name] = *value;
    return truth;
}

}  // namespace dqw
