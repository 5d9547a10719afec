#include "ref/model/mechanical.hpp"

#include <algorithm>
#include <cmath>

#include "ref/log/wanted.hpp"
#include "ref/model/gather.hpp"
#include "ref/model/hat.hpp"

namespace dqw {
namespace {

enum Index { kJ, kB };

constexpr double kLargestRateDt = 5.0;  ///< B dt / J beyond which a log says nothing about J
constexpr int kTerms = 40;              ///< of a series in it: 5^40/40! = 1e-20
constexpr int kIterations = 3;          ///< of the implicit end of a period, (E48)
constexpr double kShapeStep = 1e-3;     ///< of a shape, for a difference: it bends by as much, and rounds to 1e-13

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
    double start_by_z, end_by_z, start_by_J, end_by_J, z_by_J, z_by_B;

    Period(double J, double B, double dt)
    {
        const double z = B * dt / J;
        // Of f1, f2 and their slopes by -z.
        double f1 = 0.0, f2 = 0.0, f1_slope = 0.0, f2_slope = 0.0, power = 1.0, last = 0.0, factorial = 1.0;
        for (int n = 0; n < kTerms; ++n) {
            f1 += power / factorial, f2 += power / (factorial * (n + 2));
            f1_slope += n * last / factorial, f2_slope += n * last / (factorial * (n + 2));
            last = power, power *= -z, factorial *= n + 2;
        }
        decay = std::exp(-z), start = dt / J * (f1 - f2), end = dt / J * f2;
        start_by_z = -dt / J * (f1_slope - f2_slope), end_by_z = -dt / J * f2_slope;
        start_by_J = start / J, end_by_J = end / J, z_by_J = -z / J, z_by_B = dt / J;
    }
};

/// Adds what one unit of each effect's weight takes of the torque at speed `w`, times `part`.
void add_inputs(const Point& at, const std::vector<Input>& candidates, double w, double theta, double part,
                Eigen::Ref<Eigen::VectorXd> x)
{
    double torque[kMostWeights];
    Eigen::Index j = 0;
    const auto put = [&](const Input& input) {
        evaluate_torque(input, w, theta, torque);
        for (int i = 0; i < weights_of(input.law); ++i) x[j++] += part * torque[i];
    };
    for (const Term& t : at.terms) {
        put(t.input);
        const double here = term_torque(t, w, theta);
        for (int i = 0; i < free_shapes_of(t.input); ++i) {
            Term moved = t;
            const double step = kShapeStep * t.input.shape[static_cast<std::size_t>(i)];
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
                                 const std::vector<std::vector<double>>& angle, Plan plan, double hat_half_s)
    : logs_(logs), torque_(torque), angle_(angle), plan_(std::move(plan)), hat_half_s_(hat_half_s)
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
        const auto number = static_cast<std::size_t>(&log - logs_.data());
        const auto &torque = torque_[number], &w = log.w_m_rad_s;
        const std::size_t n = rows > 0 ? rows : block_rows(log);
        for (const Piece& piece : pieces_of(log, 2))
            for (std::size_t k = piece.begin; k + n < piece.end; k += n) {
                ReportBlock b{&log, k, k + n, {}, {}};
                const double time_s = span_s(piece, k, n);
                const auto less = [&](std::size_t r) {
                    return torque[r] - at.base[kB] * w[r] -
                           (at.terms.empty() ? 0.0 : terms_torque(at, w[r], angle_[number][r]));
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
    if (hat_half_s_ > 0.0)
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
        const auto number = static_cast<std::size_t>(&log - logs_.data());
        const auto &torque = torque_[number], &angle = angle_[number], &w = log.w_m_rad_s;
        each_hat(*fine.piece, fine.begin, std::min(fine.end + 1, fine.piece->end), hat_rows(log, hat_half_s_),
                 [&](std::size_t k, const Hat& hat) {
                     const double slope = hat.slope_of(&w[k]);
                     double e = hat.mean_of(&torque[k]) - at.base[kB] * hat.mean_of(&w[k]) - at.base[kJ] * slope;
                     if (!at.terms.empty())
                         for (std::size_t r = 0; r < hat.mean.size(); ++r)
                             e -= hat.mean[r] * terms_torque(at, w[k + r], angle[k + r]);
                     if (n > 0) {
                         x.setZero();
                         x[kJ] = slope, x[kB] = hat.mean_of(&w[k]);
                         for (std::size_t r = 0; r < hat.mean.size() && n > 2; ++r)
                             add_inputs(at, *candidates, w[k + r], angle[k + r], hat.mean[r], x.tail(n - 2));
                     }
                     row << -x, e;
                     sums[b].gram[0].selfadjointView<Eigen::Lower>().rankUpdate(row);
                     sums[b].rows += 1.0;
                 });
    }
}

/// Prediction along one piece. Derivatives of the speed: by J, B and the gain, then by the effects' weights and shapes.
struct MechanicalModel::Run {
    const MechanicalModel& model;
    const Point& at;
    const std::vector<Input>* candidates;
    const GainSchedule& schedule;
    const Piece& piece;
    const std::vector<double>&speed, &torque;
    const std::vector<double>* angle;
    double by_J = 0.0, by_B = 0.0, by_gain = 0.0;
    Eigen::VectorXd x, by_input;

    double angle_at(std::size_t k) const { return angle == nullptr ? 0.0 : (*angle)[k]; }

    /// The speed at row k + 1 from w at row k, and its derivatives.
    double step(const Period& p, std::size_t k, double w)
    {
        double start = torque[k], end = torque[k + 1];
        if (!at.terms.empty()) {
            start -= terms_torque(at, w, angle_at(k));
            double ahead = w;
            for (int i = 0; i < kIterations; ++i) {
                end = torque[k + 1] - terms_torque(at, ahead, angle_at(k + 1));
                ahead = p.decay * w + p.start * start + p.end * end;
            }
        }
        const double next = p.decay * w + p.start * start + p.end * end;
        if (candidates == nullptr) return next;
        const double by_z = p.start_by_z * start + p.end_by_z * end - p.decay * w;
        by_J = p.decay * by_J + p.z_by_J * by_z - p.start_by_J * start - p.end_by_J * end;
        by_B = p.decay * by_B + p.z_by_B * by_z, by_gain *= p.decay;
        if (by_input.size() == 0) return next;
        x.setZero();
        add_inputs(at, *candidates, w, angle_at(k), p.start, x);
        add_inputs(at, *candidates, next, angle_at(k + 1), p.end, x);
        by_input = p.decay * by_input - x;
        return next;
    }

    void count(Gather& gather, std::size_t n, double e) const
    {
        const double weight = model.weights_.at(n);
        double* line = gather.line(0);
        if (candidates != nullptr) {
            line[0] = -weight * by_J, line[1] = -weight * by_B, line[2] = -weight * by_gain;
            for (Eigen::Index j = 0; j < by_input.size(); ++j) line[3 + j] = -weight * by_input[j];
            line += 3 + by_input.size();
        }
        *line = weight * e;
        gather.next();
    }

    void correct(std::size_t n, double gain, double e)
    {
        by_J *= 1.0 - gain, by_B *= 1.0 - gain;
        by_gain = (1.0 - gain) * by_gain + schedule.slope(n) * e;
        if (by_input.size() > 0) by_input *= 1.0 - gain;
    }

    bool run(Gather& gather)
    {
        const double J = at.base[kJ], B = at.base[kB];
        double w = speed[piece.begin];
        Period p(J, B, piece.dt_s > 0.0 ? piece.dt_s : model.dt_mean_s_);
        for (std::size_t k = piece.begin; k + 1 < piece.end; ++k) {
            ask_at(k);
            if (!(piece.dt_s > 0.0)) p = Period(J, B, piece.period_s(k));
            w = step(p, k, w);
            if (!std::isfinite(w)) return false;
            const std::size_t n = k - piece.begin;
            const double e = speed[k + 1] - w, gain = schedule.gain(n);
            if (gather.counts(k + 1)) count(gather, n, e);
            if (candidates != nullptr) correct(n, gain, e);
            w += gain * e;
        }
        gather.flush();
        return true;
    }
};

bool MechanicalModel::predict(const Point& at, const std::vector<Input>* candidates, std::vector<BlockSum>& sums) const
{
    const GainSchedule schedule(at.gain[0], at.base[kB] / at.base[kJ] * dt_mean_s_);
    const Eigen::VectorXd inputs = Eigen::VectorXd::Zero(candidates == nullptr ? 0 : columns_of(at, candidates) - 3);
    for (const Span& span : spans_of(plan_)) {
        const Piece& piece = *span.piece;
        const auto number = static_cast<std::size_t>(piece.log - logs_.data());
        Gather gather(plan_, span, 1, sums);
        Run run{*this,
                at,
                candidates,
                schedule,
                piece,
                piece.log->w_m_rad_s,
                torque_[number],
                angle_.empty() ? nullptr : &angle_[number],
                0.0,
                0.0,
                0.0,
                inputs,
                inputs};
        if (!run.run(gather)) return false;
    }
    return true;
}

}  // namespace dqw
