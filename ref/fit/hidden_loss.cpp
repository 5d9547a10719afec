#include "ref/fit/hidden_loss.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "ref/model/electrical.hpp"
#include "ref/model/plan.hpp"

namespace dqw {
namespace {

constexpr std::size_t kRows = 20000, kWindow = 1000, kFine = 2, kGuard = 40;
constexpr int kBase = 4;
/// Of logs that show none and exclude none, one in four has a loss that its controller does not give back, and one in
/// ten a filter of its currents, of half a period as a rule.
constexpr double kBefore = 1.0 / 3.0, kFiltered = 1.0 / 9.0, kUsualPeriods = 0.5;
/// Over the largest current.
constexpr double kWidths[] = {0.005, 0.01, 0.02, 0.04, 0.08};
/// Electrical angles at the first row where the log has none: three phases look the same every sixth of a turn.
constexpr int kAngles = 4;

double largest(const std::vector<double>& d, const std::vector<double>& q)
{
    double most = 0.0;
    for (std::size_t k = 0; k < d.size(); ++k) most = std::max(most, std::hypot(d[k], q[k]));
    return most;
}

bool has_angle(const Log& log) { return !log.theta_e_rad.empty() || !log.theta_m_rad.empty(); }

std::vector<Input> losses_of(bool angle, double i_max_A)
{
    std::vector<Input> out;
    for (const double width : kWidths) {
        for (int k = 0; k < (angle ? 1 : kAngles); ++k)
            out.push_back(dead_time_input(Modulation::centred, width * i_max_A, k * M_PI / 3.0 / kAngles, false));
        if (!angle) continue;
        for (const Modulation m : {Modulation::clamped_low, Modulation::clamped_high, Modulation::clamped_60})
            out.push_back(dead_time_input(m, width * i_max_A, 0.0, false));
    }
    return out;
}

}  // namespace

HiddenLoss hidden_loss(const std::vector<Piece>& pieces, double pole_pairs, const Point& at,
                       const Eigen::VectorXd& sigma)
{
    HiddenLoss out;
    out.loss_sd = out.filter_sd = Eigen::VectorXd::Zero(kBase);
    const bool angle = std::all_of(pieces.begin(), pieces.end(), [](const Piece& p) { return has_angle(*p.log); });
    // Without an angle each window would begin at one of its own.
    std::vector<Piece> windows = spread_sample(pieces, kRows, angle ? kWindow : kRows);
    if (!angle) windows.resize(1), windows[0].end = std::min(windows[0].end, windows[0].begin + kRows);
    const std::vector<Log> logs = copies_of(windows);
    double i_max_A = 0.0, v_max_V = 0.0;
    for (const Log& log : logs) {
        i_max_A = std::max(i_max_A, largest(log.i_d_A, log.i_q_A));
        v_max_V = std::max(v_max_V, largest(log.v_d_V, log.v_q_V));
    }
    if (!(i_max_A > 0.0) || !(v_max_V > 0.0)) return out;
    const double more = static_cast<double>(rows_of(pieces)) / static_cast<double>(rows_of(windows));
    std::vector<TraceColumns> columns;
    for (std::size_t k = 0; k < logs.size(); ++k) {
        columns.push_back(trace_columns(logs[k], pole_pairs, i_max_A, 0.0));
        windows[k] = {&logs[k], 0, logs[k].rows(), windows[k].dt_s};
    }
    const std::size_t stretches = std::max<std::size_t>(rows_of(windows) / kWindow, 1);
    const ElectricalModel model(logs, columns, pole_pairs, alternate_plan(windows, stretches, kFine, kGuard));
    std::vector<Input> hidden = losses_of(angle, i_max_A);
    const std::size_t losses = hidden.size();
    if (angle) hidden.push_back({Law::sensor_lag, {static_cast<double>(Channel::currents)}});
    std::vector<BlockSum> sums;
    if (!model.sweep(at, &hidden, sums)) return out;

    // J'J and J'e over the innovations' variance, of each block.
    const Eigen::Index known = at.columns(), all = columns_of(at, &hidden);
    std::vector<Eigen::MatrixXd> of_block;
    Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(all + 1, all + 1);
    for (const BlockSum& sum : sums) {
        of_block.push_back(sum.gram[0] / (sigma[0] * sigma[0]) + sum.gram[1] / (sigma[1] * sigma[1]));
        gram += of_block.back();
    }
    const Eigen::VectorXd scale = gram.diagonal().head(known).cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const Eigen::LDLT<Eigen::MatrixXd> base(scale.asDiagonal() * gram.topLeftCorner(known, known) * scale.asDiagonal());
    double total = 1.0;
    Eigen::Index column = known;
    for (const Input& input : hidden) {
        const bool filter = input.law == Law::sensor_lag;
        const double usual = filter ? kUsualPeriods * windows.front().dt_s : kUsualLoss * v_max_V,
                     usual2 = usual * usual, before = filter ? kFiltered : kBefore / static_cast<double>(losses);
        const Eigen::Index j = column;
        column += weights_of(input.law);
        // What a volt, or a second, takes from the parameters, and what is left of it that they do not take.
        const Eigen::VectorXd by_one = -(scale.asDiagonal() * base.solve(scale.asDiagonal() * gram.col(j).head(known)));
        const double left = gram(j, j) + by_one.dot(gram.col(j).head(known));
        if (!(left > 1e-9 * gram(j, j)) || !by_one.allFinite()) continue;
        // A block's score of it: x'[J e], and how far from the fit it stays.
        Eigen::VectorXd x = Eigen::VectorXd::Zero(all + 1);
        x.head(known) = by_one, x[j] = 1.0;
        const double weight = -gram.col(all).dot(x) / left;
        double scatter = 0.0;
        for (const Eigen::MatrixXd& b : of_block) {
            const Eigen::VectorXd of_x = b * x;
            scatter += std::pow(of_x[all] + of_x.dot(x) * weight, 2);
        }
        const double s2 = std::max(scatter, left) / (left * left * more);
        // Beside a prior of the usual size; a filter is late.
        const double part = usual2 / (usual2 + s2), mean = part * weight,
                     odds = before * std::exp(std::min(0.5 * weight * weight / s2 * part, 600.0)) /
                            std::sqrt(1.0 + usual2 / s2);
        if (filter && !(mean > 0.0)) continue;
        total += odds;
        (filter ? out.filtered : out.probable) += odds;
        (filter ? out.filter_sd : out.loss_sd) += odds * (mean * mean + part * s2) * by_one.head(kBase).cwiseAbs2();
        if (filter) out.filter_s = mean;
    }
    out.probable /= total, out.filtered /= total;
    out.loss_sd = (out.loss_sd / total).cwiseSqrt(), out.filter_sd = (out.filter_sd / total).cwiseSqrt();
    return out;
}

}  // namespace dqw
