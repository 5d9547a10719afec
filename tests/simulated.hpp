// A scenario simulated, written and read back as a user's log is.
#ifndef DQW_TESTS_SIMULATED_HPP
#define DQW_TESTS_SIMULATED_HPP

#include <string>
#include <vector>

#include "app/job/simulate.hpp"
#include "app/read/log_reader.hpp"
#include "command.hpp"

enum class Beside {
    truth,   ///< the TOML that the simulator writes
    regime,  ///< the regime alone; pole pairs are told
    nothing  ///< pole pairs are told
};

inline dqw::Log simulated(const std::string& scenario, const std::vector<std::string>& settings = {},
                          Beside beside = Beside::truth)
{
    dqw_sim_scenario s = dqw::scenario_named(scenario);
    // From edge to edge CVODE begins anew each time: the same log in twice the time.
    if (s.inverter.modulation != DQW_SIM_MODULATION_MEAN) s.method = DQW_SIM_RK4;
    for (const auto& setting : settings) dqw::set(s, setting);
    const auto simulation = dqw::simulate(s, [](double) {});
    const command::Folder folder;
    const std::string path = folder / "log.csv";
    dqw::write_csv(simulation, path);
    dqw::ReadOptions options;
    if (beside == Beside::truth)
        dqw::write_toml(simulation, folder / "log.toml", "test");
    else
        options.pole_pairs = s.machine.pole_pairs;
    if (beside == Beside::regime) folder.write("log.toml", std::string("[log]\nregime = \"") + s.regime + "\"\n");
    return dqw::read_log(path, options);
}

#endif
