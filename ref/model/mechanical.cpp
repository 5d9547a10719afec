#include "ref/model/mechanical.hpp"

#include <algorithm>
#include <cmath>

#include "ref/model/jets.hpp"
#include "ref/model/sums.hpp"

namespace dqw {
namespace {

/// One period: w_{k+1} = decay w_k + start T_k + end T_{k+1}, z = B dt / J:
///   decay = e^-z, start = dt/J (f1 - f2), end = dt/J f2, f1 = sum (-z)^n/(n+1)!, f2 = sum (-z)^n/(n+2)!
template <typename T> struct Period {
    T decay, start, end;
    Period(const T& inertia, const T& friction, double dt)
    {
        using std::exp;
        const T z = friction / inertia * dt;
        T f1(0.0), f2(0.0), power(1.0);
        double factorial = 1.0;
        for (int n = 0; n < 40; ++n) {
            f1 += power / factorial;
            f2 += power / (factorial * (n + 2));
            power *= -z;
            factorial *= n + 2;
        }
        decay = exp(-z);
        start = dt / inertia * (f1 - f2);
        end = dt / inertia * f2;
    }
};

}  // namespace

MechanicalModel::MechanicalModel(std::vector<Piece> pieces, const std::vector<Log>& logs,
                                 const std::vector<std::vector<double>>& torque)
    : pieces_(std::move(pieces)), logs_(logs), torque_(torque), power_(Eigen::VectorXd::Zero(1))
{
    double time_s = 0.0;
    for (const Piece& piece : pieces_) {
        rows_ += piece.rows() - 1;
        for (std::size_t k = piece.begin; k < piece.end; ++k) {
            power_[0] += piece.log->w_m_rad_s[k] * piece.log->w_m_rad_s[k];
            if (k + 1 < piece.end) dt_max_s_ = std::max(dt_max_s_, piece.period_s(k));
        }
        time_s += piece.log->t_s[piece.end - 1] - piece.log->t_s[piece.begin];
    }
    if (rows_ > 0) dt_mean_s_ = time_s / static_cast<double>(rows_);
}

const std::vector<std::string>& MechanicalModel::names() const
{
    static const std::vector<std::string> names{"J_kgm2", "B_Nms_rad", ""};
    return names;
}

void MechanicalModel::prepare(const Eigen::VectorXd& theta)
{
    decay_ = std::exp(-std::clamp(theta[kB] / theta[kJ] * dt_mean_s_, 1e-9, 5.0));
    reference_ = gain_schedule(theta[kGain], decay_);
}

void MechanicalModel::confine(Eigen::VectorXd& theta, const std::vector<bool>& free, bool wake) const
{
    if (free[kGain]) theta[kGain] = confined_gain(theta[kGain], wake);
}

bool MechanicalModel::at_bound(const Eigen::VectorXd& theta, int j) const
{
    return j == kGain && (theta[j] <= 0.0 || theta[j] >= 1.0);
}

bool MechanicalModel::in_domain(const Eigen::VectorXd& theta) const
{
    return theta.allFinite() && theta[kJ] > 0.0 && std::abs(theta[kB]) * dt_max_s_ < 5.0 * theta[kJ];
}

const std::vector<double>& MechanicalModel::torque_of_piece(const Piece& piece) const
{
    return torque_[static_cast<std::size_t>(piece.log - logs_.data())];
}

template <typename T, typename Visit> bool MechanicalModel::run(const T* theta, Visit&& visit) const
{
    const T gain = on_unit(theta[kGain]);
    const GainSchedule schedule = gain_schedule(value_of(gain), decay_);
    const T shift = gain - value_of(gain);
    for (const Piece& piece : pieces_) {
        const std::vector<double>& torque = torque_of_piece(piece);
        const std::vector<double>& speed = piece.log->w_m_rad_s;
        Period<T> period(theta[kJ], theta[kB], piece.dt_s > 0.0 ? piece.dt_s : dt_mean_s_);
        T w(speed[piece.begin]);
        for (std::size_t k = piece.begin; k + 1 < piece.end; ++k) {
            if (!(piece.dt_s > 0.0)) period = Period<T>(theta[kJ], theta[kB], piece.period_s(k));
            w = period.decay * w + period.start * torque[k] + period.end * torque[k + 1];
            const T e = speed[k + 1] - w;
            const std::size_t n = k - piece.begin;
            visit(e, reference_.weight_at(n, count_starts_));
            if (n < schedule.gain.size())
                w += (schedule.derivative[n] * shift + schedule.gain[n]) * e;
            else
                w += gain * e;
        }
        if (!std::isfinite(value_of(w))) return false;
    }
    return true;
}

bool MechanicalModel::sweep(const Eigen::VectorXd& theta, int blocks, Sums& sums) const
{
    using Jet = ceres::Jet<double, kSize>;
    sums.reset(kSize, 1, blocks);
    if (!in_domain(theta)) return false;
    const Jet jets[kSize] = {Jet(theta[0], 0), Jet(theta[1], 1), Jet(theta[2], 2)};
    Collector<kSize, 1> collector(sums, rows_);
    const bool done = run<Jet>(jets, [&](const Jet& e, double weight) { collector.add({e}, {weight}); });
    collector.finish();
    return done;
}

bool MechanicalModel::squares(const Eigen::VectorXd& theta, Eigen::VectorXd& sum) const
{
    sum.setZero(1);
    if (!in_domain(theta)) return false;
    double s = 0.0;
    const bool done = run<double>(theta.data(), [&](double e, double weight) { s += weight * e * weight * e; });
    sum[0] = s;
    return done && std::isfinite(s);
}

}  // namespace dqw
