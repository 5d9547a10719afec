// Which drive is simulated: a scenario with what is said over it.
#ifndef DQW_APP_JOB_SCENARIO_HPP
#define DQW_APP_JOB_SCENARIO_HPP

#include <string>
#include <vector>

#include "app/job/options.hpp"
#include "app/job/simulate.hpp"

namespace dqw {

/// The scenario asked for, with machine file, settings and seed. Throws UsageError, ValueError or InputError.
dqw_sim_scenario scenario_asked(const Options& options, std::vector<std::string>& notes);

/// The object of schema dqwatch.simulation/1; files that were not written are null.
std::string simulation_json(const Simulation& simulation, const std::string& csv, const std::string& toml,
                            const std::vector<std::string>& notes);

}  // namespace dqw
#endif
