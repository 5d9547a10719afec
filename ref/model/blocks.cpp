#include "ref/model/blocks.hpp"

#include <algorithm>
#include <cmath>

#include "ref/log/symmetric.hpp"
#include "ref/log/wanted.hpp"

namespace dqw {
namespace {

constexpr double kLeastEigenvalue = 1e-10;  ///< of unit columns: below, 10^6 rows leave their rounding alone
constexpr int kMostPolePairs = 64;          ///< that are tried

/// Normal equations of a linear regression: A theta = b, with the sum of squared targets.
struct Normal {
    Eigen::MatrixXd a;
    Eigen::VectorXd b;
    double yy = 0.0;
    explicit Normal(Eigen::Index n) : a(Eigen::MatrixXd::Zero(n, n)), b(Eigen::VectorXd::Zero(n)) {}
    void add(const Eigen::VectorXd& x, double y)
    {
        a += x * x.transpose();
        b += x * y;
        yy += y * y;
    }
    /// theta = T z; the least-squares z of least norm in unit columns, and what it leaves of yy.
    Eigen::VectorXd solve(const Eigen::MatrixXd& t, double& left) const
    {
        const Eigen::MatrixXd m = t.transpose() * a * t;
        const Eigen::VectorXd rhs = t.transpose() * b;
        const Eigen::VectorXd scale = m.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
        const Symmetric eigen(scale.asDiagonal() * m * scale.asDiagonal());
        Eigen::VectorXd z = Eigen::VectorXd::Zero(m.rows());
        for (Eigen::Index k = 0; k < m.rows(); ++k) {
            const Eigen::VectorXd v = eigen.eigenvectors().col(k);
            if (eigen.eigenvalues()[k] > kLeastEigenvalue)
                z += v * (v.dot(scale.cwiseProduct(rhs)) / eigen.eigenvalues()[k]);
        }
        z = scale.cwiseProduct(z);
        left = yy - 2.0 * z.dot(rhs) + z.dot(m * z);
        return z;
    }
};

double rms(const std::vector<Piece>& pieces, std::vector<double> Log::*column)
{
    double sum = 0.0;
    for (const Piece& p : pieces)
        for (std::size_t k = p.begin; k < p.end; ++k) sum += (p.log->*column)[k] * (p.log->*column)[k];
    return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(rows_of(pieces), 1)));
}

/// theta6 = (R, Ld, Lq, p Lq, p Ld, p psi) from (R, Ld, Lq, psi).
Eigen::MatrixXd tied(double p)
{
    Eigen::MatrixXd t = Eigen::MatrixXd::Zero(6, 4);
    t(0, 0) = t(1, 1) = t(2, 2) = 1.0;
    t(3, 2) = t(4, 1) = t(5, 3) = p;
    return t;
}

Normal electrical_normal(const std::vector<Piece>& pieces, std::size_t length)
{
    Normal normal(6);
    Eigen::VectorXd d(6), q(6);
    for (const Piece& piece : pieces)
        for (std::size_t k = piece.begin; k + length < piece.end; k += length) {
            const Block s = block_at(piece, k, length);
            d << s.i_d, s.di_d, 0.0, -s.wi_q, 0.0, 0.0;
            q << s.i_q, 0.0, s.di_q, 0.0, s.wi_d, s.w;
            normal.add(d, s.v_d);
            normal.add(q, s.v_q);
        }
    return normal;
}

}  // namespace

Block block_at(const Piece& piece, std::size_t k, std::size_t n)
{
    ask_at(k, n);
    const Log& log = *piece.log;
    const double share = 1.0 / static_cast<double>(n);
    Block s;
    for (std::size_t r = k; r <= k + n; ++r) {
        const double part = r == k || r == k + n ? 0.5 * share : share;
        s.i_d += part * log.i_d_A[r];
        s.i_q += part * log.i_q_A[r];
        s.w += part * log.w_m_rad_s[r];
        s.wi_d += part * log.w_m_rad_s[r] * log.i_d_A[r];
        s.wi_q += part * log.w_m_rad_s[r] * log.i_q_A[r];
        if (r == k + n) break;
        s.v_d += share * log.v_d_V[r];
        s.v_q += share * log.v_q_V[r];
    }
    s.time_s = span_s(piece, k, n);
    s.di_d = (log.i_d_A[k + n] - log.i_d_A[k]) / s.time_s;
    s.di_q = (log.i_q_A[k + n] - log.i_q_A[k]) / s.time_s;
    return s;
}

MotionBlock motion_block_at(const Piece& piece, const std::vector<double>& torque, std::size_t k, std::size_t n)
{
    const auto& w = piece.log->w_m_rad_s;
    const double share = 0.5 / static_cast<double>(n);
    MotionBlock s;
    for (std::size_t r = k; r < k + n; ++r)
        s.w += share * (w[r] + w[r + 1]), s.torque += share * (torque[r] + torque[r + 1]);
    s.dw = (w[k + n] - w[k]) / span_s(piece, k, n);
    return s;
}

std::vector<ElectricalStart> electrical_starts(const std::vector<Piece>& pieces, std::optional<double> pole_pairs)
{
    const double v = std::hypot(rms(pieces, &Log::v_d_V), rms(pieces, &Log::v_q_V));
    const double i = std::hypot(rms(pieces, &Log::i_d_A), rms(pieces, &Log::i_q_A));
    const double ohm = v > 0.0 && i > 0.0 ? v / i : 1.0;
    const auto positive = [ohm](ElectricalStart s) {
        // Of a machine that turns, R takes some percent of the voltage; L/R of servos and traction is 1 to 20 ms.
        constexpr double kTimeConstant_s = 5e-3, kLeastPart = 1e-4, kUsualPart = 0.03;
        if (!(s.R_ohm > kLeastPart * ohm)) s.R_ohm = kUsualPart * ohm;
        if (!(s.Ld_H > 0.0)) s.Ld_H = s.Lq_H > 0.0 ? s.Lq_H : s.R_ohm * kTimeConstant_s;
        if (!(s.Lq_H > 0.0)) s.Lq_H = s.Ld_H;
        return s;
    };
    std::vector<ElectricalStart> starts;
    // Short for a fast machine, long for a noisy log: which is best, the fit says.
    for (const std::size_t length : {10, 20, 50, 100, 200, 500}) {
        const Normal normal = electrical_normal(pieces, length);
        double left = 0.0, least = 0.0;
        double p = pole_pairs.value_or(1.0);
        Eigen::VectorXd best = normal.solve(tied(p), least);
        for (int n = 2; !pole_pairs && n <= kMostPolePairs; ++n) {
            const Eigen::VectorXd z = normal.solve(tied(n), left);
            if (left < least) best = z, least = left, p = n;
        }
        if (normal.yy > 0.0) starts.push_back(positive({best[0], best[1], best[2], best[3], p}));
    }
    if (starts.empty()) starts.push_back(positive({0.0, 0.0, 0.0, 0.0, pole_pairs.value_or(1.0)}));
    return starts;
}

std::vector<MechanicalStart> mechanical_starts(const std::vector<Piece>& pieces,
                                               const std::vector<const std::vector<double>*>& torque)
{
    std::vector<MechanicalStart> starts;
    for (const std::size_t length : {20, 50, 200, 1000}) {
        Normal normal(2);
        for (std::size_t i = 0; i < pieces.size(); ++i) {
            const Piece& piece = pieces[i];
            for (std::size_t k = piece.begin; k + length < piece.end; k += length) {
                const MotionBlock b = motion_block_at(piece, *torque[i], k, length);
                normal.add(Eigen::Vector2d(b.dw, b.w), b.torque);
            }
        }
        double left = 0.0;
        const Eigen::VectorXd z = normal.solve(Eigen::MatrixXd::Identity(2, 2), left);
        if (normal.yy > 0.0 && z[0] > 0.0) starts.push_back({z[0], std::max(z[1], 0.0)});
    }
    // A small servo's: the fit finds any from it.
    constexpr double kServo_kgm2 = 1e-4;
    if (starts.empty()) starts.push_back({kServo_kgm2, 0.0});
    return starts;
}

}  // namespace dqw
