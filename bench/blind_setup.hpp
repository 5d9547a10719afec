// Machine, drive, profile and noise of a blind log, before any effect.
#ifndef DQW_BENCH_BLIND_SETUP_HPP
#define DQW_BENCH_BLIND_SETUP_HPP

#include <array>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "dqw_sim.h"
#include "ref/log/log.hpp"
#include "ref/log/residual.hpp"

namespace blind {

class Random {
public:
    explicit Random(std::uint64_t seed) : bits_(seed) {}
    double uniform(double low, double high)
    {
        return low + (high - low) * static_cast<double>(bits_() >> 11) * 0x1p-53;
    }
    double log_uniform(double low, double high);
    bool chance(double probability) { return uniform(0, 1) < probability; }
    std::size_t below(std::size_t n) { return static_cast<std::size_t>(uniform(0, static_cast<double>(n))); }

private:
    std::mt19937_64 bits_;
};

struct Setup {
    dqw_sim_scenario scenario{};
    dqw::Regime regime = dqw::Regime::dynamic;
    bool injection = false, slow = false;  ///< slow: cogging can be seen
    bool switching = false;                ///< the inverter at its switches, else its mean voltage
    /// columns; heats: though nothing follows it
    bool angle = true, temperatures = false, heats = false, torque = false;
    bool bus = false, pole_pairs_given = true, nominal_given = false, gap = false;
    double current_A = 0, speed_rad_s = 0, voltage_V = 0, torque_Nm = 0;  ///< how large the signals may become
    double copper_W = 0;                                                  ///< about what heats the winding
    std::array<double, 6> shape{};    ///< uniform draws: whatever an effect has beside its size
    std::array<double, 4> nominal{};  ///< factors on what the machine file says
    std::string machine, profile;
};

/// `regime` is drawn by the caller, and whether the inverter switches, as it may in a dynamic log.
Setup draw_setup(Random& random, dqw::Regime regime, bool switching = false);

/// The same drive with an inverter that gives its mean voltage.
Setup on_mean_plant(const Setup& setup);

dqw::PlainModel truth_of(const Setup& setup);

/// Simulates and keeps the drawn columns. `noise` false: exact. Throws std::runtime_error where the simulator refuses.
dqw::Log log_of(const Setup& setup, const dqw_sim_scenario& scenario, bool noise);

}  // namespace blind
#endif
