// Runs a scenario of the simulator and writes its log in the documented format.
#ifndef DQW_APP_JOB_SIMULATE_HPP
#define DQW_APP_JOB_SIMULATE_HPP

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "dqw_sim.h"
#include "ref/log/log.hpp"

namespace dqw {

struct Simulation {
    dqw_sim_scenario scenario;
    std::vector<dqw_sim_row> rows;
    Machine truth;  ///< of the healthy machine at its reference temperature
};

/// The scenario called `name`; throws UsageError, naming those there are.
dqw_sim_scenario scenario_named(const std::string& name);

/// Applies "key=value"; throws UsageError where there is no such key, ValueError on a value that is none of it.
void set(dqw_sim_scenario& scenario, const std::string& assignment);

/// The regime of the log that a run of it writes.
std::string regime_of(const dqw_sim_scenario& scenario);

/// Simulates. Throws ValueError where the scenario contradicts itself, InputError on a flux map, std::runtime_error
/// otherwise.
Simulation simulate(const dqw_sim_scenario& scenario, const std::function<void(double)>& progress);

/// Writes the log. A mechanical one has no voltages, a polled one no angle and no torque.
void write_csv(const Simulation& simulation, const std::string& path);

/// Writes what the simulated machine is, as nominal values; `command` says how to make it again.
void write_toml(const Simulation& simulation, const std::string& path, const std::string& command);

/// A simulation and where its log is.
struct Written {
    Simulation simulation;
    std::string csv, toml;
};

/// Simulates and writes DIR/SCENARIO.csv and .toml; shows how far it is.
Written simulate_into(const std::string& dir, const dqw_sim_scenario& scenario, const std::string& command);

/// The machine's parameters as far as there are any, by name.
nlohmann::ordered_json truth_json(const Simulation& simulation);

}  // namespace dqw
#endif
