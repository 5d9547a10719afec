#include "ref/fit/polled.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "ref/fit/assess.hpp"
#include "ref/fit/explain.hpp"
#include "ref/fit/polled_logs.hpp"
#include "ref/fit/polled_shaft.hpp"
#include "ref/fit/publish.hpp"

namespace dqw {
namespace {

constexpr double kSignificant = 3.0;  // deviations

std::string share_of(double part) { return figure(100.0 * part) + " %"; }

void publish_R(const Task& task, const PolledLogs& p, Result& result)
{
    const PolledSolution& s = p.solution;
    const double V = s.x[kPolledV], sd_V = s.sd[kPolledV];
    PolledForm without = p.form;
    without.V = false;
    if (tells(s, kPolledR) || (p.form.V && std::abs(V) > kSignificant * sd_V)) {
        if (tells(s, kPolledR))
            result.parameters.push_back({"R_ohm", s.x[kPolledR], s.sd[kPolledR], false});
        else
            result.not_identifiable.push_back({"R_ohm",
                                               "beside the volts along the current its standard deviation is " +
                                                   share_of(s.sd[kPolledR] / std::abs(s.x[kPolledR])) + " of its value",
                                               "currents of widely different size at like speeds"});
        return;
    }
    const PolledSolution plain = p.form.V ? solve_polled(p.rows, without, p.noise_rad_s) : s;
    if (!plain.ok || !(plain.x[kPolledR] > 0.0) || !tells(plain, kPolledR)) {
        result.not_identifiable.push_back({"R_ohm", "the rows do not tell it from what the speed does",
                                           excitation_for("R_ohm", task.logs.front().regime)});
        return;
    }
    const double apart_ohm = s.x[kPolledR];
    const double sd = p.form.V ? std::hypot(s.sd[kPolledR], plain.x[kPolledR] - apart_ohm) : plain.x[kPolledR];
    result.parameters.push_back({"R_ohm", plain.x[kPolledR], sd, false});
    result.notes.push_back(
        "R holds what dead time adds: the two do not come apart in this log, where |i| hardly varies at "
        "like speeds" +
        (p.form.V ? "; with volts along the current R would be " + figure(1e3 * apart_ohm) + " ± " +
                        figure(1e3 * s.sd[kPolledR]) + " mΩ"
                  : std::string()));
}

void publish_weight(const Task& task, const PolledLogs& p, int weight, const char* name, Result& result)
{
    const PolledSolution& s = p.solution;
    const bool free = weight != kPolledLd || !p.form.one_L;
    // What only the inverter may hide is told, and is not usable.
    if (free && p.sd_of_rows[weight] < assessing::kUncertain * std::abs(s.x[weight])) {
        result.parameters.push_back({name, s.x[weight], s.sd[weight], false});
        return;
    }
    const std::string why = !free                ? "i_d hardly moves; it was taken to be L_q"
                            : s.sd[weight] > 0.0 ? "its standard deviation is " +
                                                       share_of(s.sd[weight] / std::abs(s.x[weight])) + " of its value"
                                                 : "no row tells it";
    result.not_identifiable.push_back({name, why, excitation_for(name, task.logs.front().regime)});
}

void report(const std::vector<Log>& logs, const PolledLogs& p, Result& result)
{
    double e2[2] = {}, v2[2] = {}, count = 0.0;
    std::size_t used = 0, rows = 0;
    for (const Log& log : logs) rows += log.rows();
    for (std::size_t k = 0; k < p.rows.size(); ++k) {
        const double share = p.solution.share[k];
        for (std::size_t a = 0; a < 2; ++a)
            e2[a] += share * std::pow(p.solution.e_V[k][a], 2), v2[a] += share * std::pow(p.rows[k].v_V[a], 2);
        count += share, used += share > 0.0;
    }
    const bool half = equations_a_row(p.rows) < 2.0;
    for (std::size_t a = half ? 1 : 0; a < 2; ++a)
        result.axes.push_back({a == 0 ? "d" : "q", std::sqrt(e2[a] / std::max(count, 1e-300)),
                               v2[a] > 0.0 ? 100.0 * std::sqrt(e2[a] / v2[a]) : 0.0});
    result.residual_rms = std::sqrt((e2[0] + e2[1]) / std::max(equations_a_row(p.rows) * count, 1e-300));
    result.notes.push_back("polled: " + std::to_string(used) + " of " + std::to_string(rows) +
                           " rows used, weighed by how settled they are (worth " + figure(std::round(count)) +
                           "); the rest move, have little current or lack a neighbour");
    if (half)
        result.notes.emplace_back(
            p.rows.front().voltage == PolledVoltage::size
                ? "of the voltage only its size is in the log: its direction follows from R, L and psi"
                : "v_d_V is not in the log: the q axis alone is fitted");
    if (std::any_of(logs.begin(), logs.end(), [](const Log& log) { return log.i_d_A.empty(); }))
        result.notes.emplace_back(
            "i_d_A is not in the log: it is taken as zero, and where it is not, psi takes L_d i_d over");
    for (std::size_t l = 0; l < logs.size(); ++l)
        if (const int lag = p.lag[l]; lag != 0)
            result.notes.push_back(logs[l].path + ": currents and voltages come " + std::to_string(std::abs(lag)) +
                                   (lag > 0 ? " rows after the speed" : " rows before the speed") + " (" +
                                   figure(std::abs(lag) * logs[l].dt_s) + " s): they were moved back");
    if (p.form.tau)
        result.notes.push_back("the voltage is turned against the current as if by " +
                               figure(1e6 * p.solution.x[kPolledTau]) + " ± " +
                               figure(1e6 * p.solution.sd[kPolledTau]) + " µs: it was turned back");
}

}  // namespace

Result fit_polled(const Task& task)
{
    const PolledLogs p = solve_logs(task.logs, task.pole_pairs.value_or(1.0));
    Result result;
    Task rest = task;
    const PolledSolution& s = p.solution;
    const std::pair<int, const char*> linkages[] = {{kPolledLd, "Ld_H"}, {kPolledLq, "Lq_H"}, {kPolledPsi, "psi_Wb"}};
    if (!s.ok) {
        for (const std::string& name : task.asked)
            result.not_identifiable.push_back({name, "the settled rows are all of one kind: nothing comes apart",
                                               excitation_for(name, task.logs.front().regime)});
        return result;
    }
    if (s.follows > kFollows)
        for (const char* name : {"R_ohm", "psi_Wb"})
            if (rest.asks(name)) {
                result.not_identifiable.push_back({name,
                                                   "the current follows the speed: noise of the speed takes " +
                                                       share_of(s.follows) + " of psi over into R",
                                                   "load that changes apart from the speed"});
                rest.asked.erase(std::remove(rest.asked.begin(), rest.asked.end(), name), rest.asked.end());
            }
    if (rest.asks("R_ohm")) publish_R(task, p, result);
    for (const auto& [weight, name] : linkages) {
        if (!task.pole_pairs && tells(s, weight) && (weight != kPolledLd || !p.form.one_L))
            withhold_product(rest, name, s.x[weight], s.sd[weight], result);
        if (rest.asks(name)) publish_weight(task, p, weight, name, result);
    }
    if (task.pole_pairs)
        result.parameters.push_back({"pole_pairs", *task.pole_pairs, 0.0, !task.by_angle});
    else if (task.asks("pole_pairs") || rest.asked.size() < task.asked.size())
        result.not_identifiable.push_back({"pole_pairs", "in polled rows they act only as factors of L and psi",
                                           excitation_for("pole_pairs", task.logs.front().regime)});
    // (4/pi) V per phase is the fundamental of what the three phases lose.
    constexpr double kPhase = 0.78539816339744831;
    if (p.form.V && std::abs(s.x[kPolledV]) > kSignificant * s.sd[kPolledV])
        result.dead_time.push_back({"voltage_V", kPhase * s.x[kPolledV], kPhase * s.sd[kPolledV], false});
    publish_shaft(task, p, result);
    report(task.logs, p, result);
    return result;
}

}  // namespace dqw
