#include "ref/search/mechanical.hpp"

#include <algorithm>
#include <cmath>

namespace dqw {
namespace {

enum Index { kJ, kB };

double term_torque(const Term& t, double w, double theta)
{
    double torque[kMostWeights], sum = 0.0;
    evaluate_torque(t.input, w, theta, torque);
    for (int j = 0; j < weights_of(t.input.law); ++j) sum += t.weights[static_cast<std::size_t>(j)] * torque[j];
    return sum;
}

double terms_torque(const Point& at, double w, double theta)
{
    double sum = 0.0;
    for (const Term& t : at.terms) sum += term_torque(t, w, theta);
    return sum;
}

void add_inputs(const Point& at, const std::vector<Input>& candidates, double w, double theta, double part,
                Eigen::VectorXd& x)
{
    double torque[kMostWeights];
    Eigen::Index j = at.base.size() + at.gain.size();
    const auto put = [&](const Input& input) {
        evaluate_torque(input, w, theta, torque);
        for (int i = 0; i < weights_of(input.law); ++i) x[j++] += part * torque[i];
    };
    x[kB] += part * w;
    for (const Term& t : at.terms) {
        put(t.input);
        const double here = term_torque(t, w, theta);
        for (int i = 0; i < free_shapes_of(t.input); ++i) {
            Term moved = t;
            const double step = 1e-3 * t.input.shape[static_cast<std::size_t>(i)];
            moved.input.shape[static_cast<std::size_t>(i)] += step;
            x[j++] += part * (term_torque(moved, w, theta) - here) / step;
        }
    }
    for (const Input& input : candidates) put(input);
}

}  // namespace

std::vector<double> shaft_angle(const Log& log)
{
    if (!log.theta_m_rad.empty()) return log.theta_m_rad;
    std::vector<double> angle(log.rows());
    for (std::size_t k = 1; k < angle.size(); ++k)
        angle[k] = angle[k - 1] + 0.5 * (log.w_m_rad_s[k] + log.w_m_rad_s[k - 1]) * (log.t_s[k] - log.t_s[k - 1]);
    return angle;
}

const std::vector<std::string>& TraceMechanical::base_names() const
{
    static const std::vector<std::string> names{"J_kgm2", "B_Nms_rad"};
    return names;
}

std::vector<ReportBlock> TraceMechanical::report(const Point& at, std::size_t rows) const
{
    std::vector<ReportBlock> out;
    for (const Log& log : logs_) {
        const auto &torque = torque_[static_cast<std::size_t>(&log - logs_.data())],
                   &angle = angle_[static_cast<std::size_t>(&log - logs_.data())];
        const auto& w = log.w_m_rad_s;
        const std::size_t n = rows > 0 ? rows : block_rows(log);
        for (const Piece& piece : pieces_of(log, 2))
            for (std::size_t k = piece.begin; k + n < piece.end; k += n) {
                ReportBlock b{&log, k, k + n, {}, {}};
                const double time_s = span_s(piece, k, n);
                const auto less = [&](std::size_t r) {
                    return torque[r] - at.base[kB] * w[r] - terms_torque(at, w[r], angle[r]);
                };
                for (std::size_t r = k; r < k + n; ++r) {
                    const double dt = piece.period_s(r);
                    b.measured[0] += 0.5 * (torque[r] + torque[r + 1]) * dt;
                    b.residual[0] += 0.5 * (less(r) + less(r + 1)) * dt;
                }
                b.residual[0] = (b.residual[0] - at.base[kJ] * (w[k + n] - w[k])) / time_s;
                b.measured[0] /= time_s;
                out.push_back(b);
            }
    }
    return out;
}

bool TraceMechanical::pass(const Point& at, const std::vector<Input>& candidates, std::vector<BlockSum>& sums) const
{
    Eigen::Index n = at.columns();
    for (const Input& input : candidates) n += weights_of(input.law);
    sums.resize(plan_.blocks.size());
    for (BlockSum& s : sums) s.rows = 0.0, s.gram.assign(1, Eigen::MatrixXd::Zero(n + 1, n + 1));
    if (!at.values().allFinite() || !(at.base[kJ] > 0.0)) return false;
    if (averaged_)
        average(at, candidates, sums);
    else if (!predict(at, candidates, sums))
        return false;
    for (BlockSum& b : sums) b.gram[0].triangularView<Eigen::StrictlyUpper>() = b.gram[0].transpose();
    return true;
}

void TraceMechanical::average(const Point& at, const std::vector<Input>& candidates, std::vector<BlockSum>& sums) const
{
    const Eigen::Index n = sums.front().gram[0].rows() - 1;
    Eigen::VectorXd x(n), row(n + 1);
    for (std::size_t b = 0; b < sums.size(); ++b) {
        const FineBlock& fine = plan_.blocks[b];
        const Log& log = *fine.piece->log;
        const auto &torque = torque_[static_cast<std::size_t>(&log - logs_.data())],
                   &angle = angle_[static_cast<std::size_t>(&log - logs_.data())];
        const auto& w = log.w_m_rad_s;
        const std::size_t length = block_rows(log);
        for (std::size_t k = fine.begin; k + length < std::min(fine.end + 1, fine.piece->end); k += length) {
            x.setZero();
            const double share = 0.5 / static_cast<double>(length);
            double e = 0.0;
            for (std::size_t r = k; r < k + length; ++r)
                for (std::size_t s : {r, r + 1}) {
                    add_inputs(at, candidates, w[s], angle[s], share, x);
                    e += share * (torque[s] - at.base[kB] * w[s] - terms_torque(at, w[s], angle[s]));
                }
            x[kJ] = (w[k + length] - w[k]) / span_s(*fine.piece, k, length);
            row << -x, e - at.base[kJ] * x[kJ];
            sums[b].gram[0].selfadjointView<Eigen::Lower>().rankUpdate(row);
            sums[b].rows += 1.0;
        }
    }
}

bool TraceMechanical::predict(const Point& at, const std::vector<Input>& candidates, std::vector<BlockSum>& sums) const
{
    const double J = at.base[kJ], B = at.base[kB], gain = std::clamp(at.gain[0], 0.0, 1.0);
    const Eigen::Index n = sums.front().gram[0].rows() - 1;
    Eigen::VectorXd s(n), x(n), row(n + 1);
    std::size_t block = 0;
    for (const Piece& piece : plan_.pieces) {
        const Log& log = *piece.log;
        const auto &torque = torque_[static_cast<std::size_t>(&log - logs_.data())],
                   &angle = angle_[static_cast<std::size_t>(&log - logs_.data())];
        s.setZero();
        double w = log.w_m_rad_s[piece.begin];
        while (block < sums.size() && plan_.blocks[block].piece != &piece) ++block;
        for (std::size_t k = piece.begin; k + 1 < piece.end; ++k) {
            const double dt = piece.period_s(k), z = B * dt / J, decay = std::exp(-z),
                         push = dt / J * (std::abs(z) > 1e-8 ? (1.0 - decay) / z : 1.0);
            const double given = 0.5 * (torque[k] + torque[k + 1]), lost0 = terms_torque(at, w, angle[k]);
            double next = decay * w + push * (given - lost0);
            for (int i = 0; i < 2 && !at.terms.empty(); ++i)
                next = decay * w + push * (given - 0.5 * (lost0 + terms_torque(at, next, angle[k + 1])));
            if (!std::isfinite(next)) return false;
            x.setZero();
            x[kJ] = (next - w) / dt;
            add_inputs(at, candidates, w, angle[k], 0.5, x);
            add_inputs(at, candidates, next, angle[k + 1], 0.5, x);
            s = decay * s - push * x;
            const double e = log.w_m_rad_s[k + 1] - next;
            while (block < sums.size() && plan_.blocks[block].piece == &piece && k + 1 >= plan_.blocks[block].end)
                ++block;
            if (block < sums.size() && plan_.blocks[block].piece == &piece && k + 1 >= plan_.blocks[block].begin) {
                row << -s, e;
                sums[block].gram[0].selfadjointView<Eigen::Lower>().rankUpdate(row);
                sums[block].rows += 1.0;
            }
            const double young = 1.0 / (static_cast<double>(k - piece.begin) + 2.0), g = std::max(gain, young);
            s *= 1.0 - g;
            if (gain >= young) s[2] += e;
            w = next + g * e;
        }
    }
    return true;
}

}  // namespace dqw
