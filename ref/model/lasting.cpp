#include "ref/model/lasting.hpp"

#include <algorithm>
#include <cmath>

namespace dqw {
namespace {

constexpr double kByChance = 3.0;  ///< deviations of a mean of products of white noise

/// The mean of products of blocks two apart, in which neither's noise stands; 0 where it may be chance.
struct Lasting {
    double products = 0.0, squares = 0.0, count = 0.0;
    void add(double now, double before) { products += now * before, squares += now * now, count += 1.0; }
    double square() const
    {
        if (!(count > 0.0)) return 0.0;
        return std::max(0.0, (products - kByChance * squares / std::sqrt(count)) / count);
    }
};

double slope_of(const ReportBlock& b)
{
    const auto& w = b.log->w_m_rad_s;
    return (w[b.end] - w[b.begin]) / (b.log->t_s[b.end] - b.log->t_s[b.begin]);
}

double speed_of(const ReportBlock& b) { return 0.5 * (b.log->w_m_rad_s[b.end] + b.log->w_m_rad_s[b.begin]); }

}  // namespace

Eigen::Vector2d lasting_deviations(const std::vector<ReportBlock>& blocks)
{
    Lasting left, slope, speed;
    for (std::size_t k = 2; k < blocks.size(); ++k) {
        const ReportBlock &now = blocks[k], &before = blocks[k - 2];
        if (before.log != now.log || before.end != blocks[k - 1].begin || blocks[k - 1].end != now.begin) continue;
        left.add(now.residual[0], before.residual[0]);
        slope.add(slope_of(now), slope_of(before));
        speed.add(speed_of(now), speed_of(before));
    }
    const auto by = [&](const Lasting& takes) {
        return takes.square() > 0.0 ? std::sqrt(left.square() / takes.square()) : 0.0;
    };
    return {by(slope), by(speed)};
}

}  // namespace dqw
