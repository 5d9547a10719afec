#include "ref/fit/mechanical.hpp"

#include <cmath>
#include <stdexcept>

#include "ref/fit/explain.hpp"
#include "ref/fit/publish.hpp"
#include "ref/log/residual.hpp"
#include "ref/model/averaged.hpp"
#include "ref/model/blocks.hpp"
#include "ref/model/hat.hpp"
#include "ref/model/lasting.hpp"
#include "ref/model/linear.hpp"
#include "ref/model/mechanical.hpp"
#include "ref/model/plan.hpp"

namespace dqw {
namespace {

constexpr std::size_t kLeastRows = 100;
constexpr std::size_t kFirstRows = 40000, kFirstWindow = 4000;  ///< of the part a long log converges on first
constexpr double kGains[] = {0.005, 0.3};
constexpr double kMostHat_s = 2.0;  ///< above a shaft's own time constant slopes are no more than the speed's

/// K_t of torque_Nm = K_t i_q, from the logs that have both.
void fit_torque_constant(const Task& task, Result& result)
{
    const char* const name = "torque_constant_Nm_A";
    LinearModel model({name}, 1, [&task](const auto& visit) {
        for (const Log& log : task.logs) {
            if (log.torque_Nm.empty() || log.i_q_A.empty()) continue;
            for (std::size_t k = 0; k < log.rows(); ++k) {
                LinearModel::Row row;
                row.y[0] = log.torque_Nm[k];
                row.x[0][0] = log.i_q_A[k];
                visit(row);
            }
        }
    });
    if (model.rows() < kLeastRows) {
        result.not_identifiable.push_back(
            {name, "no log has both torque_Nm and i_q_A", excitation_for(name, Regime::mechanical)});
        return;
    }
    SolveOptions options;
    options.tick = task.tick;
    const Solution s = solve(model, Eigen::VectorXd::Zero(1), {true}, options);
    publish(task, model.names(), assess(s, model, Eigen::VectorXd::Zero(1)), result);
}

/// Entries of theta.
enum Index { kJ, kB, kGain };

WithoutEffects mechanical_model(const Task& task, const std::vector<std::vector<double>>& torque,
                                std::vector<Piece> pieces)
{
    // Without effects no torque turns with the shaft.
    static const std::vector<std::vector<double>> none;
    return {std::make_unique<MechanicalModel>(task.logs, torque, none, even_plan(std::move(pieces), 1)),
            {"J_kgm2", "B_Nms_rad"}};
}

std::vector<const std::vector<double>*> torque_of_pieces(const Task& task, const std::vector<Piece>& pieces,
                                                         const std::vector<std::vector<double>>& torque)
{
    std::vector<const std::vector<double>*> of_piece;
    for (const Piece& piece : pieces)
        of_piece.push_back(&torque[static_cast<std::size_t>(piece.log - task.logs.data())]);
    return of_piece;
}

/// Converges on a part of a long log, from the log's own starting values and from two gains.
Solution first_look(const Task& task, const std::vector<Piece>& pieces, const std::vector<std::vector<double>>& torque)
{
    const std::vector<Piece> part = spread_sample(pieces, kFirstRows, kFirstWindow);
    WithoutEffects model = mechanical_model(task, torque, part);
    SolveOptions options;
    options.passes = 4, options.tolerance = 1e-6, options.sigma_tolerance = 1e-2, options.tick = task.tick;
    Solution best;
    for (const MechanicalStart& start : mechanical_starts(part, torque_of_pieces(task, part, torque))) {
        for (double gain : kGains) {
            const Solution s = solve(model, Eigen::Vector3d(start.J_kgm2, start.B_Nms_rad, gain), {true, true, true},
                                     options);
            if (s.ok && (!best.ok || s.log_likelihood > best.log_likelihood)) best = s;
        }
    }
    return best;
}

PlainModel plain_model(const Eigen::VectorXd& theta, double torque_constant_Nm_A)
{
    PlainModel plain;
    plain.J_kgm2 = theta[kJ], plain.B_Nms_rad = theta[kB];
    plain.torque_constant_Nm_A = torque_constant_Nm_A;
    return plain;
}

/// Adds what lasts in the residual to the deviations, (E192).
void add_lasting(const Task& task, const std::vector<Piece>& pieces, const std::vector<std::vector<double>>& torque,
                 const Eigen::VectorXd& theta, Covariance& covariance)
{
    static const std::vector<std::vector<double>> none;
    const MechanicalModel model(task.logs, torque, none, even_plan(pieces, 1));
    const Eigen::Vector2d lasting = lasting_deviations(model.report({theta.head(2), {}, {}}, 0));
    for (Eigen::Index j : {kJ, kB}) {
        Assessment& a = covariance.each[static_cast<std::size_t>(j)];
        if (a.verdict != Verdict::determined) continue;
        covariance.of(j, j) += lasting[j] * lasting[j];
        a.sd = std::hypot(a.sd, lasting[j]);
    }
}

/// Publishes the averaged fit in place of the predicting one where its reported residual is clearly less, or J and B of
/// the prediction are none of the means'.
bool publish_averaged(const Task& task, const std::vector<Piece>& pieces,
                      const std::vector<std::vector<double>>& torque, const Eigen::VectorXd& predicted,
                      double torque_constant_Nm_A, Result& result)
{
    const HatChoice hat = choose_hat(pieces, kMostHat_s);
    const auto model = averaged_mechanical(pieces, torque_of_pieces(task, pieces, torque), hat.half_s);
    if (model->rows() < 10) return false;
    SolveOptions options;
    options.tick = task.tick;
    const Solution s = solve(*model, predicted.head(2), {true, true}, options);
    if (!s.ok || !(s.theta[0] > 0.0)) return false;
    Covariance covariance = assess(s, *model, Eigen::VectorXd::Zero(2));
    Result averaged;
    averaged.notes = result.notes;
    report_residual(task.logs, plain_model(s.theta, torque_constant_Nm_A), averaged);
    const auto sd = [&](Index j) {
        const Assessment& a = covariance.each[static_cast<std::size_t>(j)];
        return a.verdict == Verdict::determined ? a.sd : HUGE_VAL;
    };
    const bool off = is_off(predicted.head(2), s.theta, Eigen::Vector2d(sd(kJ), sd(kB)), hat.noise_part) &&
                     averaged.residual_rms < kAlike * result.residual_rms;
    if (!clearly_better(*model, averaged.residual_rms, result.residual_rms) && !off) return false;
    result = averaged;
    Assessment& inertia = covariance.each[kJ];
    inertia.sd = std::hypot(inertia.sd, hat.noise_part * inertia.value);
    add_lasting(task, pieces, torque, s.theta, covariance);
    publish(task, model->names(), covariance, result);
    result.notes.push_back("prediction does not hold of the torque's means; fitted to these");
    note_robust(covariance, result);
    return true;
}

}  // namespace

Result fit_mechanical(const Task& task)
{
    const std::vector<Piece> pieces = pieces_of(task.logs, kLeastPiece);
    if (rows_of(pieces) < kLeastRows)
        throw std::invalid_argument(task.logs.front().path + ": " + std::to_string(rows_of(pieces)) +
                                    " rows without a gap; a mechanical fit needs at least " +
                                    std::to_string(kLeastRows));
    Result result;
    std::vector<std::vector<double>> torque;
    std::string source, first_source;
    for (const Log& log : task.logs) {
        torque.push_back(torque_of(log, task.torque_constant_Nm_A.value_or(0.0), source));
        if (torque.back().empty())
            throw std::invalid_argument(
                log.path + ": no torque: neither torque_Nm, nor i_q_A with a torque constant, nor torque_cmd_Nm");
        if (source != first_source) result.notes.push_back("torque is " + source);
        first_source = source;
    }
    WithoutEffects model = mechanical_model(task, torque, pieces);
    SolveOptions options;
    options.tick = task.tick;
    Solution best = first_look(task, pieces, torque);
    if (best.ok) best = solve(model, best.theta, {true, true, true}, options);
    if (!best.ok)
        throw std::invalid_argument(task.logs.front().path +
                                    ": one sampling period spans many time constants of the machine");
    Covariance covariance = assess_excited(best, model, Eigen::VectorXd::Zero(3));
    const double torque_constant = task.torque_constant_Nm_A.value_or(0.0);
    report_residual(task.logs, plain_model(best.theta, torque_constant), result);
    if (!covariance.robust || !publish_averaged(task, pieces, torque, best.theta, torque_constant, result)) {
        add_lasting(task, pieces, torque, best.theta, covariance);
        publish(task, model.names(), covariance, result);
        note_robust(covariance, result);
    }
    if (task.asks("torque_constant_Nm_A")) fit_torque_constant(task, result);
    result.notes.push_back("correction gain of the speed: " + figure(best.theta[kGain]));
    return result;
}

}  // namespace dqw
