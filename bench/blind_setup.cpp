#include "blind_setup.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace blind {
namespace {

struct Plate {
    const char* name;
    int pole_pairs;
    double R_ohm, Ld_H, Lq_H, psi_Wb, current_A, v_dc_V;
};
const Plate plates[] = {
    {"servo", 4, 0.9, 2.2e-3, 2.8e-3, 0.12, 8, 320},
    {"robot joint", 21, 0.10, 50e-6, 50e-6, 0.0040, 20, 48},
    {"traction", 4, 0.012, 0.20e-3, 0.50e-3, 0.070, 250, 350},
    {"small 24 V", 4, 0.37, 0.326e-3, 0.326e-3, 0.020, 8, 24},
};

void draw_machine(Random& random, Setup& s)
{
    const Plate& plate = plates[random.below(4)];
    dqw_sim_machine& m = s.scenario.machine;
    s.machine = plate.name;
    const int pairs[] = {plate.pole_pairs, plate.pole_pairs, 2, 3, 5, 7};
    m.pole_pairs = pairs[random.below(6)];
    m.R_ohm = plate.R_ohm * random.log_uniform(0.6, 1.7);
    m.Ld_H = plate.Ld_H * random.log_uniform(0.6, 1.7);
    m.Lq_H = m.Ld_H * (plate.Lq_H / plate.Ld_H) * random.uniform(0.95, 1.5);
    // The same back-EMF at a speed, whatever the pole pairs.
    m.psi_Wb = plate.psi_Wb * random.log_uniform(0.75, 1.35);
    m.temp_ref_C = m.temp_ambient_C = m.temp_start_C = 25;
    s.scenario.drive.v_dc_V = plate.v_dc_V;
    s.voltage_V = plate.v_dc_V / std::sqrt(3.0);
    s.current_A = std::min(plate.current_A * random.log_uniform(0.6, 1.4), 0.25 * s.voltage_V / m.R_ohm);
    s.torque_Nm = 1.5 * m.pole_pairs * m.psi_Wb * s.current_A;
}

/// Speed where the back-EMF takes this share of the voltage, and L i no more than 0.4 of it.
double speed_of(const Setup& s, double share)
{
    const dqw_sim_machine& m = s.scenario.machine;
    const double by_flux = share * s.voltage_V / m.psi_Wb, by_current = 0.4 * s.voltage_V / (m.Lq_H * s.current_A);
    return std::min(by_flux, by_current) / m.pole_pairs;
}

void draw_noise(Random& random, Setup& s)
{
    dqw_sim_noise& n = s.scenario.noise;
    const double share = random.log_uniform(0.001, 0.03);
    const double v[] = {0, 0.3, 1}, w[] = {0.03, 0.3, 1};
    n.i = share, n.v = share * v[random.below(3)], n.w = share * w[random.below(3)];
    n.v_dc = n.temp = n.torque = share;
    if (s.regime == dqw::Regime::dynamic && random.chance(0.25)) {
        n.step_i_A = 3 * s.current_A / (random.chance(0.5) ? 4096 : 1024);
        n.step_v_V = s.voltage_V / 4096;
    }
}

void draw_dynamic(Random& random, Setup& s)
{
    dqw_sim_scenario& x = s.scenario;
    const dqw_sim_machine& m = x.machine;
    s.speed_rad_s = speed_of(s, random.uniform(0.25, 0.6));
    // At least 5 samples in L/R, 18 in a turn.
    const double slowest = std::min(0.2 * std::min(m.Ld_H, m.Lq_H) / m.R_ohm, 0.35 / (m.pole_pairs * s.speed_rad_s));
    double T = 1 / random.log_uniform(2000, 20000);
    if (T > slowest) T = std::max(slowest, 5e-5);
    if (m.pole_pairs * s.speed_rad_s * T > 0.35) s.speed_rad_s = 0.35 / (m.pole_pairs * T);
    x.drive.dt_s = T = std::round(T * 1e7) / 1e7;
    x.duration_s = std::clamp(random.uniform(10000, 40000) * T, 1.0, 4.0);
    if (x.duration_s > 40000 * T) x.duration_s = 40000 * T;
    x.drive.current_bandwidth_rad_s = std::min(1500.0, 0.15 / T) * random.uniform(0.6, 1);
    x.drive.speed_bandwidth_rad_s = std::min(60.0, 0.08 * x.drive.current_bandwidth_rad_s);
    x.drive.i_max_A = 1.5 * s.current_A;

    dqw_sim_profile& p = x.profile;
    const double hold = std::max(random.log_uniform(4e-3, 0.04), 6 / x.drive.current_bandwidth_rad_s);
    p.i_d_A.value = -s.current_A * random.uniform(0, m.Lq_H > 1.5 * m.Ld_H ? 0.3 : 0.1);
    p.i_d_A.random = s.current_A * random.uniform(0.25, 0.5), p.i_d_A.random_hold_s = hold;
    p.i_q_A.random = s.current_A * random.uniform(0.25, 0.5), p.i_q_A.random_hold_s = 1.37 * hold;
    s.injection = random.chance(0.6);
    if (s.injection) {
        const double step = T * static_cast<double>(2 + random.below(5));
        p.v_d_V.binary = std::min(0.1 * s.current_A * m.Ld_H / step, 0.12 * s.voltage_V), p.v_d_V.binary_hold_s = step;
        p.v_q_V.binary = std::min(0.1 * s.current_A * m.Lq_H / step, 0.12 * s.voltage_V), p.v_q_V.binary_hold_s = step;
    }
    const double period = x.duration_s / random.uniform(2, 6);
    x.machine.J_kgm2 = 0.25 * s.torque_Nm / (s.speed_rad_s * 6.28 / period);
    x.machine.B_Nms_rad = 0.03 * s.torque_Nm / s.speed_rad_s;
    p.speed_rad_s.wave = s.speed_rad_s, p.speed_rad_s.wave_period_s = period;
    switch (random.below(3)) {
    case 0:
        s.profile = "to and fro";
        if (random.chance(0.5)) p.speed_rad_s.shape = DQW_SIM_SHAPE_TRIANGLE;
        break;
    case 1:
        s.profile = "constant speeds";
        p.speed_rad_s.shape = DQW_SIM_SHAPE_STAIRS, p.speed_rad_s.levels = 4 + static_cast<int>(random.below(3));
        p.speed_rad_s.wave_period_s = 1.001 * x.duration_s, p.speed_start_rad_s = -s.speed_rad_s;
        break;
    default:
        s.profile = "load machine";
        p.control = DQW_SIM_CONTROL_CURRENT, p.shaft = DQW_SIM_SHAFT_IMPOSED;
        p.speed_rad_s.value = s.speed_rad_s * random.uniform(-0.3, 0.3), p.speed_rad_s.wave *= 0.7;
        break;
    }
    x.rtol = 1e-7;
}

/// Settled rows: what couples the axes dies away with L/R, of which a row has 15.
void draw_settled(Random& random, Setup& s)
{
    dqw_sim_scenario& x = s.scenario;
    const dqw_sim_machine& m = x.machine;
    const bool turning = s.regime == dqw::Regime::steady;
    dqw_sim_drive& d = x.drive;
    d.dt_s = 0.06 * std::max(m.Ld_H, m.Lq_H) / m.R_ohm;
    s.speed_rad_s = turning ? std::min(speed_of(s, 0.5), 0.3 / (d.dt_s * m.pole_pairs)) : 0;
    d.hold = DQW_SIM_HOLD_DQ, d.current_bandwidth_rad_s = 0.15 / d.dt_s, d.i_max_A = 1.5 * s.current_A,
    d.log_every = 250, d.log_window = 20;
    const double row = d.dt_s * d.log_every, hold = row * (1 + 2e-5);
    x.duration_s = row * std::round(random.uniform(150, 400));
    dqw_sim_profile& p = x.profile;
    p.control = DQW_SIM_CONTROL_CURRENT, p.shaft = DQW_SIM_SHAFT_IMPOSED;
    // The load machine is on its way to the next speed in the last period of a hold: that is not to be the row's.
    p.i_d_A.random = p.i_q_A.random = 0.9 * s.current_A, p.i_d_A.random_hold_s = p.i_q_A.random_hold_s = hold;
    if (turning) p.speed_rad_s.random = s.speed_rad_s, p.speed_rad_s.random_hold_s = hold;
    s.profile = turning ? "settled points" : "locked rotor";
    x.rtol = 1e-7;
}

void draw_mechanical(Random& random, Setup& s)
{
    dqw_sim_scenario& x = s.scenario;
    s.slow = random.chance(0.4);
    s.speed_rad_s = s.slow ? random.uniform(2, 6) : speed_of(s, random.uniform(0.3, 0.6));
    dqw_sim_drive& d = x.drive;
    d.dt_s = 5e-4, d.log_every = 2, d.hold = DQW_SIM_HOLD_DQ;
    d.current_bandwidth_rad_s = 300, d.speed_bandwidth_rad_s = 25, d.i_max_A = 1.5 * s.current_A;
    x.duration_s = random.uniform(10, 20);
    dqw_sim_profile& p = x.profile;
    const double period = random.uniform(1.5, 4);
    p.speed_rad_s.wave = s.speed_rad_s, p.speed_rad_s.wave_period_s = period;
    if (random.chance(0.5)) p.speed_rad_s.shape = DQW_SIM_SHAPE_TRIANGLE;
    x.machine.J_kgm2 = 0.2 * s.torque_Nm / (s.speed_rad_s * 6.28 / period);
    x.machine.B_Nms_rad = random.uniform(0.05, 0.2) * s.torque_Nm / s.speed_rad_s;
    x.machine.coulomb_width_rad_s = 0.01 * s.speed_rad_s;
    p.i_q_A.random = 0.2 * s.current_A, p.i_q_A.random_hold_s = random.uniform(0.1, 0.3);
    s.profile = s.slow ? "slow motion" : "motion";
    x.rtol = 1e-7;
}

const char* const modulations[] = {"centred", "lowest leg clamped", "highest leg clamped", "clamped by 60 degrees"};

/// Of the drive's own period: a timer of 12 to 14 bits would show, and is left out.
void draw_switches(Random& random, Setup& s)
{
    s.switching = true;
    const std::size_t which = random.below(4);
    s.scenario.inverter.modulation = static_cast<dqw_sim_modulation>(DQW_SIM_MODULATION_CENTRED + which);
    s.scenario.method = DQW_SIM_RK4;
    s.profile += std::string(", ") + modulations[which];
}

}  // namespace

double Random::log_uniform(double low, double high) { return low * std::exp(uniform(0, std::log(high / low))); }

Setup draw_setup(Random& random, dqw::Regime regime, bool switching)
{
    Setup s;
    s.regime = regime;
    draw_machine(random, s);
    if (regime == dqw::Regime::dynamic)
        draw_dynamic(random, s);
    else if (regime == dqw::Regime::mechanical)
        draw_mechanical(random, s);
    else
        draw_settled(random, s);
    s.scenario.name = "blind", s.scenario.about = "", s.scenario.regime = "dynamic";
    s.scenario.seed = 1 + random.below(1000000000);
    draw_noise(random, s);
    const dqw_sim_machine& m = s.scenario.machine;
    s.copper_W = 1.5 * m.R_ohm * 0.2 * s.current_A * s.current_A;
    for (double& u : s.shape) u = random.uniform(0, 1);
    for (double& f : s.nominal) f = random.uniform(0.7, 1.3);
    s.angle = random.chance(0.6), s.temperatures = random.chance(0.5), s.heats = random.chance(0.4);
    s.torque = random.chance(0.3), s.bus = random.chance(0.5), s.nominal_given = random.chance(0.4),
    s.gap = random.chance(0.06);
    // An integrated speed must still tell the angle at the end of the log.
    const double rows = s.scenario.duration_s / s.scenario.drive.dt_s;
    const double drift = m.pole_pairs * s.scenario.drive.dt_s * s.scenario.noise.w * 0.7 * s.speed_rad_s *
                         std::sqrt(rows);
    if (s.gap || drift > 0.1 || regime != dqw::Regime::dynamic) s.angle = true;
    s.pole_pairs_given = !s.angle || regime != dqw::Regime::dynamic || random.chance(0.8);
    if (regime == dqw::Regime::mechanical) s.torque = random.chance(0.7);
    if (switching && regime == dqw::Regime::dynamic) draw_switches(random, s);
    return s;
}

Setup on_mean_plant(const Setup& setup)
{
    Setup s = setup;
    s.switching = false;
    s.scenario.inverter = dqw_sim_inverter{};
    s.scenario.method = DQW_SIM_ADAMS;
    return s;
}

dqw::PlainModel truth_of(const Setup& s)
{
    const dqw_sim_machine& m = s.scenario.machine;
    dqw::PlainModel truth;
    truth.pole_pairs = m.pole_pairs, truth.R_ohm = m.R_ohm, truth.Ld_H = m.Ld_H, truth.Lq_H = m.Lq_H,
    truth.psi_Wb = m.psi_Wb;
    truth.J_kgm2 = m.J_kgm2, truth.B_Nms_rad = m.B_Nms_rad, truth.torque_constant_Nm_A = 1.5 * m.pole_pairs * m.psi_Wb;
    return truth;
}

dqw::Log log_of(const Setup& s, const dqw_sim_scenario& scenario, bool noise)
{
    dqw_sim_scenario x = scenario;
    if (!noise) x.noise = dqw_sim_noise{};
    std::vector<dqw_sim_row> rows(dqw_sim_rows(&x));
    dqw_sim_report said{};
    const int status = dqw_sim_run(&x, rows.data(), rows.size(), &said, nullptr, nullptr);
    if (status != DQW_SIM_OK) throw std::runtime_error(said.message);

    dqw::Log log;
    log.regime = s.regime;
    if (s.gap && s.regime == dqw::Regime::dynamic) {
        const auto at = static_cast<std::ptrdiff_t>(rows.size() * 2 / 5);
        rows.erase(rows.begin() + at, rows.begin() + at + 50);
        log.segments.push_back(static_cast<std::size_t>(at));
    }
    const auto fill = [&](std::vector<double>& column, double dqw_sim_row::*value, bool present) {
        for (std::size_t k = 0; present && k < rows.size(); ++k) column.push_back(rows[k].*value);
    };
    const bool electrical = s.regime != dqw::Regime::mechanical, temperatures = electrical && s.temperatures;
    fill(log.t_s, &dqw_sim_row::t_s, true);
    fill(log.v_d_V, &dqw_sim_row::v_d_V, electrical), fill(log.v_q_V, &dqw_sim_row::v_q_V, electrical);
    fill(log.i_d_A, &dqw_sim_row::i_d_A, electrical), fill(log.i_q_A, &dqw_sim_row::i_q_A, electrical || !s.torque);
    fill(log.w_m_rad_s, &dqw_sim_row::w_m_rad_s, true);
    fill(log.theta_e_rad, &dqw_sim_row::theta_e_rad, electrical && s.angle),
        fill(log.theta_m_rad, &dqw_sim_row::theta_m_rad, s.angle);
    fill(log.v_dc_V, &dqw_sim_row::v_dc_V, electrical && s.bus);
    fill(log.temp_winding_C, &dqw_sim_row::temp_winding_C, temperatures),
        fill(log.temp_magnet_C, &dqw_sim_row::temp_magnet_C, temperatures);
    fill(log.torque_Nm, &dqw_sim_row::torque_Nm, s.torque);
    log.dt_s = x.drive.dt_s * std::max(x.drive.log_every, 1);
    if (s.pole_pairs_given) log.machine.pole_pairs = x.machine.pole_pairs;
    if (!electrical && !s.torque) log.machine.torque_constant_Nm_A = 1.5 * x.machine.pole_pairs * x.machine.psi_Wb;
    if (s.nominal_given) {
        log.machine.R_ohm = s.nominal[0] * x.machine.R_ohm, log.machine.psi_Wb = s.nominal[3] * x.machine.psi_Wb;
        log.machine.Ld_H = s.nominal[1] * x.machine.Ld_H, log.machine.Lq_H = s.nominal[2] * x.machine.Lq_H;
    }
    return log;
}

}  // namespace blind
