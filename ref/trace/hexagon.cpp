#include "ref/trace/hexagon.hpp"

#include <algorithm>
#include <cmath>

namespace dqw {

std::vector<char> beyond_hexagon(const Log& log, const TraceColumns& columns, double pole_pairs)
{
    if (log.v_dc_V.empty() || (log.theta_e_rad.empty() && log.theta_m_rad.empty())) return {};
    // A link that is measured once a period, and by a sensor of its own, is off by as much.
    constexpr double kOff = 0.02;
    std::vector<char> beyond(log.rows(), 0);
    for (std::size_t k = 0; k < log.rows(); ++k) {
        const double half = 0.5 * pole_pairs * log.w_m_rad_s[k] * log.dt_s, turn_c = std::cos(half),
                     turn_s = std::sin(half), c = turn_c * columns.cos_e[k] - turn_s * columns.sin_e[k],
                     s = turn_s * columns.cos_e[k] + turn_c * columns.sin_e[k];
        const double alpha = c * log.v_d_V[k] - s * log.v_q_V[k], beta = s * log.v_d_V[k] + c * log.v_q_V[k];
        const double a = alpha, b = 0.5 * (std::sqrt(3.0) * beta - alpha), last = -a - b;
        beyond[k] = std::max({a, b, last}) - std::min({a, b, last}) > (1.0 + kOff) * log.v_dc_V[k] ? 1 : 0;
    }
    return beyond;
}

std::vector<Piece> without_marked(const std::vector<Piece>& pieces, const std::vector<Log>& logs,
                                  const std::vector<std::vector<char>>& marks, std::size_t least)
{
    std::vector<Piece> out;
    for (const Piece& piece : pieces) {
        const std::vector<char>& mark = marks[static_cast<std::size_t>(piece.log - logs.data())];
        for (std::size_t k = piece.begin; k < piece.end;) {
            std::size_t end = k;
            while (end < piece.end && (mark.empty() || mark[end] == 0)) ++end;
            Piece part = piece;
            part.begin = k, part.end = end;
            if (end >= k + least) out.push_back(part);
            k = end + 1;
        }
    }
    return out;
}

}  // namespace dqw
