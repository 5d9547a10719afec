// How much of an effect shows: what the plain model's best fit leaves of a log without noise.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "blind_effect.hpp"
#include "ref/log/piece.hpp"
#include "ref/log/symmetric.hpp"

namespace blind {
namespace {

/// Of the strengths asked for, after what the sizes can give.
constexpr double kLeast = 1.45;

double dot(const std::vector<double>& a, const std::vector<double>& b)
{
    double sum = 0;
    for (std::size_t k = 0; k < a.size(); ++k) sum += a[k] * b[k];
    return sum;
}

/// What the effects before, and this one of `size`, leave.
std::vector<double> rest_of(const Setup& s, const std::vector<Drawn>& before, const std::string& name, double size)
{
    dqw_sim_scenario x = s.scenario;
    for (const Drawn& e : before) apply(e.name, e.size, s, x);
    apply(name, size, s, x);
    return best_rest(log_of(s, x, false), truth_of(s));
}

}  // namespace

std::vector<double> residuals(const dqw::Log& log, const dqw::PlainModel& m, std::size_t rows)
{
    std::vector<double> d, q;
    if (log.regime == dqw::Regime::steady || log.regime == dqw::Regime::standstill) {
        for (std::size_t k = 0; k < log.rows(); ++k) {
            const double w = m.pole_pairs * log.w_m_rad_s[k];
            d.push_back(log.v_d_V[k] - m.R_ohm * log.i_d_A[k] + w * m.Lq_H * log.i_q_A[k]);
            q.push_back(log.v_q_V[k] - m.R_ohm * log.i_q_A[k] - w * (m.Ld_H * log.i_d_A[k] + m.psi_Wb));
        }
    } else {
        const bool mechanical = log.regime == dqw::Regime::mechanical;
        std::string unused;
        const auto torque = mechanical ? dqw::torque_of(log, m.torque_constant_Nm_A, unused) : std::vector<double>();
        for (const dqw::Piece& piece : dqw::pieces_of(log, 2)) {
            const std::size_t n = rows ? rows : dqw::block_rows(log);
            for (std::size_t k = piece.begin; k + n < piece.end; k += n) {
                double e_d = 0, e_q = 0;
                for (std::size_t r = k; r < k + n; ++r) {
                    if (mechanical)
                        e_d += 0.5 *
                               (torque[r] + torque[r + 1] - m.B_Nms_rad * (log.w_m_rad_s[r] + log.w_m_rad_s[r + 1])) *
                               piece.period_s(r);
                    else
                        dqw::add_period(log, m, r, piece.period_s(r), e_d, e_q);
                }
                const double span = dqw::span_s(piece, k, n);
                if (mechanical) {
                    d.push_back((e_d - m.J_kgm2 * (log.w_m_rad_s[k + n] - log.w_m_rad_s[k])) / span);
                } else {
                    d.push_back((e_d - m.Ld_H * (log.i_d_A[k + n] - log.i_d_A[k])) / span);
                    q.push_back((e_q - m.Lq_H * (log.i_q_A[k + n] - log.i_q_A[k])) / span);
                }
            }
        }
    }
    d.insert(d.end(), q.begin(), q.end());
    return d;
}

std::vector<double dqw::PlainModel::*> fields_of(dqw::Regime regime)
{
    if (regime == dqw::Regime::mechanical) return {&dqw::PlainModel::J_kgm2, &dqw::PlainModel::B_Nms_rad};
    if (regime == dqw::Regime::standstill) return {&dqw::PlainModel::R_ohm};
    return {&dqw::PlainModel::R_ohm, &dqw::PlainModel::Ld_H, &dqw::PlainModel::Lq_H, &dqw::PlainModel::psi_Wb};
}

std::vector<double> best_rest(const dqw::Log& log, const dqw::PlainModel& truth)
{
    const auto fields = fields_of(log.regime);
    dqw::PlainModel m = truth;
    std::vector<double> e = residuals(log, m);
    // Linear but for a small correction of the trapezoid: the second pass is for that.
    for (int pass = 0; pass < 2; ++pass) {
        Eigen::MatrixXd slope(e.size(), fields.size());
        const Eigen::VectorXd at = Eigen::Map<Eigen::VectorXd>(e.data(), static_cast<Eigen::Index>(e.size()));
        for (std::size_t f = 0; f < fields.size(); ++f) {
            dqw::PlainModel moved = m;
            const double step = 1e-3 * std::abs(truth.*fields[f]);
            moved.*fields[f] += step;
            std::vector<double> there = residuals(log, moved);
            slope.col(static_cast<Eigen::Index>(f)) = (Eigen::Map<Eigen::VectorXd>(there.data(), at.size()) - at) /
                                                      step;
        }
        const Eigen::VectorXd scale = slope.colwise().norm().cwiseMax(1e-300);
        const Eigen::VectorXd change =
            dqw::least_squares(slope * scale.cwiseInverse().asDiagonal(), -at).cwiseQuotient(scale);
        for (std::size_t f = 0; f < fields.size(); ++f) m.*fields[f] += change(static_cast<Eigen::Index>(f));
        e = residuals(log, m);
    }
    return e;
}

double rms(const std::vector<double>& x)
{
    return x.empty() ? 0.0 : std::sqrt(dot(x, x) / static_cast<double>(x.size()));
}

bool calibrate(const Setup& s, double floor, std::vector<Drawn>& effects)
{
    std::vector<Drawn> sized;
    std::vector<double> before;
    for (Drawn& e : effects) {
        const double most = most_of(e.name, s), target = floor * std::sqrt(e.strength * e.strength - 1);
        std::vector<double> own;
        // Cross-saturation comes with saturation, which shows by itself.
        if (e.name == "cross_saturation") before = rest_of(s, sized, e.name, 0.0);
        e.size = 0.1 * most;
        for (int pass = 0; pass < 4; ++pass) {
            own = rest_of(s, sized, e.name, e.size);
            for (std::size_t k = 0; k < before.size(); ++k) own[k] -= before[k];
            const double left = rms(own);
            if (std::abs(left / target - 1) < 0.15 || (left < target && e.size >= most)) break;
            if (pass < 3) e.size = std::min(most, e.size * std::clamp(target / std::max(left, 1e-12), 0.02, 10.0));
        }
        double seen = rms(own);
        if (!sized.empty()) {
            const double like = dot(own, before) / std::sqrt(dot(own, own) * dot(before, before));
            if (!(std::abs(like) < 0.9)) return false;
            const double apart = std::sqrt(1 - like * like);
            seen *= apart;
            sized[0].strength = effects[0].strength = std::hypot(1.0, apart * rms(before) / floor);
            if (effects[0].strength < kLeast) return false;
        }
        e.strength = std::hypot(1.0, seen / floor);
        if (!(e.strength >= kLeast)) return false;
        if (before.empty()) before = own;
        sized.push_back(e);
    }
    return true;
}

}  // namespace blind
