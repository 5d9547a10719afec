#include "ref/model/lasting.hpp"

#include <algorithm>
#include <cmath>

namespace dqw {
namespace {

constexpr double kByChance = 3.0;  ///< deviations of a mean of products of white noise

}  // namespace

Eigen::Vector2d lasting_deviations(const std::vector<Moved>& stretches)
{
    double products = 0.0, squares = 0.0, count = 0.0, slopes = 0.0, speeds = 0.0;
    for (std::size_t k = 2; k < stretches.size(); ++k) {
        const Moved& now = stretches[k];
        if (!now.follows || !stretches[k - 1].follows) continue;
        // Stretches two apart, in which no end's noise stands twice.
        products += now.left_Nm * stretches[k - 2].left_Nm, squares += now.left_Nm * now.left_Nm, count += 1.0;
        slopes += now.slope_rad_s2 * now.slope_rad_s2, speeds += now.w_rad_s * now.w_rad_s;
    }
    if (!(count > 0.0)) return Eigen::Vector2d::Zero();
    const double lasts = std::max(0.0, std::abs(products) - kByChance * squares / std::sqrt(count));
    return {slopes > 0.0 ? std::sqrt(lasts / slopes) : 0.0, speeds > 0.0 ? std::sqrt(lasts / speeds) : 0.0};
}

Eigen::Vector2d lasting_deviations(const std::vector<ReportBlock>& blocks)
{
    std::vector<Moved> stretches;
    for (std::size_t k = 0; k < blocks.size(); ++k) {
        const ReportBlock& b = blocks[k];
        const auto &w = b.log->w_m_rad_s, &t = b.log->t_s;
        stretches.push_back({b.residual[0], (w[b.end] - w[b.begin]) / (t[b.end] - t[b.begin]),
                             0.5 * (w[b.end] + w[b.begin]),
                             k > 0 && blocks[k - 1].log == b.log && blocks[k - 1].end == b.begin});
    }
    return lasting_deviations(stretches);
}

}  // namespace dqw
