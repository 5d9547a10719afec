#include "ref/fit/polled_shaft.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "ref/fit/assess.hpp"
#include "ref/fit/explain.hpp"
#include "ref/log/symmetric.hpp"

namespace dqw {
namespace {

constexpr double kTurning = 0.05;   // of the largest speed: below, friction's sign is not known
constexpr double kMostLeft = 0.25;  // of the torque: more is a load
constexpr std::size_t kLeastRows = 30;

enum { kJ, kB, kC, kWeights };

struct ShaftRow {
    Eigen::Vector3d x, z;  ///< slope, speed, its sign; and what goes with them and not with the speed's noise
    double torque_Nm = 0.0;
};

std::vector<ShaftRow> shaft_rows(const Task& task, const PolledLogs& p)
{
    const double poles = task.pole_pairs.value_or(1.0);
    const PolledVector& weights = p.solution.x;
    std::vector<ShaftRow> out;
    double fastest = 0.0;
    for (const Log& log : task.logs)
        for (const double w : log.w_m_rad_s) fastest = std::max(fastest, std::abs(w));
    for (std::size_t l = 0; l < task.logs.size(); ++l) {
        const Log& log = task.logs[l];
        for (const PolledRow& r : polled_rows(log, p.lag[l])) {
            const auto s = static_cast<std::size_t>(static_cast<long>(r.row) - p.lag[l]);
            const double step_s = log.t_s[s] - log.t_s[s - 1], now = log.w_m_rad_s[s], last = log.w_m_rad_s[s - 1];
            if (!(step_s > 0.0) || std::min(std::abs(now), std::abs(last)) < kTurning * fastest || now * last < 0.0)
                continue;
            ShaftRow row;
            row.torque_Nm = 1.5 * poles * r.i_A[1] *
                            (weights[kPolledPsi] + (weights[kPolledLd] - weights[kPolledLq]) * r.i_A[0]);
            row.x = {(now - last) / step_s, r.w_rad_s, r.w_rad_s > 0.0 ? 1.0 : -1.0};
            row.z = {row.torque_Nm, row.x[kB], row.x[kC]};
            out.push_back(row);
        }
    }
    return out;
}

struct Shaft {
    Eigen::Vector3d value, sd;
    double left = 1.0;  ///< of the torque, RMS
};

/// Of the torque of the third of rows whose speed changes least, what friction leaves; noise of their slopes is no
/// torque.
double left_by(std::vector<ShaftRow> rows, const Eigen::Vector3d& value)
{
    const auto third = rows.begin() + static_cast<std::ptrdiff_t>(rows.size() / 3);
    std::nth_element(rows.begin(), third, rows.end(),
                     [](const ShaftRow& a, const ShaftRow& b) { return std::abs(a.x[kJ]) < std::abs(b.x[kJ]); });
    double left = 0.0, all = 0.0;
    for (auto r = rows.begin(); r != third; ++r)
        left += std::pow(r->torque_Nm - r->x[kB] * value[kB] - r->x[kC] * value[kC], 2),
            all += r->torque_Nm * r->torque_Nm;
    return all > 0.0 ? std::sqrt(left / all) : 1.0;
}

/// Torque as the instrument of the slope: its noise is small, the slope's is not.
Shaft solved(const std::vector<ShaftRow>& rows)
{
    Eigen::Matrix3d a = Eigen::Matrix3d::Zero(), scatter = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    for (const ShaftRow& r : rows) a += r.z * r.x.transpose(), b += r.z * r.torque_Nm;
    const Eigen::Matrix3d inverse = pseudo_inverse(a);
    Shaft out;
    out.value = inverse * b;
    std::vector<Eigen::Vector3d> scores;
    for (const ShaftRow& r : rows) scores.push_back(r.z * (r.torque_Nm - r.x.dot(out.value)));
    const auto lags = static_cast<std::size_t>(1.5 * std::cbrt(static_cast<double>(rows.size())));
    for (std::size_t lag = 0; lag <= lags; ++lag)
        for (std::size_t k = lag; k < scores.size(); ++k) {
            const Eigen::Matrix3d product = scores[k] * scores[k - lag].transpose();
            const double weight = 1.0 - static_cast<double>(lag) / static_cast<double>(lags + 1);
            scatter += lag == 0 ? product : Eigen::Matrix3d(weight * (product + product.transpose()));
        }
    out.sd = (inverse * scatter * inverse.transpose()).diagonal().cwiseMax(0.0).cwiseSqrt();
    out.left = left_by(rows, out.value);
    return out;
}

}  // namespace

void publish_shaft(const Task& task, const PolledLogs& p, Result& result)
{
    const char* const names[] = {"J_kgm2", "B_Nms_rad"};
    if (!task.asks(names[kJ]) && !task.asks(names[kB])) return;
    const auto cannot = [&](const char* name, const std::string& why) {
        if (task.asks(name)) result.not_identifiable.push_back({name, why, excitation_for(name, Regime::mechanical)});
    };
    const PolledSolution& s = p.solution;
    const bool psi = tells(s, kPolledPsi) && !(s.follows > kFollows);
    const std::vector<ShaftRow> rows = psi ? shaft_rows(task, p) : std::vector<ShaftRow>();
    if (rows.size() < kLeastRows) {
        for (const char* name : names)
            cannot(name,
                   psi ? "too few rows that turn without a break" : "psi, which makes torque of i_q, is not known");
        return;
    }
    Shaft shaft = solved(rows);
    for (int j = 0; j < kWeights; ++j)
        shaft.sd[j] = std::hypot(shaft.sd[j], shaft.value[j] * s.sd[kPolledPsi] / s.x[kPolledPsi]);
    const std::string left = figure(100.0 * shaft.left) + " % of the torque of settled rows";
    for (const int j : {kJ, kB}) {
        if (shaft.left > kMostLeft && task.asks(names[j]))
            result.not_identifiable.push_back(
                {names[j], "with friction and inertia " + left + " is left: a load, which nobody may know",
                 "the shaft alone: take the load off"});
        else if (shaft.left > kMostLeft)
            continue;
        else if (!(shaft.sd[j] < assessing::kUncertain * shaft.value[j]))
            cannot(names[j],
                   "it is " + figure(shaft.value[j]) + " with a standard deviation of " + figure(shaft.sd[j]));
        else if (task.asks(names[j]))
            result.parameters.push_back({names[j], shaft.value[j], shaft.sd[j], false});
    }
    if (shaft.left > kMostLeft) return;
    const double C_Nm = shaft.value[kC], sd_Nm = shaft.sd[kC];
    const bool one_way = std::all_of(rows.begin(), rows.end(),
                                     [&](const ShaftRow& r) { return r.x[kC] == rows.front().x[kC]; });
    const std::string usable =
        one_way
            ? ", not usable: the log turns one way, and a constant load is the same there; take the load off, or turn "
              "both ways"
        : !why_not_usable({"coulomb_Nm", C_Nm, sd_Nm}).empty() ? ", not usable"
                                                               : "";
    result.notes.push_back("Coulomb friction " + figure(1e3 * C_Nm) + " ± " + figure(1e3 * sd_Nm) + " mNm" + usable +
                           "; " + left + " is left. Torque is 1.5 p psi i_q of this log, and a load would be in all");
}

}  // namespace dqw
