// A drive whose switches lose a dead time and nothing else: R is 0.9 ohm, L_d 2.2 mH, L_q 2.8 mH, psi 0.12 Wb, and a leg
// loses 5.02 V. Ripple and dead time hold its small currents at zero.
#ifndef DQW_TESTS_SHARP_EDGES_HPP
#define DQW_TESTS_SHARP_EDGES_HPP

#include <string>
#include <vector>

/// Of any drive_*: switches without drops or capacitance, on a link that stands still.
inline const std::vector<std::string> kIdealSwitches = {
    "inverter.node_F=0",    "inverter.switch_V=0",      "inverter.switch_ohm=0", "inverter.diode_V=0",
    "inverter.diode_ohm=0", "inverter.knee_A=0",        "inverter.source_ohm=0", "inverter.link_F=0",
    "inverter.ripple_V=0",  "inverter.compare_counts=0"};

/// Of the scenario drive_clamped, beside ideal switches.
inline const std::vector<std::string> kSharpDrive = {"seed=60550",
                                                     "inverter.dead_time_s=1.57e-6",
                                                     "inverter.modulation=clamped_low",
                                                     "inverter.dead_side=both",
                                                     "nonideal.iron_loss_S=0",
                                                     "nonideal.iron_hysteresis_S_rad_s=0",
                                                     "nonideal.winding_alpha_per_K=0",
                                                     "nonideal.magnet_beta_per_K=0",
                                                     "machine.winding_heat_J_K=0",
                                                     "machine.magnet_heat_J_K=0",
                                                     "machine.housing_heat_J_K=0",
                                                     "machine.winding_housing_W_K=0",
                                                     "machine.magnet_housing_W_K=0",
                                                     "machine.housing_ambient_W_K=0",
                                                     "sensing.filter_s=0",
                                                     "sensing.speed_bandwidth_rad_s=0",
                                                     "profile.speed_rad_s=12",
                                                     "profile.speed_rad_s.wave=68",
                                                     "profile.speed_rad_s.wave_period_s=1.48",
                                                     "profile.speed_rad_s.shape=triangle",
                                                     "profile.load_Nm.random=2.65",
                                                     "profile.load_Nm.random_hold_s=0.16",
                                                     "profile.i_d_A=0",
                                                     "profile.i_d_A.random=0",
                                                     "method=rk4",
                                                     "duration_s=3"};

inline std::vector<std::string> sharp_edges()
{
    std::vector<std::string> all = kIdealSwitches;
    all.insert(all.end(), kSharpDrive.begin(), kSharpDrive.end());
    return all;
}

#endif
