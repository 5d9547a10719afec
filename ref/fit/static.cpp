#include "ref/fit/static.hpp"

#include <cmath>
#include <stdexcept>

#include "ref/fit/explain.hpp"
#include "ref/fit/publish.hpp"
#include "ref/log/residual.hpp"
#include "ref/model/linear.hpp"

namespace dqw {
namespace {

constexpr std::size_t kLeastRows = 3;

double at(const std::vector<double>& column, std::size_t k) { return column.empty() ? 0.0 : column[k]; }

/// v_d = R i_d - w_e Lq i_q,  v_q = R i_q + w_e Ld i_d + w_e psi
LinearModel steady_model(const std::vector<Log>& logs, double pole_pairs)
{
    return LinearModel({"R_ohm", "Ld_H", "Lq_H", "psi_Wb"}, 2, [&logs, pole_pairs](const auto& visit) {
        for (const Log& log : logs)
            for (std::size_t k = 0; k < log.rows(); ++k) {
                const double w = pole_pairs * log.w_m_rad_s[k], i_d = log.i_d_A[k], i_q = log.i_q_A[k];
                LinearModel::Row row;
                row.y = {log.v_d_V[k], log.v_q_V[k]};
                row.x[0] = {i_d, 0.0, -w * i_q, 0.0};
                row.x[1] = {i_q, w * i_d, 0.0, w};
                visit(row);
            }
    });
}

/// v = R i on both axes; an axis that the file lacks is zero.
LinearModel standstill_model(const std::vector<Log>& logs)
{
    return LinearModel({"R_ohm"}, 2, [&logs](const auto& visit) {
        for (const Log& log : logs)
            for (std::size_t k = 0; k < log.rows(); ++k) {
                LinearModel::Row row;
                row.y = {at(log.v_d_V, k), at(log.v_q_V, k)};
                row.x[0][0] = at(log.i_d_A, k);
                row.x[1][0] = at(log.i_q_A, k);
                visit(row);
            }
    });
}

}  // namespace

Result fit_static(const Task& task)
{
    const bool standstill = task.logs.front().regime == Regime::standstill;
    LinearModel model = standstill ? standstill_model(task.logs)
                                   : steady_model(task.logs, task.pole_pairs.value_or(1.0));
    if (model.rows() < kLeastRows)
        throw std::invalid_argument(task.logs.front().path + ": " + std::to_string(model.rows()) +
                                    " rows; a fit of settled points needs at least " + std::to_string(kLeastRows));
    const auto n = static_cast<Eigen::Index>(model.names().size());
    SolveOptions options;
    options.tick = task.tick;
    options.common_weight = true;  // what is left is mostly not noise, and an axis at rest would otherwise rule
    const Solution s = solve(model, Eigen::VectorXd::Zero(n), std::vector<bool>(static_cast<std::size_t>(n), true),
                             options);
    Eigen::VectorXd typical = Eigen::VectorXd::Zero(n);
    const Covariance covariance = assess(s, model, typical);

    Result result;
    PlainModel plain;
    plain.R_ohm = s.theta[0];
    plain.pole_pairs = task.pole_pairs.value_or(1.0);
    Task rest = task;
    if (!standstill) {
        plain.Ld_H = s.theta[1], plain.Lq_H = s.theta[2], plain.psi_Wb = s.theta[3];
        for (std::size_t j = 1; !task.pole_pairs && j < 4; ++j)
            if (covariance.each[j].verdict == Verdict::determined)
                withhold_product(rest, model.names()[j], covariance.each[j].value, covariance.each[j].sd, result);
    }
    publish(rest, model.names(), covariance, result);
    if (task.pole_pairs)
        result.parameters.push_back({"pole_pairs", *task.pole_pairs, 0.0, true});
    else if (task.asks("pole_pairs") || rest.asked.size() < task.asked.size())
        result.not_identifiable.push_back({"pole_pairs",
                                           standstill ? "at rest the pole pairs have no effect"
                                                      : "in settled points they act only as factors of L and psi",
                                           excitation_for("pole_pairs", task.logs.front().regime)});
    note_robust(covariance, result);
    report_residual(task.logs, plain, result);
    return result;
}

}  // namespace dqw
