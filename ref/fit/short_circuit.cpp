#include "ref/fit/short_circuit.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "ref/fit/assess.hpp"
#include "ref/fit/explain.hpp"
#include "ref/fit/publish.hpp"
#include "ref/fit/static.hpp"
#include "ref/model/open_circuit.hpp"

namespace dqw {
namespace {

constexpr std::size_t kLeastRows = 6;  ///< of three unknowns
constexpr double kSmall = 0.02;        ///< of the largest current: below, an analyser's own offset
constexpr int kRounds = 40;
constexpr double kWithin = 2.0;  ///< deviations

struct Row {
    double w = 0.0, i_A = 0.0;  ///< electrical
};

std::vector<Row> rows_of(const std::vector<Log>& logs, double pole_pairs)
{
    std::vector<Row> rows;
    double largest = 0.0;
    for (const Log& log : logs)
        for (std::size_t k = 0; k < log.rows(); ++k) {
            rows.push_back({pole_pairs * std::abs(log.w_m_rad_s[k]), std::abs(log.i_q_A[k])});
            largest = std::max(largest, rows.back().i_A);
        }
    rows.erase(std::remove_if(rows.begin(), rows.end(),
                              [&](const Row& r) { return !(r.w > 0.0) || r.i_A < kSmall * largest; }),
               rows.end());
    std::sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) { return a.w < b.w; });
    return rows;
}

/// Logarithms of psi/R, L_d/R, L_q/R.
struct Solved {
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    double left = HUGE_VAL;  ///< of the current, sum of squares
};

/// What is left of ln |i|, and its slopes by the first two where the third goes along with the second.
Eigen::VectorXd left_of(const std::vector<Row>& rows, const Eigen::Vector3d& at, Eigen::MatrixX2d& slopes)
{
    const Eigen::Vector3d x = at.array().exp();
    Eigen::VectorXd e(static_cast<Eigen::Index>(rows.size()));
    slopes.resize(e.size(), 2);
    for (Eigen::Index k = 0; k < e.size(); ++k) {
        const Row& r = rows[static_cast<std::size_t>(k)];
        const double both = r.w * r.w * x[1] * x[2], q = r.w * r.w * x[2] * x[2];
        e(k) = std::log(r.i_A) - std::log(r.w * x[0] * std::sqrt(1.0 + q) / (1.0 + both));
        slopes.row(k) << 1.0, q / (1.0 + q) - 2.0 * both / (1.0 + both);
    }
    return e;
}

/// With ln L_q/L_d = u.
Solved solved(const std::vector<Row>& rows, double u)
{
    double slope = 0.0, largest = 0.0;
    for (const Row& r : rows) slope = std::max(slope, r.i_A / r.w), largest = std::max(largest, r.i_A);
    Solved s;
    s.at << std::log(slope), std::log(slope / largest), std::log(slope / largest) + u;
    Eigen::MatrixX2d x, other;
    double damping = 1e-3;
    Eigen::VectorXd e = left_of(rows, s.at, x);
    for (int round = 0; round < kRounds; ++round) {
        Eigen::Matrix2d m = x.transpose() * x;
        m.diagonal() *= 1.0 + damping;
        const Eigen::Vector2d step = m.inverse() * (x.transpose() * e);
        const Eigen::Vector3d next = s.at + Eigen::Vector3d(step[0], step[1], step[1]);
        const Eigen::VectorXd left = left_of(rows, next, other);
        const bool better = left.squaredNorm() < e.squaredNorm();
        if (better) s.at = next, e = left, x = other;
        damping *= better ? 0.3 : 10.0;
    }
    s.left = e.squaredNorm();
    const auto n = static_cast<double>(rows.size());
    double common = 0.0;
    for (Eigen::Index k = 1; k < e.size(); ++k) common += e(k) * e(k - 1) / (n - 1.0);
    const Eigen::Matrix2d own = (s.left / (n - 3.0) + n * std::max(common, 0.0)) *
                                Eigen::Matrix2d(x.transpose() * x).inverse();
    Eigen::Matrix<double, 3, 2> by;
    by << 1.0, 0.0, 0.0, 1.0, 0.0, 1.0;
    s.covariance = by * own * by.transpose();
    return s;
}

/// Of all saliencies the one that leaves least; those that leave hardly more widen it.
Solved solved(const std::vector<Row>& rows)
{
    // Of all machines; a step of them is 2 %.
    constexpr double kLeastRatio = 0.5, kMostRatio = 6.0;
    constexpr int kSteps = 124;
    const double from = std::log(kLeastRatio), step = std::log(kMostRatio / kLeastRatio) / kSteps;
    std::vector<Solved> all;
    for (int k = 0; k <= kSteps; ++k) all.push_back(solved(rows, from + step * k));
    const auto best = std::min_element(all.begin(), all.end(),
                                       [](const Solved& a, const Solved& b) { return a.left < b.left; });
    Solved out = *best;
    const double variance = best->left / static_cast<double>(rows.size() - 3);
    Eigen::Vector3d far(0.0, 0.0, step);
    for (const Solved& s : all)
        if (s.left - best->left <= kWithin * kWithin * variance) far = far.cwiseMax((s.at - best->at).cwiseAbs());
    out.covariance.diagonal() += (far / kWithin).cwiseAbs2();
    return out;
}

const Estimate* psi_of(const Result& open)
{
    for (const Estimate& e : open.parameters)
        if (e.name == "psi_Wb") return &e;
    return nullptr;
}

}  // namespace

Result fit_short_circuit(const Task& task)
{
    std::vector<Log> shorted, others;
    for (const Log& log : task.logs) (is_short_circuit(log) ? shorted : others).push_back(log);
    if (!others.empty() && !is_open_circuit(others))
        throw std::invalid_argument(shorted.front().path +
                                    ": a short circuit's current has a size alone: fit it by itself, or beside an open "
                                    "circuit of the machine");
    const std::vector<Row> rows = rows_of(shorted, task.pole_pairs.value_or(1.0));
    if (rows.size() < kLeastRows)
        throw std::invalid_argument(shorted.front().path + ": " + std::to_string(rows.size()) +
                                    " speeds with current; a short circuit needs at least " +
                                    std::to_string(kLeastRows));
    const Solved s = solved(rows);
    Task of_psi{others, {"psi_Wb"}, task.pole_pairs.value_or(1.0), {}, task.tick, task.by_angle};
    Result result = others.empty() ? Result() : fit_static(of_psi);
    result.not_identifiable.clear();
    const Estimate* known = psi_of(result);
    const double ln_psi = known ? std::log(known->value) : 0.0, part = known ? known->sd / known->value : 0.0;
    // Of ln R, ln L_d, ln L_q, psi, as differences of what the currents tell and of psi.
    Eigen::Matrix<double, 3, 3> by;
    by << -1.0, 0.0, 0.0, -1.0, 1.0, 0.0, -1.0, 0.0, 1.0;
    const Eigen::Vector3d value = (by * s.at).array() + ln_psi,
                          sd = ((by * s.covariance * by.transpose()).diagonal().array() + part * part).sqrt();
    std::vector<Estimate> psi = result.parameters;
    result.parameters.clear();
    Task rest = task;
    const char* const names[] = {"R_ohm", "Ld_H", "Lq_H"};
    for (int j = 0; j < 3; ++j) {
        const double size = std::exp(value[j]);
        if (!known)
            withhold(rest, names[j], "a short circuit alone tells it only as a part of psi",
                     "the open circuit's voltage by speed, beside it", result);
        else if (!(sd[j] < assessing::kUncertain))
            withhold(rest, names[j], "its standard deviation is " + figure(100.0 * sd[j]) + " % of its value",
                     "speeds from a tenth to ten times R/L", result);
        else if (!task.pole_pairs && j > 0)
            withhold_product(rest, names[j], size, sd[j] * size, result);
        else if (rest.asks(names[j]))
            result.parameters.push_back({names[j], size, sd[j] * size, false});
    }
    if (!known)
        withhold(rest, "psi_Wb", "without a voltage nothing tells it", "the open circuit's voltage by speed, beside it",
                 result);
    else if (!task.pole_pairs)
        withhold_product(rest, "psi_Wb", known->value, known->sd, result);
    for (const Estimate& e : psi)
        if (rest.asks(e.name)) result.parameters.push_back(e);
    if (task.pole_pairs) result.parameters.push_back({"pole_pairs", *task.pole_pairs, 0.0, !task.by_angle});
    const auto said = [&](const Eigen::Vector3d& of, double unit) {
        const double size = unit * std::exp(of.dot(s.at));
        return figure(size) + " ± " + figure(size * std::sqrt(of.dot(s.covariance * of)));
    };
    result.notes.push_back("short circuit: psi/L_d is " + said({1.0, -1.0, 0.0}, 1.0) + " A, R/L_d " +
                           said({0.0, -1.0, 0.0}, 1.0 / task.pole_pairs.value_or(1.0)) + " rad/s of the shaft; " +
                           figure(100.0 * std::sqrt(s.left / static_cast<double>(rows.size()))) +
                           " % of the current is left");
    return result;
}

}  // namespace dqw
