#include "ref/model/open_circuit.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "ref/log/symmetric.hpp"

namespace dqw {
namespace {

/// Of the largest: an analyser's 0.02 % of its range is 1 % there.
constexpr double kSlow = 0.02;

bool is_zero(const std::vector<double>& column)
{
    return std::all_of(column.begin(), column.end(), [](double x) { return x == 0.0; });
}

/// A row's departure, as a part of its voltage.
struct Departure {
    double speed, part;
};

std::map<const Log*, std::vector<Departure>> departures(const Model& model, const Point& at)
{
    std::map<const Log*, std::vector<Departure>> out;
    double fastest = 0.0;
    const std::vector<ReportBlock> rows = model.report(at, 0);
    for (const ReportBlock& row : rows) fastest = std::max(fastest, std::abs(row.log->w_m_rad_s[row.begin]));
    for (const ReportBlock& row : rows) {
        const double speed = std::abs(row.log->w_m_rad_s[row.begin]);
        if (speed > kSlow * fastest) out[row.log].push_back({speed, row.residual[1] / row.measured[1]});
    }
    return out;
}

/// Of an analyser it goes with the reading.
double scatter(const std::vector<Departure>& rows)
{
    double sum = 0.0;
    for (const Departure& row : rows) sum += row.part * row.part;
    return rows.size() > 1 ? sum / static_cast<double>(rows.size() - 1) : 0.0;
}

/// What neighbours in speed have in common, a mean square.
double common(std::vector<Departure> rows)
{
    std::stable_sort(rows.begin(), rows.end(), [](const auto& a, const auto& b) { return a.speed < b.speed; });
    double sum = 0.0;
    for (std::size_t k = 1; k < rows.size(); ++k) sum += rows[k].part * rows[k - 1].part;
    return rows.size() > 1 ? std::max(sum / static_cast<double>(rows.size() - 1), 0.0) : 0.0;
}

/// By how much a line through the rows as they were taken goes from the first to the last.
double drift(const std::vector<Departure>& rows)
{
    const double n = static_cast<double>(rows.size()), middle = 0.5 * (n - 1.0);
    double xy = 0.0, xx = 0.0;
    for (std::size_t k = 0; k < rows.size(); ++k) {
        const double x = static_cast<double>(k) - middle;
        xy += x * rows[k].part, xx += x * x;
    }
    return xx > 0.0 ? (n - 1.0) * xy / xx : 0.0;
}

}  // namespace

bool is_open_circuit(const std::vector<Log>& logs)
{
    return std::all_of(logs.begin(), logs.end(), [](const Log& log) {
        return log.regime == Regime::steady && is_zero(log.i_d_A) && is_zero(log.i_q_A);
    });
}

bool is_short_circuit(const Log& log)
{
    return log.regime == Regime::steady && is_zero(log.v_d_V) && is_zero(log.v_q_V) && is_zero(log.i_d_A) &&
           !is_zero(log.i_q_A) && !is_zero(log.w_m_rad_s);
}

bool is_beside_magnet(const Point& at)
{
    return std::any_of(at.terms.begin(), at.terms.end(),
                       [](const Term& t) { return t.input.law == Law::magnet_temperature && t.input.heat < 0; });
}

Eigen::VectorXd open_circuit_deviations(const Model& model, const Point& at)
{
    const Eigen::Index n = at.columns();
    Eigen::VectorXd square = Eigen::VectorXd::Zero(n);
    std::vector<BlockSum> sums;
    if (!model.pass(at, {}, sums)) return square;
    const auto& blocks = model.plan().blocks;
    const Eigen::MatrixXd all = total_of(sums, 1).topLeftCorner(n, n);
    const Eigen::VectorXd size = all.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd inverse = size.asDiagonal() * pseudo_inverse(size.asDiagonal() * all * size.asDiagonal()) *
                                    size.asDiagonal();
    for (const auto& [log, rows] : departures(model, at)) {
        Eigen::VectorXd of_log = Eigen::VectorXd::Zero(n), apart = of_log;
        for (std::size_t b = 0; b < blocks.size(); ++b) {
            if (blocks[b].piece->log != log) continue;
            const Eigen::VectorXd of_block = sums[b].gram[1].topLeftCorner(n, n) * at.values();
            of_log += of_block, apart += (inverse * of_block).cwiseAbs2();
        }
        const double unseen = is_beside_magnet(at) ? std::pow(drift(rows), 2) : 0.0;
        square += std::max(common(rows), unseen) * (inverse * of_log).cwiseAbs2() + scatter(rows) * apart;
    }
    return square.cwiseSqrt();
}

}  // namespace dqw
