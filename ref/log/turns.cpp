#include "ref/log/turns.hpp"

#include <cmath>

#include "ref/log/piece.hpp"

namespace dqw {

double turns_of_angles(const std::vector<Log>& logs)
{
    constexpr double kMostStep_rad = 2.0, kLeastTurned_rad = 6.0;  // nearly a turn
    constexpr std::size_t kTogether = 100;
    double xy = 0.0, xx = 0.0, turned = 0.0;
    for (const Log& log : logs) {
        if (log.theta_e_rad.empty() || log.t_s.empty() || log.w_m_rad_s.empty()) return 0.0;
        for (const Piece& piece : pieces_of(log, 2)) {
            double sum_e = 0.0, sum_m = 0.0;
            for (std::size_t k = piece.begin + 1; k < piece.end; ++k) {
                const double electrical = std::remainder(log.theta_e_rad[k] - log.theta_e_rad[k - 1], 2.0 * M_PI);
                // A step near half a turn may be one the other way.
                if (std::abs(electrical) > kMostStep_rad) return 0.0;
                sum_e += electrical,
                    sum_m += 0.5 * (log.w_m_rad_s[k] + log.w_m_rad_s[k - 1]) * (log.t_s[k] - log.t_s[k - 1]);
                // Over many rows the speed's noise, which would make the ratio small, is averaged away.
                if ((k - piece.begin) % kTogether != 0 && k + 1 != piece.end) continue;
                xy += sum_e * sum_m, xx += sum_m * sum_m, turned += std::abs(sum_e);
                sum_e = sum_m = 0.0;
            }
        }
    }
    if (!(xx > 0.0) || turned < kLeastTurned_rad) return 0.0;
    return xy / xx;
}

double pole_pairs_of_angles(const std::vector<Log>& logs)
{
    // From a whole number: less than to any other, and of a few pairs 5 %.
    constexpr double kMost = 200.0, kNear = 0.05, kNearest = 0.3;
    const double p = turns_of_angles(logs), whole = std::round(p);
    return whole >= 1.0 && whole <= kMost && std::abs(p - whole) < kNear * whole && std::abs(p - whole) < kNearest
               ? whole
               : 0.0;
}

}  // namespace dqw
