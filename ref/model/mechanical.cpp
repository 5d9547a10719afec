#include "ref/model/mechanical.hpp"

#include <algorithm>
#include <cmath>

namespace dqw {
namespace {

enum Index { kJ, kB };

constexpr double kLargestRateDt = 5.0;  ///< B dt / J beyond which a log says nothing about J

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

/// One period under a torque that runs straight from T_k to T_{k+1}, z = B dt / J:
///   w_{k+1} = decay w_k + start T_k + end T_{k+1},   decay = e^-z,   start = dt/J (f1 - f2),   end = dt/J f2
///   f1 = sum (-z)^n/(n+1)!,   f2 = sum (-z)^n/(n+2)!
struct Period {
    double decay, start, end;
    double start_by_z, end_by_z;

    Period(double inertia, double z, double dt)
    {
        // Of f1, f2 and their slopes by -z.
        double f1 = 0.0, f2 = 0.0, f1_slope = 0.0, f2_slope = 0.0, power = 1.0, last = 0.0, factorial = 1.0;
        for (int n = 0; n < 40; ++n) {
            f1 += power / factorial, f2 += power / (factorial * (n + 2));
            f1_slope += n * last / factorial, f2_slope += n * last / (factorial * (n + 2));
            last = power, power *= -z, factorial *= n + 2;
        }
        decay = std::exp(-z);
        start = dt / inertia * (f1 - f2), end = dt / inertia * f2;
        start_by_z = -dt / inertia * (f1_slope - f2_slope), end_by_z = -dt / inertia * f2_slope;
    }
};

/// Adds what one unit of each effect's weight takes of the torque at speed `w`, times `part`.
void add_inputs(const Point& at, const std::vector<Input>& candidates, double w, double theta, double part,
                Eigen::VectorXd& x)
{
    double torque[kMostWeights];
    Eigen::Index j = at.base.size() + at.gain.size();
    const auto put = [&](const Input& input) {
        evaluate_torque(input, w, theta, torque);
        for (int i = 0; i < weights_of(input.law); ++i) x[j++] += part * torque[i];
    };
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

MechanicalModel::MechanicalModel(const std::vector<Log>& logs, const std::vector<std::vector<double>>& torque,
                                 const std::vector<std::vector<double>>& angle, Plan plan, bool averaged)
    : logs_(logs), torque_(torque), angle_(angle), plan_(std::move(plan)), averaged_(averaged)
{
    double time_s = 0.0, periods = 0.0;
    for (const Piece& piece : plan_.pieces) {
        for (std::size_t k = piece.begin; k + 1 < piece.end; ++k) dt_max_s_ = std::max(dt_max_s_, piece.period_s(k));
        time_s += piece.log->t_s[piece.end - 1] - piece.log->t_s[piece.begin];
        periods += static_cast<double>(piece.rows() - 1);
    }
    if (periods > 0.0) dt_mean_s_ = time_s / periods;
}

void MechanicalModel::weigh_starts(const Point& at, bool count)
{
    weights_ = StartWeights(GainSchedule(at.gain[0], at.base[kB] / at.base[kJ] * dt_mean_s_), count);
}

const std::vector<std::string>& MechanicalModel::base_names() const
{
    static const std::vector<std::string> names{"J_kgm2", "B_Nms_rad"};
    return names;
}

std::vector<ReportBlock> MechanicalModel::report(const Point& at, std::size_t rows) const
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

bool MechanicalModel::sweep(const Point& at, const std::vector<Input>* candidates, std::vector<BlockSum>& sums) const
{
    sums = empty_sums(plan_.blocks.size(), 1, columns_of(at, candidates));
    if (!at.values().allFinite() || !(at.base[kJ] > 0.0)) return false;
    if (averaged_)
        average(at, candidates, sums);
    else if (std::abs(at.base[kB]) * dt_max_s_ > kLargestRateDt * at.base[kJ] || !predict(at, candidates, sums))
        return false;
    for (BlockSum& b : sums) b.gram[0].triangularView<Eigen::StrictlyUpper>() = b.gram[0].transpose();
    return true;
}

void MechanicalModel::average(const Point& at, const std::vector<Input>* candidates, std::vector<BlockSum>& sums) const
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
                    if (candidates != nullptr) {
                        x[kB] += share * w[s];
                        add_inputs(at, *candidates, w[s], angle[s], share, x);
                    }
                    e += share * (torque[s] - at.base[kB] * w[s] - terms_torque(at, w[s], angle[s]));
                }
            const double slope = (w[k + length] - w[k]) / span_s(*fine.piece, k, length);
            if (n > 0) x[kJ] = slope;
            row << -x, e - at.base[kJ] * slope;
            sums[b].gram[0].selfadjointView<Eigen::Lower>().rankUpdate(row);
            sums[b].rows += 1.0;
        }
    }
}

bool MechanicalModel::predict(const Point& at, const std::vector<Input>* candidates, std::vector<BlockSum>& sums) const
{
    const double J = at.base[kJ], B = at.base[kB];
    const GainSchedule schedule(at.gain[0], B / J * dt_mean_s_);
    const Eigen::Index n = sums.front().gram[0].rows() - 1;
    Eigen::VectorXd s(n), x0(n), x1(n), row(n + 1);
    std::size_t block = 0;
    for (const Piece& piece : plan_.pieces) {
        const Log& log = *piece.log;
        const std::size_t number = static_cast<std::size_t>(&log - logs_.data());
        const std::vector<double>& torque = torque_[number];
        const auto angle = [&](std::size_t k) { return angle_.empty() ? 0.0 : angle_[number][k]; };
        s.setZero();
        double w = log.w_m_rad_s[piece.begin];
        const double even_s = piece.dt_s > 0.0 ? piece.dt_s : dt_mean_s_;
        Period p(J, B / J * even_s, even_s);
        while (block < sums.size() && plan_.blocks[block].piece != &piece) ++block;
        for (std::size_t k = piece.begin; k + 1 < piece.end; ++k) {
            const double dt = piece.period_s(k), z = B / J * dt;
            if (!(piece.dt_s > 0.0)) p = Period(J, z, dt);
            const double start = torque[k] - terms_torque(at, w, angle(k)), given = p.decay * w + p.start * start;
            double end = torque[k + 1] - terms_torque(at, w, angle(k + 1)), next = given + p.end * end;
            for (int i = 0; i < 2 && !at.terms.empty(); ++i) {
                end = torque[k + 1] - terms_torque(at, next, angle(k + 1));
                next = given + p.end * end;
            }
            if (!std::isfinite(next)) return false;
            if (n > 0) {
                x0.setZero(), x1.setZero();
                add_inputs(at, *candidates, w, angle(k), p.start, x0);
                add_inputs(at, *candidates, next, angle(k + 1), p.end, x1);
                const double by_z = -p.decay * w + p.start_by_z * start + p.end_by_z * end;
                s = p.decay * s - x0 - x1;
                s[kJ] -= (z * by_z + p.start * start + p.end * end) / J;
                s[kB] += dt / J * by_z;
            }
            const double e = log.w_m_rad_s[k + 1] - next;
            while (block < sums.size() && plan_.blocks[block].piece == &piece && k + 1 >= plan_.blocks[block].end)
                ++block;
            if (block < sums.size() && plan_.blocks[block].piece == &piece && k + 1 >= plan_.blocks[block].begin) {
                row << -s, e;
                sums[block].gram[0].selfadjointView<Eigen::Lower>().rankUpdate(row, weights_.square(k - piece.begin));
                sums[block].rows += 1.0;
            }
            const double gain = schedule.gain(k - piece.begin);
            s *= 1.0 - gain;
            if (n > 0) s[2] += schedule.slope(k - piece.begin) * e;
            w = next + gain * e;
        }
    }
    return true;
}

}  // namespace dqw
