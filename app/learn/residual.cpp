#include "app/learn/residual.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "app/base/columns.hpp"
#include "app/base/effect_names.hpp"
#include "app/base/modulation.hpp"
#include "app/learn/parts.hpp"
#include "app/learn/signals.hpp"
#include "dqw_modulation.h"
#include "dqw_transform.h"

namespace dqw {
namespace {

/// As the learners have them.
std::vector<double> weights_of(const std::vector<TraceInput>& inputs, const Log& log)
{
    std::vector<double> all;
    for (const TraceInput& in : inputs) {
        std::vector<double> w = in.weights;
        w.resize(static_cast<std::size_t>(dqw_effect_weights(*effect_named(in.effect))));
        for (double& x : w) x = std::isfinite(x) ? x / weight_unit(in, log, inputs) : 0.0;
        all.insert(all.end(), w.begin(), w.end());
    }
    return all;
}

/// The dead time where a leg rests: what it takes of a volt in the period from `last`, mean of both samples, less what
/// it takes where all legs switch.
void rest(const TraceInput& dead_time, const dqw_sample& last, const dqw_sample& now, double& d_V, double& q_V)
{
    const auto modulation = modulation_named(dead_time.modulation);
    if (!modulation || *modulation == DQW_MODULATION_CENTRED) return;
    const dqw_abc v = dqw_clarke_inverse(dqw_park_inverse({last.v_d_V, last.v_q_V}, last.cosine, last.sine));
    constexpr float kFine = 1e6F;  // parts of the voltage, as the estimator compares whole numbers
    const float size = std::max({std::fabs(v.a), std::fabs(v.b), std::fabs(v.c), 1e-9F});
    const auto whole = [&](float x) { return static_cast<std::int32_t>(kFine * x / size); };
    const std::int32_t each[3] = {whole(v.a), whole(v.b), whole(v.c)};
    const unsigned resting = dqw_modulation_resting(*modulation, each);
    const double constant_V = dead_time.weights.size() > 1 ? dead_time.weights[1] : 0.0;
    for (const dqw_sample* s : {&last, &now}) {
        const dqw_abc i = dqw_clarke_inverse(dqw_park_inverse({s->i_d_A, s->i_q_A}, s->cosine, s->sine));
        const auto lost = [&](unsigned bit, float current) {
            if ((resting & bit) == 0) return 0.0F;
            return static_cast<float>(constant_V + dead_time.weights[0] * std::tanh(current / dead_time.shape[0]));
        };
        const dqw_dq less = dqw_park(dqw_clarke({lost(1, i.a), lost(2, i.b), lost(4, i.c)}), s->cosine, s->sine);
        d_V -= 0.5 * static_cast<double>(less.d), q_V -= 0.5 * static_cast<double>(less.q);
    }
}

void take_from(Log& log, const std::vector<TraceInput>& inputs, const std::vector<dqw_effect_config>& list,
               double pole_pairs, float i_base_A)
{
    const bool settled = log.regime != Regime::dynamic;
    const std::vector<double> weights = weights_of(inputs, log);
    dqw_effect effect;
    const dqw_effect_base base{
        period_of(log, inputs), 1.0F, i_base_A, 1.0F, static_cast<std::uint16_t>(std::max(pole_pairs, 1.0)), false};
    if (dqw_effect_init(&effect, list.data(), static_cast<int>(list.size()), &base) != DQW_OK) return;
    const SampleSource sample(log, pole_pairs, inputs);
    std::vector<double> d(log.rows()), q(log.rows());
    float x_d[DQW_EFFECT_WEIGHTS], x_q[DQW_EFFECT_WEIGHTS];
    dqw_sample last{};
    std::size_t next_segment = 0;
    bool has_last = false;
    for (std::size_t k = 0; k < log.rows(); ++k) {
        if (next_segment < log.segments.size() && k == log.segments[next_segment]) {
            dqw_effect_gap(&effect);
            has_last = false;
            ++next_segment;
        }
        const dqw_sample now = sample(k);
        bool there = true;
        if (settled)
            dqw_effect_static(&effect, &now, x_d, x_q);
        else
            there = dqw_effect_pair(&effect, has_last ? &last : nullptr, &now, x_d, x_q);
        if (there) dqw_effect_dead_time(&effect, settled ? nullptr : &last, &now, x_d, x_q);
        dqw_effect_heat(&effect, now.i_d_A, now.i_q_A);
        dqw_effect_warm(&effect, 1);
        const std::size_t row = settled ? k : k - 1;
        for (std::size_t i = 0; there && i < weights.size(); ++i) {
            d[row] += weights[i] * static_cast<double>(x_d[i]);
            q[row] += weights[i] * static_cast<double>(x_q[i]);
        }
        for (const TraceInput& in : inputs)
            if (there && in.effect == "dead_time" && !in.weights.empty() && !in.shape.empty())
                rest(in, settled ? now : last, now, d[row], q[row]);
        last = now;
        has_last = true;
    }
    for (std::size_t k = 0; k < log.rows(); ++k) {
        if (!log.v_d_V.empty()) log.v_d_V[k] -= d[k];
        if (!log.v_q_V.empty()) log.v_q_V[k] -= q[k];
    }
}

void take_torque_from(Log& log, const std::vector<TraceInput>& inputs, const std::vector<dqw_effect_config>& list,
                      double torque_constant_Nm_A)
{
    std::string source;
    std::vector<double> torque = torque_of(log, torque_constant_Nm_A, source);
    const std::vector<float> angle = shaft_angle_of(log);
    const std::vector<double> weights = weights_of(inputs, log);
    for (std::size_t k = 0; k < torque.size(); ++k) {
        std::size_t n = 0;
        for (const dqw_effect_config& c : list) {
            float x[DQW_EFFECT_STARTS];
            dqw_effect_torque(&c, static_cast<float>(log.w_m_rad_s[k]), angle[k], x);
            for (int i = 0; i < dqw_effect_weights(c.effect); ++i)
                torque[k] -= weights[n++] * static_cast<double>(x[i]);
        }
    }
    log.torque_Nm = torque;
}

/// The marked rows of a log, each stretch of them a segment of its own.
Log part_of(const Log& log, const std::vector<char>& marks, std::size_t first)
{
    Log part = log;
    part.segments.clear();
    std::vector<std::size_t> rows;
    for (std::size_t k = 0; k < log.rows(); ++k) {
        if (marks[first + k] == 0) continue;
        const bool begins = k == 0 || marks[first + k - 1] == 0 ||
                            std::binary_search(log.segments.begin(), log.segments.end(), k);
        if (begins) part.segments.push_back(rows.size());
        rows.push_back(k);
    }
    for (const ColumnInfo& column : columns) {
        std::vector<double>& to = part.*(column.values);
        if (to.empty()) continue;
        for (std::size_t n = 0; n < rows.size(); ++n) to[n] = to[rows[n]];
        to.resize(rows.size());
    }
    return part;
}

std::vector<Log> parts_of(const std::vector<Log>& logs, const std::vector<char>& marks)
{
    std::vector<Log> parts;
    std::size_t first = 0;
    for (const Log& log : logs) {
        Log part = part_of(log, marks, first);
        if (!part.segments.empty()) parts.push_back(std::move(part));
        first += log.rows();
    }
    return parts;
}

/// The logs without what the effects take: v (or the torque) less their part, so that the plain model is left. Every
/// row counts, whether it was learned or not.
std::vector<Log> without_effects(const std::vector<Log>& logs, const std::vector<TraceInput>& inputs,
                                 const PlainModel& model)
{
    std::vector<Log> left = logs;
    if (inputs.empty()) return left;
    const std::vector<dqw_effect_config> list = lists_of(inputs);
    const auto i_base_A = static_cast<float>(largest_current(logs));
    for (Log& log : left) {
        if (log.regime == Regime::mechanical)
            take_torque_from(log, inputs, list, model.torque_constant_Nm_A);
        else
            take_from(log, inputs, list, model.pole_pairs, i_base_A);
    }
    return left;
}

}  // namespace

void report_residual_of(const std::vector<Log>& logs, const std::vector<TraceInput>& inputs, const PlainModel& model,
                        const std::vector<char>* heldout_row, Result& result)
{
    if (inputs.empty() && heldout_row == nullptr) {
        report_residual(logs, model, result);
        return;
    }
    std::vector<Log> left = without_effects(logs, inputs, model);
    if (heldout_row != nullptr) left = parts_of(left, *heldout_row);
    report_residual(left, model, result);
    if (inputs.empty()) return;
    Result measured;
    if (heldout_row != nullptr)
        report_residual(parts_of(logs, *heldout_row), model, measured);
    else
        report_residual(logs, model, measured);
    for (std::size_t n = 0; n < std::min(result.axes.size(), measured.axes.size()); ++n) {
        const double signal = measured.axes[n].percent > 0.0 ? measured.axes[n].rms / measured.axes[n].percent : 0.0;
        result.axes[n].percent = signal > 0.0 ? result.axes[n].rms / signal : 0.0;
    }
}

}  // namespace dqw
