// A drive at its switches whose edges are slow, and lose voltage by a law that none of a fit's is; its speed comes from
// a loop that is 1.3 ms late. R is 0.9 ohm, L_q 2.8 mH, psi 0.12 Wb.
#ifndef DQW_TESTS_SLOW_EDGES_HPP
#define DQW_TESTS_SLOW_EDGES_HPP

#include <string>
#include <vector>

/// Of the scenario drive_clamped.
inline const std::vector<std::string> kSlowEdges = {"seed=60547",
                                                    "inverter.node_F=6.4e-9",
                                                    "inverter.dead_time_s=1.6e-6",
                                                    "inverter.switch_V=0",
                                                    "inverter.switch_ohm=0",
                                                    "inverter.diode_V=0",
                                                    "inverter.diode_ohm=0",
                                                    "inverter.knee_A=0",
                                                    "inverter.modulation=clamped_60",
                                                    "inverter.dead_side=both",
                                                    "profile.i_d_A=-0.92",
                                                    "profile.i_d_A.random=0",
                                                    "profile.speed_rad_s=33",
                                                    "profile.speed_rad_s.wave=112",
                                                    "profile.speed_rad_s.wave_period_s=1.5",
                                                    "profile.speed_rad_s.shape=square",
                                                    "profile.load_Nm.random=1.96",
                                                    "profile.load_Nm.random_hold_s=0.04",
                                                    "sensing.speed_bandwidth_rad_s=1450",
                                                    "method=rk4",
                                                    "duration_s=6"};

#endif
