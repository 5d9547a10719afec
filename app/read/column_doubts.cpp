#include "app/read/column_doubts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

namespace dqw {
namespace {

constexpr double pi = 3.14159265358979323846;
constexpr double rpm_to_rad_s = pi / 30;
constexpr std::size_t rows_for_signs = 50000;

using Maybe = std::optional<Doubt>;

/// An angle that is wrapped jumps back by one turn of its unit.
Maybe angle_unit(const SpeedProbe& p, Column column)
{
    const double* a = p.column[column];
    if (!a || p.rows < 3) return {};
    const auto [least, largest] = std::minmax_element(a, a + p.rows);
    const double span = *largest - *least;
    const struct {
        double turn;
        const char* unit;
    } wraps[] = {{360, "deg"}, {65536, "16-bit turns"}, {1, "turns"}};
    for (const auto& wrap : wraps) {
        if (span > 1.002 * wrap.turn || span < 0.8 * wrap.turn || std::fabs(*least) > 1.002 * wrap.turn) continue;
        std::size_t jumps = 0, between = 0;
        for (std::size_t k = 1; k < p.rows; ++k) {
            const double step = std::fabs(a[k] - a[k - 1]);
            jumps += step > 0.7 * wrap.turn;
            between += step > 0.3 * wrap.turn && step <= 0.7 * wrap.turn;
        }
        if (jumps < 2 || between > jumps) continue;
        return Doubt{{column},
                     wrap.unit,
                     fmt::format("it goes from {:.4g} to {:.4g} and jumps back {} times", *least, *largest, jumps),
                     fmt::format("unit = \"{}\"", wrap.unit)};
    }
    return {};
}

struct Scale {
    double of_w, of_t;
    const char* looks_like;
    Column column;
    const char* correction;
};

/// How well the integral of w times `scale` follows the angle: the slope, or 0 where they do not agree.
double slope_of(const SpeedProbe& p, const double* theta, const Scale& scale, double turns)
{
    const double *t = p.column[col_t], *w = p.column[col_w_m];
    constexpr std::size_t block = 16;
    double ww = 0, wa = 0, aa = 0, block_w = 0, block_a = 0, judged = 0, steps = 0;
    std::size_t n = 0;
    for (std::size_t k = 1; k < p.rows; ++k) {
        const double by_w = 0.5 * (w[k] + w[k - 1]) * scale.of_w * (t[k] - t[k - 1]) * scale.of_t;
        steps += 1;
        if (gap_before(p, k) || std::fabs(by_w) * turns > 2.5) {
            n = 0, block_w = block_a = 0;
            continue;
        }
        judged += 1;
        block_w += by_w, block_a += std::remainder(theta[k] - theta[k - 1], 2 * pi);
        if (++n < block) continue;
        ww += block_w * block_w, wa += block_w * block_a, aa += block_a * block_a;
        n = 0, block_w = block_a = 0;
    }
    if (!(aa > 1.0) || judged < 0.5 * steps || wa * wa < 0.98 * ww * aa) return 0.0;
    return wa / ww;
}

/// Speed and time against an angle whose turns for one of the shaft are known.
Maybe by_angle(const SpeedProbe& p, Column angle, std::optional<double> turns, std::optional<double> pole_pairs,
               bool& settled)
{
    const double* theta = p.column[angle];
    if (!theta || !turns || !p.column[col_t] || !p.column[col_w_m]) return {};
    const double poles = pole_pairs.value_or(1.0);
    const Scale as_is = {1, 1, "", col_w_m, ""};
    // What the plain reading leaves within a tenth is the angle's own matter.
    if (std::fabs(slope_of(p, theta, as_is, *turns) / *turns - 1) < 0.1) {
        settled = true;
        return {};
    }
    const Scale others[] = {
        {1 / poles, 1, "the electrical speed in rad/s", col_w_m, "unit = \"electrical rad/s\""},
        {rpm_to_rad_s / poles, 1, "electrical rpm", col_w_m, "unit = \"erpm\""},
        {2 * pi, 1, "turns a second", col_w_m, "unit = \"turns/s\""},
        {2 * pi / poles, 1, "electrical hertz", col_w_m, "unit = \"Hz\""},
        {pi / 180, 1, "degrees a second", col_w_m, "unit = \"deg/s\""},
        {1, 1e-3, "ms", col_t, "unit = \"ms\""},
        {1, 1e-6, "µs", col_t, "unit = \"us\""},
    };
    Maybe found;
    for (const Scale& other : others) {
        if (poles == 1.0 && other.of_w * other.of_t == 1.0) continue;
        const double slope = slope_of(p, theta, other, *turns);
        if (std::fabs(slope / *turns - 1) > 0.02) continue;
        const double rpm = slope_of(p, theta, {rpm_to_rad_s, 1, "", col_w_m, ""}, *turns);
        if (found || std::fabs(rpm / *turns - 1) < 0.02) return {};
        found = Doubt{{other.column},
                      other.looks_like,
                      fmt::format("{} turns at {:.4g} times what speed and time say so", columns[angle].name, slope),
                      other.correction};
    }
    return found;
}

/// An electrical angle that is of another number of pole pairs.
Maybe by_turns(const SpeedProbe& p, std::optional<double> pole_pairs)
{
    const double* theta = p.column[col_theta_e];
    if (!theta || !pole_pairs || !p.column[col_t] || !p.column[col_w_m]) return {};
    const double slope = slope_of(p, theta, {1, 1, "", col_w_m, ""}, *pole_pairs), whole = std::round(slope);
    if (whole < 1.0 || whole == *pole_pairs || std::fabs(slope / whole - 1) > 0.01) return {};
    return Doubt{
        {col_theta_e},
        fmt::format("the angle of {:.0f} pole pairs", whole),
        fmt::format("it turns {:.4g} times as far as the shaft, and the pole pairs are {:.0f}", slope, *pole_pairs),
        ""};
}

/// No machine of some volts takes thousands of amperes, none of a few amperes thousands of volts.
Maybe by_size(const SpeedProbe& p)
{
    const double v = std::hypot(rms(p.column[col_v_d], p.rows), rms(p.column[col_v_q], p.rows));
    const double i = std::hypot(rms(p.column[col_i_d], p.rows), rms(p.column[col_i_q], p.rows));
    if (v > 0 && i > 1500 && v < 100 && i / v > 30)
        return Doubt{{col_i_d, col_i_q}, "mA", fmt::format("{:.3g} A at {:.3g} V RMS", i, v), "unit = \"mA\""};
    if (i > 0 && v > 3000 && i < 50)
        return Doubt{{col_v_d, col_v_q}, "mV", fmt::format("{:.3g} V at {:.3g} A RMS", v, i), "unit = \"mV\""};
    return {};
}

bool near(double ratio, double to, double part) { return std::fabs(std::log(ratio / to)) < part; }

/// Is i_q a torque column times a constant, to the last digits?
bool is_torque(const SpeedProbe& p)
{
    const double *i = p.column[col_i_q], *m = p.column[col_torque] ? p.column[col_torque] : p.column[col_torque_cmd];
    if (!m) return false;
    double ii = 0, im = 0, mm = 0;
    for (std::size_t k = 0; k < p.rows; ++k) ii += i[k] * i[k], im += i[k] * m[k], mm += m[k] * m[k];
    return ii > 0 && mm > 0 && im * im > (1 - 1e-8) * ii * mm;
}

/// Against R, L and ψ of the nameplate, all of which must agree.
Maybe by_nameplate(const SpeedProbe& p, const Machine& m, const VoltageFit& e)
{
    if (!m.pole_pairs || !m.R_ohm || !m.Lq_H || !m.psi_Wb || !(*m.psi_Wb > 0)) return {};
    const Unknown L = p.regime == Regime::dynamic ? Lq : pLq;
    if (!e.known(R) || !e.known(L) || !e.known(ppsi) || e.left > 0.1) return {};
    const double poles = *m.pole_pairs;
    const double r = e.value[R] / *m.R_ohm, l = e.value[L] / (L == pLq ? poles : 1.0) / *m.Lq_H,
                 f = e.value[ppsi] / poles / *m.psi_Wb;
    const std::string evidence = fmt::format("with it R is {:.3g}, L_q {:.3g} and psi {:.3g} times the machine file's",
                                             r, l, f);
    const auto all = [&](double of_r, double of_l, double of_f, double part) {
        return near(r, of_r, 2 * part) && near(l, of_l, part) && near(f, of_f, part);
    };
    constexpr double close = 0.06, far = 0.25;
    if (all(std::sqrt(3.0), std::sqrt(3.0), std::sqrt(3.0), close))
        return Doubt{{col_v_d, col_v_q}, "values line to line", evidence, "scale = 0.57735"};
    if (all(1, 1, std::sqrt(1.5), close))
        return Doubt{
            {col_v_d, col_v_q, col_i_d, col_i_q}, "values of the power-invariant scaling", evidence, "scale = 0.81650"};
    if (all(1, 1, std::sqrt(0.5), close))
        return Doubt{{col_v_d, col_v_q, col_i_d, col_i_q}, "RMS values", evidence, "scale = 1.41421"};
    if (all(1e-3, 1e-3, 1, far)) return Doubt{{col_i_d, col_i_q}, "mA", evidence, "unit = \"mA\""};
    if (all(1e3, 1e3, 1e3, far)) return Doubt{{col_v_d, col_v_q}, "mV", evidence, "unit = \"mV\""};
    // R stands before i_d too, which is right.
    const bool between = r > 0.9 * std::fmin(l, 1.0) && r < 1.1 * std::fmax(l, 1.0);
    if (between && near(f, 1, close) && !near(l, 1, 0.2) && is_torque(p))
        return Doubt{{col_i_q},
                     "torque over a torque constant, and no measured current",
                     evidence + ", and it is the torque times a constant",
                     fmt::format("scale = {:.2g}", l)};
    const double of_L = p.regime == Regime::dynamic ? 1 : 1 / poles;
    if (poles > 2 && all(1, of_L, 1 / poles, 0.15) && !near(poles, 30 / pi, 0.3))
        return Doubt{{col_w_m}, "the electrical speed in rad/s", evidence, "unit = \"electrical rad/s\""};
    const double erpm = 30 / pi * poles;
    if (all(1, p.regime == Regime::dynamic ? 1 : 1 / erpm, 1 / erpm, 0.15) && poles > 1)
        return Doubt{{col_w_m}, "electrical rpm", evidence, "unit = \"erpm\""};
    return {};
}

/// Of means R holds what dead time adds, and L what moved within a row; half a log has no L. The flux tells, and R must
/// not contradict it.
Maybe by_flux(const Machine& m, const VoltageFit& e)
{
    if (!m.pole_pairs || !m.psi_Wb || !(*m.psi_Wb > 0) || !e.known(ppsi) || e.left > 0.3) return {};
    constexpr double sharp = 0.04, blunt = 0.15, far = 0.25;
    const double poles = *m.pole_pairs, f = e.value[ppsi] / poles / *m.psi_Wb;
    const bool has_R = m.R_ohm && e.known(R);
    const double r = has_R ? e.value[R] / *m.R_ohm : 1.0;
    const std::vector<Column> v = {col_v_d, col_v_q}, i = {col_i_d, col_i_q}, w = {col_w_m},
                              all = {col_v_d, col_v_q, col_i_d, col_i_q};
    const struct {
        double of_r, of_f, part;
        bool may_be;
        const std::vector<Column>& columns;
        const char *looks_like, *correction;
    } units[] = {
        {std::sqrt(3.0), std::sqrt(3.0), sharp, true, v, "values line to line", "scale = 0.57735"},
        {1, std::sqrt(1.5), sharp, true, all, "values of the power-invariant scaling", "scale = 0.81650"},
        {1, std::sqrt(0.5), sharp, true, all, "RMS values", "scale = 1.41421"},
        {1e-3, 1, far, has_R, i, "mA", "unit = \"mA\""},
        {1e3, 1e3, far, true, v, "mV", "unit = \"mV\""},
        {1, 1 / poles, blunt, poles > 2 && !near(poles, 30 / pi, 0.3), w, "the electrical speed in rad/s",
         "unit = \"electrical rad/s\""},
        {1, pi / 30 / poles, blunt, poles > 1, w, "electrical rpm", "unit = \"erpm\""},
        {1, 2 * pi, blunt, true, w, "turns a second", "unit = \"turns/s\""},
        {1, pi / 180, blunt, true, w, "degrees a second", "unit = \"deg/s\""},
    };
    constexpr double most_by_dead_time = 6.0, least = 0.7;
    for (const auto& unit : units)
        if (unit.may_be && near(f, unit.of_f, unit.part) && r > least * unit.of_r && r < most_by_dead_time * unit.of_r)
            return Doubt{unit.columns, unit.looks_like,
                         fmt::format("with it psi is {:.3g} times the machine file's", f) +
                             (has_R ? fmt::format(" and R {:.3g} times", r) : ""),
                         unit.correction};
    return {};
}

/// L in front of w over L in front of di/dt: the pole pairs times what w and t are wrong by.
Maybe by_pole_pairs(const SpeedProbe& p, const Machine& m, const VoltageFit& as_is)
{
    if (!p.column[col_t]) return {};
    // Times a thousand an even time looks like that of settled rows.
    SpeedProbe timed = p;
    timed.regime = Regime::dynamic;
    const VoltageFit e = p.regime == Regime::dynamic ? as_is : fit_voltages(timed);
    double poles = 0;
    if (e.known(Lq) && e.known(pLq) && e.sd[Lq] < 0.02 * e.value[Lq] && e.sd[pLq] < 0.02 * e.value[pLq])
        poles = e.value[pLq] / e.value[Lq];
    if (!(poles > 0)) return {};
    const std::string evidence = fmt::format("with it the cross-coupling tells {:.3g} pole pairs", poles);
    if (p.regime == Regime::dynamic && m.pole_pairs && *m.pole_pairs > 1 && near(poles, 1.0, 0.03))
        return Doubt{{col_w_m},
                     "the electrical speed in rad/s",
                     fmt::format("{}, expected {:g}", evidence, *m.pole_pairs),
                     "unit = \"electrical rad/s\""};
    const double thousand = 1000 * poles;
    const double whole = m.pole_pairs.value_or(std::fmax(std::round(thousand), 1.0));
    if (thousand < 60 && near(thousand, whole, 0.05))
        return Doubt{{col_t}, "ms", fmt::format("{}, expected {:g}", evidence, whole), "unit = \"ms\""};
    return {};
}

/// A tool that asks a few times a second writes rows in which speed goes on; seconds apart they would not.
Maybe by_smoothness(const SpeedProbe& p)
{
    constexpr double shortest_s = 4.0, shortest_in_us = 4e3;
    if (p.regime != Regime::polled || !(p.median_dt_s > shortest_s)) return {};
    const double* w = p.column[col_w_m];
    double steps = 0, mean = 0, squares = 0;
    const auto rows = static_cast<double>(p.rows);
    for (std::size_t k = 0; k < p.rows; ++k) {
        if (k > 0) steps += std::pow(w[k] - w[k - 1], 2);
        mean += w[k] / rows, squares += w[k] * w[k];
    }
    if (!(steps < 0.1 * (squares - rows * mean * mean))) return {};
    const bool us = p.median_dt_s > shortest_in_us;
    return Doubt{{col_t},
                 us ? "µs" : "ms",
                 fmt::format("rows are {:.3g} s apart, and yet the speed goes smoothly from row to row", p.median_dt_s),
                 us ? "unit = \"us\"" : "unit = \"ms\""};
}

/// A term that is below zero beyond doubt, and no small one: what the model lacks may turn that.
bool negative(const VoltageFit& e, Unknown u)
{
    constexpr double no_small_part = 0.05;
    return e.value[u] < -5 * e.sd[u] && e.share[u] > no_small_part;
}

constexpr Unknown unknowns[] = {R, Ld, Lq, pLd, pLq, ppsi};

bool negative(const VoltageFit& e)
{
    return std::any_of(std::begin(unknowns), std::end(unknowns), [&](Unknown u) { return negative(e, u); });
}

/// Of half a log: v_q = R i_q + psi w has its signs at once.
Maybe by_half_signs(const VoltageFit& e)
{
    const bool of_psi = negative(e, ppsi) && e.certain(ppsi), of_R = negative(e, R) && e.certain(R);
    if (!of_psi && !of_R) return {};
    const char* of = of_psi ? e.known(R) ? "w_m" : of_R ? "v_q" : "v_q, or that of w_m," : "i_q";
    return Doubt{
        {col_v_q, col_i_q, col_w_m},
        fmt::format("the sign of {} turned", of),
        fmt::format("as it is {} negative", of_psi ? of_R ? "R and psi come out" : "psi comes out" : "R comes out"),
        ""};
}

/// The sign of the angle's turning over the speed's, 0 where nothing tells it.
int angle_beside_speed(const SpeedProbe& p)
{
    for (const Column angle : {col_theta_e, col_theta_m}) {
        const double* theta = p.column[angle];
        if (!theta || !p.column[col_t] || !p.column[col_w_m]) continue;
        const double slope = slope_of(p, theta, {1, 1, "", col_w_m, ""}, 1.0), whole = std::round(slope);
        if (whole != 0 && std::fabs(slope / whole - 1) < 0.01) return slope < 0 ? -1 : 1;
    }
    return 0;
}

/// Signs turned and axes exchanged, where the log as it is has a negative R, L or ψ, or leaves far more.
Maybe by_signs(const SpeedProbe& p, const VoltageFit& as_is)
{
    constexpr double much = 0.3, far_less = 0.2;
    const bool senseless = negative(as_is);
    if (!senseless && as_is.left < much) return {};
    // Means between polls lack what happened within them, and that may turn a term that explains little.
    const bool certain = std::any_of(std::begin(unknowns), std::end(unknowns),
                                     [&](Unknown u) { return negative(as_is, u) && as_is.certain(u); });
    const bool told = senseless && (p.regime != Regime::polled || certain);
    const double most = std::fmin(told && p.regime == Regime::polled ? 0.3 : 0.1,
                                  (told ? 1.02 : far_less) * as_is.left);
    Maybe found;
    double best = 0;
    int fewest = 99;
    bool q_turned = false;
    for (int exchanged = 0; exchanged < 2; ++exchanged)
        for (int signs = 0; signs < 16; ++signs) {
            const auto sign = [&](int bit) { return signs & bit ? -1.0 : 1.0; };
            const int changes = exchanged + (signs & 1) + (signs >> 1 & 1) + (signs >> 2 & 1) + (signs >> 3 & 1);
            if (changes == 0 || changes > 3) continue;
            const VoltageFit e = fit_voltages(p, {sign(1), sign(2), sign(4), sign(8), exchanged == 1}, rows_for_signs);
            if (negative(e) || !e.known(R) || !e.known(ppsi) || e.left > most) continue;
            if (found && (changes > fewest || (changes == fewest && e.left >= best))) continue;
            std::vector<std::string> what;
            const char* const names[] = {"v_d", "v_q", "i_d", "i_q"};
            for (int n = 0; n < 4; ++n)
                if (signs >> n & 1) what.emplace_back(names[n]);
            std::string how = exchanged ? "d and q exchanged" : "";
            for (std::size_t n = 0; n < what.size(); ++n)
                how += (n ? " and " : how.empty() ? "the sign of " : ", then the sign of ") + what[n];
            best = e.left, fewest = changes, q_turned = exchanged == 0 && signs == (2 | 8);
            found = Doubt{
                {col_v_d, col_v_q, col_i_d, col_i_q},
                how + (what.empty() ? "" : " turned"),
                fmt::format("as it is {}{:.2g} % of the voltage is left; so read R, L and psi are positive, and "
                            "{:.2g} % is",
                            senseless ? "R, L or psi comes out negative and " : "", 100 * as_is.left, 100 * e.left),
                ""};
        }
    // v_q and i_q of the other sign are a speed of the other sign, to every equation but the angle's.
    if (!q_turned) return found;
    const int beside = angle_beside_speed(p);
    if (beside > 0) return found;
    if (beside < 0)
        return Doubt{
            {col_w_m}, "a speed of the other sign", found->evidence + "; the angle turns against it", "scale = -1"};
    found->columns.push_back(col_w_m);
    found->looks_like = "the sign of w_m, or those of v_q and i_q, turned";
    return found;
}

}  // namespace

bool Doubt::of_time_or_speed() const
{
    return std::any_of(columns.begin(), columns.end(), [](Column c) { return c == col_t || c == col_w_m; });
}

std::vector<Doubt> column_doubts(const SpeedProbe& probe, const Machine& machine)
{
    std::vector<Doubt> doubts;
    const auto add = [&](const Maybe& doubt) {
        if (!doubt) return false;
        doubts.push_back(*doubt);
        auto& of = doubts.back().columns;
        of.erase(std::remove_if(of.begin(), of.end(), [&](Column c) { return !probe.column[c]; }), of.end());
        return true;
    };
    if (probe.rows < 3) return doubts;
    const bool electrical_is_off = add(angle_unit(probe, col_theta_e)),
               shaft_is_off = add(angle_unit(probe, col_theta_m)), angle_is_off = electrical_is_off || shaft_is_off;
    bool settled = false;
    if (!angle_is_off) {
        if (!add(by_angle(probe, col_theta_m, 1.0, machine.pole_pairs, settled)) && !settled)
            add(by_angle(probe, col_theta_e, machine.pole_pairs, machine.pole_pairs, settled));
        if (doubts.empty()) add(by_turns(probe, machine.pole_pairs));
    }
    if (!probe.column[col_v_q] || !probe.column[col_i_q] || (probe.is_half() && probe.regime != Regime::polled))
        return doubts;
    if (add(by_size(probe)) || !probe.column[col_w_m] || probe.regime == Regime::standstill) return doubts;
    if (!settled && doubts.empty()) add(by_smoothness(probe));
    const VoltageFit as_is = fit_voltages(probe);
    const bool known = !doubts.empty() && doubts.back().of_time_or_speed();
    if (known) return doubts;
    if (add(probe.is_half() ? by_half_signs(as_is) : by_signs(probe, as_is))) return doubts;
    const Maybe plate = probe.regime == Regime::polled ? by_flux(machine, as_is) : by_nameplate(probe, machine, as_is);
    if (plate && !(settled && plate->of_time_or_speed()))
        add(plate);
    else if (!settled && probe.regime != Regime::polled)
        add(by_pole_pairs(probe, machine, as_is));
    return doubts;
}

}  // namespace dqw
