#include "ref/fit/drag.hpp"

#include <Eigen/Core>
#include <cmath>
#include <set>

#include "ref/fit/explain.hpp"
#include "ref/log/symmetric.hpp"

namespace dqw {
namespace {

constexpr std::size_t kLeastSpeeds = 5;  ///< of three terms

std::string with_sd(double value, double sd, double unit) { return figure(unit * value) + " ± " + figure(unit * sd); }

}  // namespace

std::string drag_of(const std::vector<Log>& logs)
{
    std::vector<Eigen::Vector4d> rows;
    std::set<double> speeds;
    for (const Log& log : logs)
        for (std::size_t k = 0; k < log.torque_Nm.size(); ++k) {
            const double w = std::abs(log.w_m_rad_s[k]);
            if (!(w > 0.0)) continue;
            rows.emplace_back(1.0, w, w * w, log.w_m_rad_s[k] > 0.0 ? log.torque_Nm[k] : -log.torque_Nm[k]);
            speeds.insert(w);
        }
    if (speeds.size() < kLeastSpeeds) return "";
    const auto n = static_cast<Eigen::Index>(rows.size());
    Eigen::MatrixXd x(n, 3);
    Eigen::VectorXd y(n);
    for (Eigen::Index k = 0; k < n; ++k) {
        const Eigen::Vector4d& row = rows[static_cast<std::size_t>(k)];
        x.row(k) = row.head(3), y(k) = row[3];
    }
    // Whoever drives it, it brakes: a sensor's sign is its own.
    if (y.sum() < 0.0) y = -y;
    const Eigen::VectorXd size = x.colwise().norm(), unit = size.cwiseInverse();
    const Eigen::MatrixXd inverse = pseudo_inverse(unit.asDiagonal() * (x.transpose() * x) * unit.asDiagonal());
    const Eigen::VectorXd found = unit.asDiagonal() * (inverse * (unit.asDiagonal() * (x.transpose() * y)));
    const double variance = (y - x * found).squaredNorm() / static_cast<double>(n - 3);
    const Eigen::VectorXd sd = (variance * inverse.diagonal()).cwiseSqrt().cwiseProduct(unit);
    return "without current the shaft takes " + with_sd(found[0], sd[0], 1e3) + " mNm + (" +
           with_sd(found[1], sd[1], 1e6) + " µNms) w + (" + with_sd(found[2], sd[2], 1e9) +
           " nNms²) w²: friction and hysteresis, viscous friction and eddy currents, air; a load would be in all";
}

}  // namespace dqw
