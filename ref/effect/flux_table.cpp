#include "ref/effect/flux_table.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace dqw {
namespace {

constexpr int kCells = 20;          ///< of i_d, and of |i_q|: 441 nodes of 4 bytes, 1770 bytes in all
constexpr double kParts = 32768.0;  ///< of the largest flux
constexpr double kLeastBend = 1e-6;

struct Bend {
    double d, q;
};

/// Of a map, what its tangent at zero current leaves, even and odd in i_q.
class Bends {
public:
    explicit Bends(const FluxMap& map) : map_(map), zero_(between(map, 0.0, 0.0)) {}
    Bend operator()(double i_d, double i_q) const
    {
        const FluxNode up = between(map_, i_d, i_q), down = between(map_, i_d, -i_q);
        return {0.5 * (up.psi_d_Wb + down.psi_d_Wb) - zero_.psi_d_Wb - zero_.L_dd_H * i_d,
                0.5 * (up.psi_q_Wb - down.psi_q_Wb) - zero_.L_qq_H * i_q};
    }

private:
    const FluxMap& map_;
    const FluxNode zero_;
};

}  // namespace

FluxRange range_of(const FluxMap& map)
{
    return {map.i_d_A.front(), map.i_d_A.back(), std::max(map.i_q_A.back(), -map.i_q_A.front())};
}

TraceInput flux_table(const FluxMap& map, const FluxRange& over)
{
    const double least_A = std::min(over.least_d_A, 0.0), most_A = std::max(over.most_d_A, 0.0), q_A = over.most_q_A;
    if (!(most_A > least_A) || !(q_A > 0.0)) throw std::invalid_argument("a flux map needs currents on both axes");
    const int below = std::clamp(static_cast<int>(std::lround(-least_A / (most_A - least_A) * kCells)),
                                 least_A < 0.0 ? 1 : 0, most_A > 0.0 ? kCells - 1 : kCells);
    const double cell_d_A = std::max(below > 0 ? -least_A / below : 0.0,
                                     below < kCells ? most_A / (kCells - below) : 0.0),
                 cell_q_A = q_A / kCells;
    const Bends at(map);
    std::vector<Bend> bends;
    double full_Wb = 0.0, flux_Wb = 0.0;
    for (const FluxNode& n : map.nodes) flux_Wb = std::max(flux_Wb, std::hypot(n.psi_d_Wb, n.psi_q_Wb));
    for (int d = -below; d <= kCells - below; ++d)
        for (int q = 0; q <= kCells; ++q) {
            const double i_d = d * cell_d_A, i_q = q * cell_q_A;
            Bend b = at(i_d, i_q);
            const Bend own = b;
            // A twelfth of second differences: the mean of a chord is then the curve's.
            for (const Bend& beside :
                 {at(i_d - cell_d_A, i_q), at(i_d + cell_d_A, i_q), at(i_d, i_q - cell_q_A), at(i_d, i_q + cell_q_A)})
                b.d -= (beside.d - own.d) / 12.0, b.q -= (beside.q - own.q) / 12.0;
            full_Wb = std::max({full_Wb, std::abs(b.d), std::abs(b.q)});
            bends.push_back(b);
        }
    if (!(full_Wb > kLeastBend * flux_Wb))
        throw std::invalid_argument("this flux map does not bend: R, L and psi say it all");
    full_Wb *= kParts / (kParts - 1.0);
    TraceInput out{"flux_map", {full_Wb, cell_d_A, cell_q_A}, {1.0, 1.0}};
    out.map = {kCells + 1, static_cast<std::int16_t>(below), kCells + 1};
    for (const Bend& b : bends)
        for (const double x : {b.d, b.q})
            out.map.push_back(static_cast<std::int16_t>(std::lround(x / full_Wb * kParts)));
    return out;
}

}  // namespace dqw
