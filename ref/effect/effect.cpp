#include "ref/effect/effect.hpp"

namespace dqw {

const std::vector<Effect>& effects()
{
    static const std::vector<Effect> catalogue{
        {"dead_time",
         "phase x loses V tanh(i_x/w)",
         "small currents: a slow sweep of i_d through zero at standstill",
         false,
         true,
         {{"voltage_V", 0.0, 1e3}, {"width_A", 0.0, 1e4}}},
        {"saturation",
         "flux linkage bends with its own current",
         "larger currents on one axis at a time, at constant speed",
         false,
         false,
         {{"psi_d2_Wb", -10, 10}, {"psi_d3_Wb", -10, 10}, {"psi_d4_Wb", -10, 10}, {"psi_q3_Wb", -10, 10}, {"psi_q5_Wb", -10, 10}, {"i_base_A", 0.0, 1e5}}},
        {"cross_saturation",
         "flux linkage bends with the other axis' current",
         "large currents on both axes at once",
         false,
         false,
         {{"psi_c12_Wb", -10, 10}, {"psi_c22_Wb", -10, 10}, {"psi_c14_Wb", -10, 10}, {"i_base_A", 0.0, 1e5}}},
        {"winding_temperature",
         "R = R_0 (1 + alpha (T - T_0))",
         "the same currents cold and hot, and a temperature column",
         false,
         false,
         {{"alpha_per_K", 5e-4, 1.2e-2}, {"rise_percent", 0.0, 300.0}}},
        {"magnet_temperature",
         "psi = psi_0 (1 + beta (T - T_0))",
         "the same speed with a cold and a hot magnet, and a temperature column",
         false,
         false,
         {{"beta_per_K", -8e-3, 0.0}, {"fall_percent", 0.0, 60.0}}},
        {"iron_loss", "a resistance across the induced voltage", "a second speed, and both directions", false, false, {{"R_fe_ohm", 0.0, 1e9}}},
        {"flux_harmonics",
         "flux linkage with order 6 (12) of the electrical angle",
         "a constant speed, with an angle column",
         false,
         true,
         {{"psi_6d_Wb", 0.0, 1.0}, {"psi_6q_Wb", 0.0, 1.0}, {"phase_6d_rad", -7, 7}, {"phase_6q_rad", -7, 7}}},
        {"current_offset",
         "the current sensors read a constant too much",
         "zero current with the inverter off",
         false,
         true,
         {{"i_alpha_A", -1e4, 1e4}, {"i_beta_A", -1e4, 1e4}}},
        {"current_gain_mismatch",
         "the phases' current sensors differ in gain",
         "a second speed: it also follows L di/dt, a resistance does not",
         false,
         true,
         {{"gain", 0.0, 0.3}, {"axis_rad", -4, 4}}},
        {"angle_offset", "the angle is wrong by a constant", "a second speed, and i_d of both signs", false, false, {{"angle_rad", -0.35, 0.35}}},
        {"delay", "the voltage comes late", "a voltage that changes fast: injection or steps", false, false, {{"periods", 0.0, 3.0}}},
        {"skin_effect", "R = R_0 (1 + k w_e^2)", "the same currents at standstill and at top speed", false, false, {{"k_s2_rad2", 0.0, 1.0}}},
        {"phase_resistance_imbalance",
         "one or two phases' resistance differs",
         "a current vector turned slowly at standstill",
         false,
         true,
         {{"dR_a_ohm", -1e3, 1e3}, {"dR_b_ohm", -1e3, 1e3}}},
        {"voltage_offset", "a constant is added to v_d, v_q", "zero speed and zero current", false, false, {{"v_d_V", -1e3, 1e3}, {"v_q_V", -1e3, 1e3}}},
        {"coulomb_friction", "a constant torque against the motion", "motion both ways, or coasting to rest", true, false, {{"torque_Nm", 0.0, 1e6}}},
        {"direction_asymmetry", "friction differs with the direction", "motion both ways, and a rest between them", true, false, {{"torque_Nm", -1e6, 1e6}}},
        {"stribeck_friction",
         "friction falls as motion begins",
         "slow motion through zero speed",
         true,
         false,
         {{"torque_Nm", 0.0, 1e6}, {"speed_rad_s", 0.0, 1e6}}},
        {"cogging_torque",
         "a torque periodic in the shaft angle",
         "slow motion, with an angle column",
         true,
         true,
         {{"torque_Nm", 0.0, 1e6}, {"order", 1, 1e4}}},
        {"load_torque", "a constant torque", "motion both ways", true, false, {{"torque_Nm", -1e6, 1e6}}},
    };
    return catalogue;
}

const Effect* find_effect(const std::string& name)
{
    for (const Effect& e : effects())
        if (name == e.name) return &e;
    return nullptr;
}

}  // namespace dqw
