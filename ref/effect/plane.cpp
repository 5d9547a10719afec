#include "ref/effect/plane.hpp"

#include <algorithm>
#include <cmath>

namespace dqw {
namespace {

/// The cell of an axis in which x lies, and how far in it.
std::size_t cell_of(const std::vector<double>& axis, double x, double& part)
{
    const auto last = axis.size() - 2;
    const auto above = std::upper_bound(axis.begin(), axis.end(), x) - axis.begin();
    const std::size_t cell = std::min(static_cast<std::size_t>(std::max<std::ptrdiff_t>(above - 1, 0)), last);
    part = (x - axis[cell]) / (axis[cell + 1] - axis[cell]);
    return cell;
}

double torque_of(const FluxNode& at, double pole_pairs, double i_d_A, double i_q_A)
{
    return 1.5 * pole_pairs * (at.psi_d_Wb * i_q_A - at.psi_q_Wb * i_d_A);
}

}  // namespace

FluxNode between(const FluxMap& map, double i_d_A, double i_q_A)
{
    double u = 0.0, v = 0.0;
    const std::size_t d = cell_of(map.i_d_A, i_d_A, u), q = cell_of(map.i_q_A, i_q_A, v);
    FluxNode out;
    out.seen = u >= 0.0 && u <= 1.0 && v >= 0.0 && v <= 1.0;
    for (const std::size_t a : {0, 1})
        for (const std::size_t b : {0, 1}) {
            const FluxNode& node = map.at(d + a, q + b);
            const double w = (a == 1 ? u : 1.0 - u) * (b == 1 ? v : 1.0 - v), by_d = i_d_A - map.i_d_A[d + a],
                         by_q = i_q_A - map.i_q_A[q + b];
            // Half of a slope: the chord's error and the tangent's are opposite.
            out.psi_d_Wb += w * (node.psi_d_Wb + 0.5 * (node.L_dd_H * by_d + node.L_dq_H * by_q));
            out.psi_q_Wb += w * (node.psi_q_Wb + 0.5 * (node.L_dq_H * by_d + node.L_qq_H * by_q));
            out.sd_d_Wb += w * node.sd_d_Wb, out.sd_q_Wb += w * node.sd_q_Wb;
            out.L_dd_H += w * node.L_dd_H, out.L_dq_H += w * node.L_dq_H, out.L_qq_H += w * node.L_qq_H;
            out.seen = out.seen && node.seen;
        }
    return out;
}

std::vector<LeastCurrent> mtpa(const FluxMap& map, double pole_pairs)
{
    constexpr int kCurrents = 25, kAngles = 720;
    std::vector<LeastCurrent> out;
    if (map.empty()) return out;
    double most_A = 0.0;
    for (std::size_t d = 0; d < map.i_d_A.size(); ++d)
        for (std::size_t q = 0; q < map.i_q_A.size(); ++q)
            if (map.at(d, q).seen) most_A = std::max(most_A, std::hypot(map.i_d_A[d], map.i_q_A[q]));
    for (int k = 1; k <= kCurrents; ++k) {
        LeastCurrent best;
        best.i_A = most_A * k / kCurrents;
        bool seen = false;
        for (int n = 0; n < kAngles; ++n) {
            const double angle = 2.0 * M_PI * n / kAngles, i_d = best.i_A * std::cos(angle),
                         i_q = best.i_A * std::sin(angle);
            const FluxNode at = between(map, i_d, i_q);
            const double torque = torque_of(at, pole_pairs, i_d, i_q);
            if (torque > best.torque_Nm) best.torque_Nm = torque, best.i_d_A = i_d, best.i_q_A = i_q, seen = at.seen;
        }
        // A best angle where the log was not is an extrapolation: so are all beyond it.
        if (!seen || (!out.empty() && !(best.torque_Nm > out.back().torque_Nm))) {
            if (out.empty()) continue;
            break;
        }
        out.push_back(best);
    }
    return out;
}

double current_without_d(const FluxMap& map, double pole_pairs, double torque_Nm)
{
    constexpr int kSteps = 500;
    double before_A = 0.0, before_Nm = 0.0;
    for (int k = 1; k <= kSteps; ++k) {
        const double i_q = map.i_q_A.back() * k / kSteps;
        const FluxNode at = between(map, 0.0, i_q);
        if (!at.seen) return std::nan("");
        const double torque = torque_of(at, pole_pairs, 0.0, i_q);
        if (torque >= torque_Nm) return before_A + (i_q - before_A) * (torque_Nm - before_Nm) / (torque - before_Nm);
        before_A = i_q, before_Nm = torque;
    }
    return std::nan("");
}

}  // namespace dqw
