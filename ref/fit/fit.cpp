#include "ref/fit/fit.hpp"

#include <algorithm>
#include <stdexcept>

#include "ref/fit/dynamic.hpp"
#include "ref/fit/explain.hpp"
#include "ref/fit/mechanical.hpp"
#include "ref/fit/polled.hpp"
#include "ref/fit/short_circuit.hpp"
#include "ref/fit/static.hpp"
#include "ref/fit/task.hpp"
#include "ref/log/piece.hpp"
#include "ref/log/turns.hpp"
#include "ref/model/open_circuit.hpp"

namespace dqw {
namespace {

using Names = std::vector<std::string>;

const Names kEvery{"R_ohm", "Ld_H", "Lq_H", "psi_Wb", "pole_pairs", "J_kgm2", "B_Nms_rad", "torque_constant_Nm_A"};

Names default_parameters(Regime regime)
{
    switch (regime) {
    case Regime::standstill: return {"R_ohm"};
    case Regime::mechanical: return {"J_kgm2", "B_Nms_rad"};
    default: return {"R_ohm", "Ld_H", "Lq_H", "psi_Wb"};
    }
}

/// What a log of the regime can be asked for; the rest is not identifiable from it by its kind.
Names possible_parameters(Regime regime)
{
    Names names = default_parameters(regime);
    names.push_back(regime == Regime::mechanical ? "torque_constant_Nm_A" : "pole_pairs");
    if (regime == Regime::polled) names.insert(names.end(), {"J_kgm2", "B_Nms_rad"});
    return names;
}

const char* name_of(Regime regime)
{
    switch (regime) {
    case Regime::dynamic: return "dynamic";
    case Regime::steady: return "steady";
    case Regime::standstill: return "standstill";
    case Regime::polled: return "polled";
    default: return "mechanical";
    }
}

bool has(const Names& names, const std::string& name)
{
    return std::find(names.begin(), names.end(), name) != names.end();
}

void need(const Log& log, const std::vector<double>& column, const char* name)
{
    if (column.size() != log.rows() || column.empty())
        throw std::invalid_argument(log.path + ": a " + name_of(log.regime) + " log needs " + name + " on every row");
}

void check_columns(const Log& log)
{
    switch (log.regime) {
    case Regime::polled:
        for (const auto& [column, name] : {std::pair(&Log::t_s, "t_s"), std::pair(&Log::w_m_rad_s, "w_m_rad_s"),
                                           std::pair(&Log::v_q_V, "v_q_V"), std::pair(&Log::i_q_A, "i_q_A")})
            need(log, log.*column, name);
        break;
    case Regime::dynamic: need(log, log.t_s, "t_s"); [[fallthrough]];
    case Regime::steady:
        need(log, log.w_m_rad_s, "w_m_rad_s");
        need(log, log.v_d_V, "v_d_V"), need(log, log.v_q_V, "v_q_V");
        need(log, log.i_d_A, "i_d_A"), need(log, log.i_q_A, "i_q_A");
        break;
    case Regime::standstill:
        if (log.i_d_A.empty() || log.v_d_V.empty()) need(log, log.i_q_A, "i_q_A"), need(log, log.v_q_V, "v_q_V");
        if (log.i_q_A.empty() || log.v_q_V.empty()) need(log, log.i_d_A, "i_d_A"), need(log, log.v_d_V, "v_d_V");
        break;
    case Regime::mechanical: need(log, log.t_s, "t_s"), need(log, log.w_m_rad_s, "w_m_rad_s"); break;
    }
    for (std::size_t s = 0; s < log.segments.size(); ++s)
        if (log.segments[s] > log.rows() || (s > 0 && log.segments[s] < log.segments[s - 1]))
            throw std::invalid_argument(log.path + ": segments are not in order");
}

/// The one value that the logs' machines state, if any.
std::optional<double> stated(const std::vector<Log>& logs, std::optional<double> Machine::*field, const char* name)
{
    std::optional<double> value;
    for (const Log& log : logs) {
        const auto& x = log.machine.*field;
        if (!x) continue;
        if (value && *value != *x)
            throw std::invalid_argument(log.path + ": " + name + " differs from the other logs': not one machine");
        value = x;
    }
    return value;
}

}  // namespace

Result fit(const std::vector<Log>& logs, const FitOptions& options)
{
    if (logs.empty()) throw std::invalid_argument("no log to fit");
    const Regime regime = logs.front().regime;
    std::size_t rows = 0, gaps = 0;
    for (const Log& log : logs) {
        if (log.regime != regime)
            throw std::invalid_argument(log.path + ": a " + name_of(log.regime) + " log beside a " + name_of(regime) +
                                        " one");
        check_columns(log);
        rows += log.rows();
        gaps += log.segments.empty() ? 0 : log.segments.size() - 1;
    }
    for (const std::string& name : options.parameters)
        if (!has(kEvery, name)) throw std::invalid_argument("unknown parameter " + name);

    int evaluations = 0;
    Task task{logs,
              options.parameters.empty() ? default_parameters(regime) : options.parameters,
              stated(logs, &Machine::pole_pairs, "pole_pairs"),
              stated(logs, &Machine::torque_constant_Nm_A, "torque_constant_Nm_A"),
              {}};
    if (!task.pole_pairs && (regime == Regime::dynamic || regime == Regime::steady))
        if (const double p = pole_pairs_of_angles(logs); p > 0.0) task.pole_pairs = p, task.by_angle = true;
    if (options.progress)
        task.tick = [&] {
            ++evaluations;
            options.progress(evaluations / (evaluations + 30.0));  // how many there will be is not known before
        };
    Result result = regime == Regime::dynamic                                 ? fit_dynamic(task)
                    : regime == Regime::mechanical                            ? fit_mechanical(task)
                    : regime == Regime::polled                                ? fit_polled(task)
                    : std::any_of(logs.begin(), logs.end(), is_short_circuit) ? fit_short_circuit(task)
                                                                              : fit_static(task);
    if (task.by_angle)
        result.notes.push_back("pole pairs found: " + std::to_string(static_cast<int>(*task.pole_pairs)) +
                               ", from the electrical angle");
    result.rows = rows;
    result.regime = regime;
    for (const std::string& name : task.asked)
        if (!has(possible_parameters(regime), name))
            result.not_identifiable.push_back(
                {name, std::string("a ") + name_of(regime) + " log does not contain it", excitation_for(name, regime)});
    std::stable_sort(result.parameters.begin(), result.parameters.end(), [](const Estimate& a, const Estimate& b) {
        return std::find(kEvery.begin(), kEvery.end(), a.name) < std::find(kEvery.begin(), kEvery.end(), b.name);
    });
    const bool simulated = regime == Regime::dynamic || regime == Regime::mechanical;
    const std::size_t left_out = simulated ? rows - rows_of(pieces_of(logs, kLeastPiece)) : 0;
    if (left_out > 0)
        result.notes.push_back(std::to_string(left_out) + " rows left out: they stand in stretches of fewer than " +
                               std::to_string(kLeastPiece) + " rows between gaps");
    if (gaps > 0 && simulated)
        result.notes.push_back(std::to_string(gaps) + " gap" + (gaps > 1 ? "s" : "") +
                               " in time: the simulation starts anew after each");
    if (options.progress) options.progress(1.0);
    return result;
}

}  // namespace dqw
