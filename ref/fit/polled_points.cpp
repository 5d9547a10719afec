#include "ref/fit/polled_points.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "ref/fit/polled_logs.hpp"
#include "ref/log/symmetric.hpp"

namespace dqw {
namespace {

constexpr double kLook_s[] = {0.5, 1, 2, 5, 10, 20, 60, 120, 300};
constexpr double kSame = 0.03;   // of the largest current, or speed: one operating point
constexpr double kBroken = 3.0;  // of the usual step
constexpr double kWhite = 2.16;  // sqrt(14/3)

using Column = std::vector<double> Log::*;
constexpr Column kMeans[] = {&Log::t_s,       &Log::v_d_V,  &Log::v_q_V,          &Log::i_d_A,        &Log::i_q_A,
                             &Log::w_m_rad_s, &Log::v_dc_V, &Log::temp_winding_C, &Log::temp_magnet_C};

double largest(const std::vector<Log>& logs, Column column)
{
    double most = 0.0;
    for (const Log& log : logs)
        for (const double x : log.*column) most = std::max(most, std::abs(x));
    return most;
}

/// Rows that follow one another at one operating point, for `most_s` at most, are one.
Log averaged(const Log& log, double step_s, double most_s, double i_A, double w_rad_s)
{
    Log out = log;
    for (const Column c : kMeans) (out.*c).clear();
    for (std::size_t k = 0, end; k < log.rows(); k = end) {
        const auto near = [&](Column c, double base) { return std::abs((log.*c)[end] - (log.*c)[k]) <= kSame * base; };
        for (end = k + 1; end < log.rows(); ++end)
            if (log.t_s[end] - log.t_s[end - 1] > kBroken * step_s || log.t_s[end] - log.t_s[k] > most_s ||
                !near(&Log::i_d_A, i_A) || !near(&Log::i_q_A, i_A) || !near(&Log::w_m_rad_s, w_rad_s))
                break;
        for (const Column c : kMeans) {
            if ((log.*c).empty()) continue;
            double sum = 0.0;
            for (std::size_t j = k; j < end; ++j) sum += (log.*c)[j];
            (out.*c).push_back(sum / static_cast<double>(end - k));
        }
    }
    return out;
}

/// What the plain model leaves of each look, d and q.
std::vector<Eigen::MatrixX2d> left_of(const std::vector<Log>& logs)
{
    Eigen::Matrix4d a = Eigen::Matrix4d::Identity() * 1e-12;
    Eigen::Vector4d b = Eigen::Vector4d::Zero();
    const auto rows = [](const Log& log, std::size_t k) {
        Eigen::Matrix<double, 2, 4> x;
        const double w = log.w_m_rad_s[k], d = log.i_d_A[k], q = log.i_q_A[k];
        x << d, 0.0, -w * q, 0.0, q, w * d, 0.0, w;
        return x;
    };
    for (const Log& log : logs)
        for (std::size_t k = 0; k < log.rows(); ++k) {
            const auto x = rows(log, k);
            a += x.transpose() * x, b += x.transpose() * Eigen::Vector2d(log.v_d_V[k], log.v_q_V[k]);
        }
    const Eigen::Vector4d size = a.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::Vector4d weights = size.asDiagonal() *
                                    least_squares(size.asDiagonal() * a * size.asDiagonal(), size.asDiagonal() * b);
    std::vector<Eigen::MatrixX2d> out;
    for (const Log& log : logs) {
        Eigen::MatrixX2d e(static_cast<Eigen::Index>(log.rows()), 2);
        for (std::size_t k = 0; k < log.rows(); ++k)
            e.row(static_cast<Eigen::Index>(
                k)) = (Eigen::Vector2d(log.v_d_V[k], log.v_q_V[k]) - rows(log, k) * weights).transpose();
        out.push_back(e);
    }
    return out;
}

/// Second differences of next neighbours are those of neighbours but one, where none shares its error with another;
/// what drifts slowly is in neither.
bool are_white(const std::vector<Log>& looks)
{
    double near = 0.0, far = 0.0, count = 0.0;
    for (const Eigen::MatrixX2d& e : left_of(looks))
        for (Eigen::Index k = 2; k + 2 < e.rows(); ++k) {
            near += (e.row(k - 1) - 2.0 * e.row(k) + e.row(k + 1)).squaredNorm();
            far += (e.row(k - 2) - 2.0 * e.row(k) + e.row(k + 2)).squaredNorm();
            count += 1.0;
        }
    // Of white errors the two differ by that part over sqrt(n), one deviation, where one axis has them all.
    return count > 0.0 && near > (1.0 - kWhite / std::sqrt(count)) * far;
}

}  // namespace

PolledPoints polled_points(const std::vector<Log>& logs)
{
    const std::vector<Log> settled = settled_logs(logs);
    const double i_A = std::hypot(largest(settled, &Log::i_d_A), largest(settled, &Log::i_q_A)),
                 w_rad_s = largest(settled, &Log::w_m_rad_s);
    PolledPoints out;
    for (const double most_s : kLook_s) {
        PolledPoints now;
        now.look_s = most_s;
        for (std::size_t i = 0; i < logs.size(); ++i) {
            now.logs.push_back(averaged(settled[i], logs[i].dt_s, most_s, i_A, w_rad_s));
            now.looks += now.logs.back().rows();
        }
        // Whole operating points, or too few of longer ones.
        if (out.looks > 0 && (now.looks < kLeastLooks || now.looks == out.looks)) return out;
        out = std::move(now);
        if (are_white(out.logs)) return out;
    }
    return out;
}

}  // namespace dqw
