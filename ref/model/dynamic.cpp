#include "ref/model/dynamic.hpp"

#include <algorithm>
#include <cmath>

#include "ref/model/jets.hpp"
#include "ref/model/period.hpp"
#include "ref/model/sums.hpp"

namespace dqw {
namespace {

constexpr double kLargestRateDt = 15.0;  ///< (R/L + w_e) dt beyond which a log says nothing about L

}  // namespace

DynamicModel::DynamicModel(std::vector<Piece> pieces, bool free_pole_pairs)
    : pieces_(std::move(pieces)), free_pole_pairs_(free_pole_pairs), power_(Eigen::VectorXd::Zero(2))
{
    double time_s = 0.0;
    for (const Piece& piece : pieces_) {
        const Log& log = *piece.log;
        rows_ += piece.rows() - 1;
        for (std::size_t k = piece.begin; k < piece.end; ++k) {
            power_[0] += log.i_d_A[k] * log.i_d_A[k];
            power_[1] += log.i_q_A[k] * log.i_q_A[k];
            w_max_rad_s_ = std::max(w_max_rad_s_, std::abs(log.w_m_rad_s[k]));
            if (k + 1 < piece.end) dt_max_s_ = std::max(dt_max_s_, piece.period_s(k));
        }
        time_s += log.t_s[piece.end - 1] - log.t_s[piece.begin];
    }
    if (rows_ > 0) dt_mean_s_ = time_s / static_cast<double>(rows_);
}

const std::vector<std::string>& DynamicModel::names() const
{
    static const std::vector<std::string> names{"R_ohm", "Ld_H", "Lq_H", "psi_Wb", "", "", "pole_pairs"};
    return names;
}

void DynamicModel::prepare(const Eigen::VectorXd& theta)
{
    for (int axis = 0; axis < 2; ++axis) {
        decay_[axis] = std::exp(-std::clamp(theta[kR] / theta[kLd + axis] * dt_mean_s_, 1e-6, 5.0));
        reference_[axis] = gain_schedule(theta[kGainD + axis], decay_[axis]);
    }
}

void DynamicModel::confine(Eigen::VectorXd& theta, const std::vector<bool>& free, bool wake) const
{
    for (int j : {kGainD, kGainQ})
        if (free[static_cast<std::size_t>(j)]) theta[j] = confined_gain(theta[j], wake);
}

bool DynamicModel::at_bound(const Eigen::VectorXd& theta, int j) const
{
    return (j == kGainD || j == kGainQ) && (theta[j] <= 0.0 || theta[j] >= 1.0);
}

bool DynamicModel::in_domain(const Eigen::VectorXd& theta) const
{
    const double l_min = std::min(theta[kLd], theta[kLq]);
    if (!theta.allFinite() || !(l_min > 0.0)) return false;
    const double rate = std::abs(theta[kR]) / l_min + std::abs(theta[kPolePairs]) * w_max_rad_s_;
    // A negative resistance grows by e^(-R dt / L) a row: fine for a step of the search, not for a whole log.
    return rate * dt_max_s_ <= kLargestRateDt;
}

template <typename T, typename W, typename Visit>
bool DynamicModel::run(const T* theta, const W& pole_pairs, Visit&& visit) const
{
    const T &ld = theta[kLd], &lq = theta[kLq], &psi = theta[kPsi];
    const T a = theta[kR] / ld, b = theta[kR] / lq;
    const T inv_ld = 1.0 / ld, inv_lq = 1.0 / lq;
    const T g_d = on_unit(theta[kGainD]), g_q = on_unit(theta[kGainQ]);
    const GainSchedule s_d = gain_schedule(value_of(g_d), decay_[0]), s_q = gain_schedule(value_of(g_q), decay_[1]);
    const T shift_d = g_d - value_of(g_d), shift_q = g_q - value_of(g_q);
    const int order = series_order(
        (std::max(std::abs(value_of(a)), std::abs(value_of(b))) + std::abs(value_of(pole_pairs)) * w_max_rad_s_) *
        dt_max_s_);
    const auto gain_at = [](const GainSchedule& s, const T& shift, const T& steady, std::size_t n) -> T {
        return n < s.gain.size() ? s.derivative[n] * shift + s.gain[n] : steady;
    };
    for (const Piece& piece : pieces_) {
        const Log& log = *piece.log;
        T x_d = ld * log.i_d_A[piece.begin], x_q = lq * log.i_q_A[piece.begin];
        T a_dt = a * piece.dt_s, b_dt = b * piece.dt_s;
        for (std::size_t k = piece.begin; k + 1 < piece.end; ++k) {
            const double dt = piece.period_s(k);
            if (!(piece.dt_s > 0.0)) a_dt = a * dt, b_dt = b * dt;
            const W w_dt = pole_pairs * (0.5 * (log.w_m_rad_s[k] + log.w_m_rad_s[k + 1]) * dt);
            advance_flux(x_d, x_q, a_dt, b_dt, psi, w_dt, log.v_d_V[k], log.v_q_V[k], dt, order);
            const T e_d = log.i_d_A[k + 1] - x_d * inv_ld, e_q = log.i_q_A[k + 1] - x_q * inv_lq;
            const std::size_t n = k - piece.begin;
            visit(e_d, e_q, reference_[0].weight_at(n, count_starts_), reference_[1].weight_at(n, count_starts_));
            x_d += ld * (gain_at(s_d, shift_d, g_d, n) * e_d);
            x_q += lq * (gain_at(s_q, shift_q, g_q, n) * e_q);
        }
        if (!std::isfinite(value_of(x_d)) || !std::isfinite(value_of(x_q))) return false;
    }
    return true;
}

template <int N> bool DynamicModel::sweep_jets(const Eigen::VectorXd& theta, Sums& sums) const
{
    using T = ceres::Jet<double, N>;
    T jets[kSize];
    for (int j = 0; j < kSize; ++j) jets[j] = j < N ? T(theta[j], j) : T(theta[j]);
    Collector<N, 2> collector(sums, rows_);
    const auto visit = [&](const T& e_d, const T& e_q, double w_d, double w_q) {
        collector.add({e_d, e_q}, {w_d, w_q});
    };
    bool done = false;
    if constexpr (N == kSize)
        done = run<T, T>(jets, jets[kPolePairs], visit);
    else
        done = run<T, double>(jets, theta[kPolePairs], visit);
    collector.finish();
    return done;
}

bool DynamicModel::sweep(const Eigen::VectorXd& theta, int blocks, Sums& sums) const
{
    sums.reset(kSize, 2, blocks);
    if (!in_domain(theta)) return false;
    return free_pole_pairs_ ? sweep_jets<kSize>(theta, sums) : sweep_jets<kSize - 1>(theta, sums);
}

bool DynamicModel::squares(const Eigen::VectorXd& theta, Eigen::VectorXd& sum) const
{
    sum.setZero(2);
    if (!in_domain(theta)) return false;
    double s_d = 0.0, s_q = 0.0;
    const auto visit = [&](double e_d, double e_q, double w_d, double w_q) {
        s_d += w_d * e_d * w_d * e_d;
        s_q += w_q * e_q * w_q * e_q;
    };
    const bool done = run<double, double>(theta.data(), theta[kPolePairs], visit);
    sum << s_d, s_q;
    return done && sum.allFinite();
}

}  // namespace dqw
