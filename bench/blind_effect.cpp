#include "blind_effect.hpp"

#include <algorithm>
#include <cmath>

namespace blind {
namespace {

constexpr double two_pi = 6.283185307179586;

dqw_sim_ramp always(double value) { return {value, 0, 0}; }

/// Winding and magnet heat within the log: first the winding alone, its time constant from half to three times the log.
void heat_winding(double rise_K, const Setup& s, dqw_sim_scenario& x)
{
    dqw_sim_machine& m = x.machine;
    m.winding_heat_J_K = s.copper_W * x.duration_s / rise_K, m.magnet_heat_J_K = 1e9;
    m.winding_ambient_W_K = m.winding_heat_J_K / (x.duration_s * (0.5 + 2.5 * s.shape[0]));
}

/// The winding follows the losses at once, and the magnet the winding.
void heat_magnet(double rise_K, const Setup& s, dqw_sim_scenario& x)
{
    dqw_sim_machine& m = x.machine;
    m.magnet_heat_J_K = s.copper_W * x.duration_s / rise_K;
    m.magnet_ambient_W_K = m.magnet_heat_J_K / (x.duration_s * (0.5 + 2.5 * s.shape[0]));
    m.winding_magnet_W_K = s.copper_W / 20, m.winding_heat_J_K = m.winding_magnet_W_K * x.duration_s / 50;
}

double saturation_dd(double size, const Setup& s)
{
    const dqw_sim_machine& m = s.scenario.machine;
    return size * s.shape[1] / (6 * m.Ld_H * m.psi_Wb * m.psi_Wb);
}
double saturation_qq(double size, const Setup& s)
{
    const dqw_sim_machine& m = s.scenario.machine;
    return size / (m.Lq_H * std::pow(m.Lq_H * s.current_A, 2));
}

double most_W(const Setup& s)
{
    const dqw_sim_machine& m = s.scenario.machine;
    return 1.5 * s.current_A * (m.R_ohm * s.current_A + m.pole_pairs * s.speed_rad_s * m.psi_Wb);
}

/// Currents late, angle late, or a reference logged as it was decided, which acts a period later: that has no size.
void shift(double size, const Setup& s, dqw_sim_scenario& x)
{
    if (s.injection && s.shape[0] < 0.3)
        x.drive.logged = DQW_SIM_LOGGED_DECIDED;
    else if (s.shape[0] < 0.65)
        x.sensing.late_periods = size;
    else
        x.sensing.angle_late_periods = size;
}

/// An inverter that switches on a link behind a resistance, whose voltage nobody measures; its capacitor follows within
/// some periods.
void sag(double size, dqw_sim_scenario& x)
{
    x.inverter.modulation = DQW_SIM_MODULATION_CENTRED, x.method = DQW_SIM_RK4;
    x.inverter.source_ohm = size, x.inverter.link_F = 5 * x.drive.dt_s / size;
    x.drive.link = DQW_SIM_LINK_NOMINAL;
}

/// As many turns as a short of no resistance needs, or a twentieth.
void turns(double size, const Setup& s, dqw_sim_scenario& x)
{
    const double R = s.scenario.machine.R_ohm, share = std::clamp(1.5 * size * R, 0.05, 0.5);
    x.nonideal.turn_short = always(share), x.nonideal.turn_short_ohm = std::max(share * share / size - share * R, 0.0);
}

}  // namespace

std::vector<std::string> effects_for(const Setup& s)
{
    switch (s.regime) {
    case dqw::Regime::mechanical:
        if (s.slow)
            return {"coulomb_friction", "direction_asymmetry", "stribeck_friction",
                    "cogging_torque",   "cogging_torque",      "load_torque"};
        return {"coulomb_friction", "direction_asymmetry", "stribeck_friction", "load_torque"};
    case dqw::Regime::standstill:
        return {"dead_time", "winding_temperature", "voltage_offset", "phase_resistance_imbalance",
                "current_gain_mismatch"};
    case dqw::Regime::steady:
        return {"dead_time", "saturation",   "cross_saturation", "winding_temperature", "magnet_temperature",
                "iron_loss", "angle_offset", "skin_effect",      "voltage_offset"};
    case dqw::Regime::dynamic:
    case dqw::Regime::polled: break;
    }
    std::vector<std::string> names = {"dead_time",           "saturation",         "cross_saturation",
                                      "winding_temperature", "magnet_temperature", "iron_loss",
                                      "flux_harmonics",      "current_offset",     "current_gain_mismatch",
                                      "angle_offset",        "skin_effect",        "phase_resistance_imbalance",
                                      "voltage_offset",      "sample_shift",       "voltage_scale",
                                      "turn_short"};
    // Their angle is the shaft's, which a gap leaves unknown without its column.
    if (s.pole_pairs_given && !s.gap) names.insert(names.end(), {"encoder_eccentricity", "magnet_asymmetry"});
    // Where the currents only wave a filter is a shift.
    if (s.injection) names.emplace_back("sensor_lag");
    // Without a voltage that changes a delay is an angle offset of the voltage; legs switch late by whole periods.
    if (s.injection && !s.switching) names.insert(names.end(), {"delay", "delay"});
    return names;
}

std::vector<std::string> faults_for(const Setup&) { return {"disturbance", "hum", "clip", "dropped"}; }

bool may_join(const std::string& one, const std::string& other)
{
    const auto heat = [](const std::string& n) { return n == "winding_temperature" || n == "magnet_temperature"; };
    // Both of these stand for two already.
    const auto whole = [](const std::string& n) { return n == "cross_saturation" || n == "direction_asymmetry"; };
    // Legs that switch lose no mean voltage, and have no eddies without a time constant.
    const auto switched = [](const std::string& n) { return n == "voltage_scale"; };
    const auto mean = [](const std::string& n) {
        return n == "dead_time" || n == "iron_loss" || n == "turn_short" || n == "delay";
    };
    if ((switched(one) && mean(other)) || (switched(other) && mean(one))) return false;
    // The simulator has them in one phase or the other.
    const auto phase = [](const std::string& n) { return n == "turn_short" || n == "phase_resistance_imbalance"; };
    if (phase(one) && phase(other)) return false;
    return one != other && !(heat(one) && heat(other)) && !whole(one) && !whole(other);
}

double most_of(const std::string& name, const Setup& s)
{
    const dqw_sim_machine& m = s.scenario.machine;
    const double w_top = m.pole_pairs * s.speed_rad_s;
    if (name == "dead_time") return 0.06 * s.voltage_V;
    if (name == "saturation" || name == "cross_saturation") return 0.6;
    if (name == "winding_temperature") return 100;
    if (name == "magnet_temperature") return 80;
    if (name == "iron_loss") return 0.3 * s.current_A / (w_top * m.psi_Wb);
    if (name == "flux_harmonics") return 0.06;
    if (name == "current_offset") return 0.08 * s.current_A;
    if (name == "current_gain_mismatch") return 0.1;
    if (name == "angle_offset") return 0.25;
    if (name == "delay") return 1.0;
    if (name == "skin_effect") return 1.5 / (w_top * w_top);
    if (name == "phase_resistance_imbalance") return 0.5 * m.R_ohm;
    if (name == "voltage_offset") return 0.05 * s.voltage_V;
    if (name == "sample_shift") return 0.9;
    if (name == "sensor_lag") return 0.5;
    if (name == "voltage_scale") return 0.25 * 3 * s.voltage_V * s.voltage_V / most_W(s);
    if (name == "turn_short") return 0.2 * s.current_A / (w_top * m.psi_Wb);
    if (name == "encoder_eccentricity") return 0.25 / m.pole_pairs;
    if (name == "magnet_asymmetry") return 0.06 * m.psi_Wb;
    if (name == "disturbance") return 0.2 * s.voltage_V;
    if (name == "hum") return 0.15 * s.current_A;
    if (name == "clip") return 0.7;
    if (name == "dropped") return 0.3;
    return name == "cogging_torque" ? 0.2 * s.torque_Nm : 0.4 * s.torque_Nm;
}

void apply(const std::string& name, double size, const Setup& s, dqw_sim_scenario& x)
{
    dqw_sim_nonideal& n = x.nonideal;
    const dqw_sim_machine& m = s.scenario.machine;
    const double around = two_pi * s.shape[2], c = std::cos(around), sn = std::sin(around),
                 sign = s.shape[3] < 0.5 ? -1 : 1;
    if (name == "dead_time") {
        apply_dead_time(size, s, x);
    } else if (name == "saturation" || name == "cross_saturation") {
        const double own = name == "saturation" ? size : 0.3;
        const double dd = saturation_dd(own, s), qq = saturation_qq(own, s);
        n.saturation_dd_A_Wb3 = always(dd), n.saturation_qq_A_Wb3 = always(qq);
        const double most = std::min(2.9 * std::sqrt(dd * qq), 0.5 / (m.Lq_H * m.psi_Wb * m.psi_Wb));
        if (name == "cross_saturation") n.saturation_dq_A_Wb3 = always(size / 0.6 * most);
    } else if (name == "winding_temperature") {
        heat_winding(size, s, x), n.winding_alpha_per_K = always(0.0039);
    } else if (name == "magnet_temperature") {
        heat_magnet(size, s, x), n.magnet_beta_per_K = always(-0.0012);
    } else if (name == "iron_loss") {
        n.iron_loss_S = always(size);
        // Eddies do not follow an edge.
        if (s.switching) n.iron_loss_tau_s = x.drive.dt_s;
    } else if (name == "flux_harmonics") {
        n.flux_harmonic_6d_Wb = always(size * m.psi_Wb * c), n.flux_harmonic_6q_Wb = always(size * m.psi_Wb * sn);
        n.flux_harmonic_6_phase_rad = two_pi * s.shape[1];
    } else if (name == "current_offset") {
        n.current_offset_alpha_A = always(size * c), n.current_offset_beta_A = always(size * sn);
    } else if (name == "current_gain_mismatch") {
        // Without a mean: a gain that all phases share scales the parameters.
        n.current_gain_a = always(size * c), n.current_gain_b = always(size * std::cos(around - two_pi / 3));
        n.current_gain_c = always(size * std::cos(around + two_pi / 3));
    } else if (name == "angle_offset") {
        n.angle_offset_rad = always(sign * size);
    } else if (name == "delay") {
        n.delay_periods = always(size);
    } else if (name == "skin_effect") {
        n.skin_effect_s2_rad2 = always(size);
    } else if (name == "phase_resistance_imbalance") {
        n.phase_resistance_a_ohm = always(size * c), n.phase_resistance_b_ohm = always(size * sn);
    } else if (name == "voltage_offset") {
        n.voltage_offset_d_V = always(size * c), n.voltage_offset_q_V = always(size * sn);
    } else if (name == "sample_shift") {
        shift(size, s, x);
    } else if (name == "sensor_lag") {
        x.sensing.filter_s = size * x.drive.dt_s;
    } else if (name == "voltage_scale") {
        sag(size, x);
    } else if (name == "turn_short") {
        turns(size, s, x);
    } else if (name == "encoder_eccentricity") {
        (s.shape[0] < 0.6 ? x.sensing.once_rad : x.sensing.twice_rad) = size;
        x.sensing.once_phase_rad = x.sensing.twice_phase_rad = around;
    } else if (name == "magnet_asymmetry") {
        n.magnet_asymmetry_Wb = always(size), n.magnet_asymmetry_phase_rad = around;
    } else if (name == "coulomb_friction") {
        x.machine.coulomb_Nm = size;
    } else if (name == "direction_asymmetry") {
        x.machine.coulomb_Nm = size * (1.2 + 2 * s.shape[0]), n.friction_asymmetry_Nm = always(sign * size);
    } else if (name == "stribeck_friction") {
        n.stribeck_Nm = always(size), n.stribeck_width_rad_s = s.speed_rad_s * (0.05 + 0.1 * s.shape[0]);
    } else if (name == "cogging_torque") {
        const int orders[] = {6, 12, 24};
        n.cogging_Nm = always(size), n.cogging_order = orders[static_cast<int>(2.99 * s.shape[0])],
        n.cogging_phase_rad = around;
    } else if (name == "load_torque") {
        x.profile.load_Nm.value = sign * size;
    } else if (name == "disturbance") {
        n.disturbance_V = always(size), n.disturbance_Hz = 20 + 60 * s.shape[0];
    } else if (name == "hum") {
        n.hum_A = always(size), n.hum_Hz = s.shape[0] < 0.5 ? 50 : 60;
    } else if (name == "clip") {
        n.clip_A = s.current_A * (1 - size);
    } else if (name == "dropped") {
        n.dropped_fraction = size;
    }
}

}  // namespace blind
