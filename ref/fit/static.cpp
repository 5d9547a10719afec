#include "ref/fit/static.hpp"

#include <cmath>
#include <stdexcept>

#include "ref/fit/drag.hpp"
#include "ref/fit/explain.hpp"
#include "ref/fit/publish.hpp"
#include "ref/log/residual.hpp"
#include "ref/model/open_circuit.hpp"
#include "ref/model/plan.hpp"
#include "ref/model/settled.hpp"

namespace dqw {
namespace {

constexpr std::size_t kLeastRows = 3;

}  // namespace

Result fit_static(const Task& task)
{
    const bool standstill = task.logs.front().regime == Regime::standstill;
    const double pole_pairs = task.pole_pairs.value_or(1.0);
    std::vector<TraceColumns> columns;
    std::vector<Piece> pieces;
    for (const Log& log : task.logs) {
        columns.push_back(trace_columns(log, pole_pairs, 1.0, 0.0));
        if (log.rows() > 0) pieces.push_back({&log, 0, log.rows(), 0.0});
    }
    WithoutEffects model(std::make_unique<SettledModel>(task.logs, columns, pole_pairs, even_plan(pieces, 0)),
                         {"R_ohm", "Ld_H", "Lq_H", "psi_Wb"});
    if (model.rows() < kLeastRows)
        throw std::invalid_argument(task.logs.front().path + ": " + std::to_string(model.rows()) +
                                    " rows; a fit of settled points needs at least " + std::to_string(kLeastRows));
    SolveOptions options;
    options.tick = task.tick;
    options.common_weight = true;  // what is left is mostly not noise, and an axis at rest would otherwise rule
    const Solution s = solve(model, Eigen::Vector4d::Zero(), {true, !standstill, !standstill, !standstill}, options);
    Covariance covariance = assess(s, model, Eigen::Vector4d::Zero());
    if (is_open_circuit(task.logs)) {
        Plan each{pieces, {}};
        for (const Piece& piece : each.pieces)
            for (std::size_t k = piece.begin; k < piece.end; ++k) each.blocks.push_back({&piece, k, k + 1, false});
        const SettledModel settled(task.logs, columns, pole_pairs, std::move(each));
        const Eigen::VectorXd hidden = open_circuit_deviations(settled, {s.theta, {}, {}});
        for (std::size_t j = 0; j < covariance.each.size(); ++j)
            covariance.each[j].sd = std::hypot(covariance.each[j].sd, hidden[static_cast<Eigen::Index>(j)]);
    }

    Result result;
    PlainModel plain;
    plain.R_ohm = s.theta[0];
    plain.pole_pairs = pole_pairs;
    Task rest = task;
    if (!standstill) {
        plain.Ld_H = s.theta[1], plain.Lq_H = s.theta[2], plain.psi_Wb = s.theta[3];
        for (std::size_t j = 1; !task.pole_pairs && j < 4; ++j)
            if (covariance.each[j].verdict == Verdict::determined)
                withhold_product(rest, model.names()[j], covariance.each[j].value, covariance.each[j].sd, result);
    }
    publish(rest, standstill ? std::vector<std::string>{"R_ohm"} : model.names(), covariance, result);
    if (task.pole_pairs)
        result.parameters.push_back({"pole_pairs", *task.pole_pairs, 0.0, !task.by_angle});
    else if (task.asks("pole_pairs") || rest.asked.size() < task.asked.size())
        result.not_identifiable.push_back({"pole_pairs",
                                           standstill ? "at rest the pole pairs have no effect"
                                                      : "in settled points they act only as factors of L and psi",
                                           excitation_for("pole_pairs", task.logs.front().regime)});
    note_robust(covariance, result);
    if (is_open_circuit(task.logs))
        if (const std::string drag = drag_of(task.logs); !drag.empty()) result.notes.push_back(drag);
    report_residual(task.logs, plain, result);
    return result;
}

}  // namespace dqw
