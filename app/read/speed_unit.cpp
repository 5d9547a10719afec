#include "app/read/speed_unit.hpp"

#include <fmt/format.h>

#include <cmath>

#include "app/base/least_squares.hpp"
#include "app/read/voltage_fit.hpp"

namespace dqw {
namespace {

/// What one criterion says: logged speed over physical speed, 1 for rad/s and 9.549 for rpm, and the sentence for it.
struct Finding {
    double ratio;
    std::string evidence;
};
using Maybe = std::optional<Finding>;

constexpr double pi = 3.14159265358979323846;
constexpr double rpm_per_rad_s = 30.0 / pi;

/// Turns of an angle against the integral of w, over blocks of 64 rows. Only where w, taken as rad/s, leaves no doubt
/// which way the angle went from row to row: less than 2.5 rad of it.
Maybe from_angle(const SpeedProbe& p, Column angle, std::optional<double> turns_per_turn)
{
    const double *t = p.column[col_t], *w = p.column[col_w_m], *theta = p.column[angle];
    if (!t || !w || !theta) return {};
    const double steepest_rad = 2.5 / turns_per_turn.value_or(20.0);
    double ww = 0, wa = 0, aa = 0;
    double block_w = 0, block_a = 0;
    std::size_t n = 0;
    for (std::size_t k = 1; k < p.rows; ++k) {
        const double by_w = 0.5 * (w[k] + w[k - 1]) * (t[k] - t[k - 1]);
        if (gap_before(p, k) || std::fabs(by_w) > steepest_rad) {
            n = 0;
        } else {
            if (n == 0) block_w = block_a = 0;
            block_w += by_w;
            block_a += std::remainder(theta[k] - theta[k - 1], 2 * pi);
            if (++n < 64 && !(k + 1 == p.rows && ww == 0)) continue;
            ww += block_w * block_w, wa += block_w * block_a, aa += block_a * block_a;
            n = 0;
        }
    }
    // Below a tenth of a turn in all, or without agreement between the two, the angle says nothing.
    if (!(aa > 0.4) || wa * wa < 0.9 * ww * aa) return {};
    const double slope = wa / ww;
    const std::string evidence = fmt::format("{} turns at {:.3g} times this speed", columns[angle].name, slope);
    if (turns_per_turn) return Finding{*turns_per_turn / slope, evidence};
    // Without pole pairs the slope is a whole number in rad/s; as p/9.549 it is one only by accident from p = 10 on.
    if (slope > 0 && slope < 0.97) return Finding{rpm_per_rad_s, evidence};
    return {};
}

/// Torque times speed cannot exceed the electrical power of a motor.
Maybe from_power(const SpeedProbe& p)
{
    const double* torque = p.column[col_torque] ? p.column[col_torque] : p.column[col_torque_cmd];
    const double *v_d = p.column[col_v_d], *v_q = p.column[col_v_q], *i_d = p.column[col_i_d], *i_q = p.column[col_i_q],
                 *w = p.column[col_w_m];
    if (!torque || !v_d || !v_q || !i_d || !i_q || !w) return {};
    double mechanical_W = 0, electrical_W = 0;
    for (std::size_t k = 0; k < p.rows; ++k) {
        const double out = torque[k] * w[k], in = 1.5 * (v_d[k] * i_d[k] + v_q[k] * i_q[k]);
        if (!(out > 0 && in > 0)) continue;
        mechanical_W += out;
        electrical_W += in;
    }
    if (!(electrical_W > 0)) return {};
    const double ratio = mechanical_W / electrical_W;
    // Conventions of voltage and current differ by up to 2, and one measured log has 1.8; losses lower the ratio.
    if (ratio > 4 && ratio < 40)
        return Finding{rpm_per_rad_s, fmt::format("torque times speed is {:.3g} times the electrical power", ratio)};
    if (ratio > 0.5 && ratio < 2) return Finding{1.0, ""};
    return {};
}

Maybe against_nominal(const char* what, double found, double nominal, const char* unit)
{
    return Finding{nominal / found, fmt::format("with it {} comes out as {:.3g} {}, the machine file says {:.3g}", what,
                                                found, unit, nominal)};
}

Maybe from_induced_voltage(const Machine& m, const VoltageFit& e)
{
    if (e.known(ppsi)) {
        if (m.psi_Wb && *m.psi_Wb > 0 && m.pole_pairs)
            return against_nominal("psi", e.value[ppsi] / *m.pole_pairs, *m.psi_Wb, "Wb");
        if (m.torque_constant_Nm_A)
            return against_nominal("the torque constant", 1.5 * e.value[ppsi], *m.torque_constant_Nm_A, "Nm/A");
    }
    if (e.known(pLq) && m.Lq_H && m.pole_pairs)
        return against_nominal("Lq", 1e3 * e.value[pLq] / *m.pole_pairs, 1e3 * *m.Lq_H, "mH");
    return {};
}

/// L in front of w over L in front of di/dt is the number of pole pairs, a whole number from 1.
Maybe from_pole_pairs(const SpeedProbe& p, const Machine& m, const VoltageFit& e)
{
    if (p.regime != Regime::dynamic) return {};
    double pole_pairs = 0;
    if (e.known(Lq) && e.known(pLq))
        pole_pairs = e.value[pLq] / e.value[Lq];
    else if (e.known(Ld) && e.known(pLd))
        pole_pairs = e.value[pLd] / e.value[Ld];
    if (!(pole_pairs > 0)) return {};
    const std::string evidence = fmt::format("with it the cross-coupling tells {:.3g} pole pairs, expected {}",
                                             pole_pairs,
                                             m.pole_pairs ? fmt::format("{:g}", *m.pole_pairs) : "1 or more");
    if (m.pole_pairs) return Finding{*m.pole_pairs / pole_pairs, evidence};
    // As p/9.549; below it is the time that is off by thousands.
    if (pole_pairs < 0.75 && pole_pairs > 0.08) return Finding{rpm_per_rad_s, evidence};
    return {};
}

/// Torque against acceleration, viscous and Coulomb friction, over blocks of 50 rows, against the nominal inertia.
Maybe from_inertia(const SpeedProbe& p, const Machine& m)
{
    const double *t = p.column[col_t], *w = p.column[col_w_m];
    const double* torque = p.column[col_torque];
    double gain = 1;
    if (!torque && p.column[col_i_q] && m.torque_constant_Nm_A)
        torque = p.column[col_i_q], gain = *m.torque_constant_Nm_A;
    if (!torque) torque = p.column[col_torque_cmd];
    if (!t || !w || !torque || !m.J_kgm2) return {};
    constexpr std::size_t block = 50;
    LeastSquares<3> fit;
    for (std::size_t first = 0; first + block < p.rows; first += block) {
        double s_torque = 0, s_w = 0, s_sign = 0;
        bool whole = true;
        for (std::size_t k = first; k < first + block; ++k) {
            whole = whole && !gap_before(p, k + 1);
            const double dt = t[k + 1] - t[k];
            s_torque += gain * 0.5 * (torque[k] + torque[k + 1]) * dt;
            s_w += w[k] * dt;
            s_sign += (w[k] > 0) ? dt : (w[k] < 0) ? -dt : 0;
        }
        if (whole) fit.add({w[first + block] - w[first], s_w, s_sign}, s_torque);
    }
    std::array<double, 3> value, sd;
    fit.solve(value, sd);
    if (!(value[0] > 0) || !(sd[0] < 0.1 * value[0])) return {};
    return against_nominal("J", value[0], *m.J_kgm2, "kg m2");
}

/// No physics left: few machines turn faster than 2000 rad/s (19 100 rpm), many logs in rpm reach it.
Maybe from_size(const SpeedProbe& p)
{
    double fastest = 0;
    for (std::size_t k = 0; k < p.rows; ++k) fastest = std::fmax(fastest, std::fabs(p.column[col_w_m][k]));
    if (fastest < 2000) return {};
    return Finding{rpm_per_rad_s, fmt::format("it reaches {:.4g}, which as rad/s would be {:.0f} rpm", fastest,
                                              fastest * rpm_per_rad_s)};
}

}  // namespace

std::optional<std::string> evidence_of_rpm(const SpeedProbe& probe, const Machine& machine)
{
    if (!probe.column[col_w_m] || probe.regime == Regime::standstill) return {};
    std::optional<std::string> verdict;
    // True once a criterion has told, either way. Ratios far from both units tell of something else.
    const auto decided = [&](const Maybe& finding) {
        if (!finding) return false;
        if (finding->ratio > 6 && finding->ratio < 15) verdict = finding->evidence;
        return verdict || (finding->ratio > 0.5 && finding->ratio < 2);
    };
    const bool electrical = probe.regime != Regime::mechanical;
    if (decided(from_angle(probe, col_theta_m, 1.0)) || decided(from_angle(probe, col_theta_e, machine.pole_pairs)))
        return verdict;
    if (electrical) {
        if (decided(from_power(probe))) return verdict;
        if (!probe.column[col_v_q] || !probe.column[col_i_q]) return verdict;
        const VoltageFit e = fit_voltages(probe);
        if (decided(from_induced_voltage(machine, e)) || decided(from_pole_pairs(probe, machine, e))) return verdict;
    } else if (decided(from_inertia(probe, machine))) {
        return verdict;
    }
    decided(from_size(probe));
    return verdict;
}

}  // namespace dqw
