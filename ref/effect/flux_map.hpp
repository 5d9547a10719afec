// A flux map: saturation as one co-energy that bends cell by cell over the currents, (E140), (E141).
#ifndef DQW_REF_EFFECT_FLUX_MAP_HPP
#define DQW_REF_EFFECT_FLUX_MAP_HPP

#include <array>

namespace dqw {

/// Cells of i_d, and of |i_q|: eight bend an axis of measured iron to 0.4 % of its flux, half as many what the axes do
/// to each other.
constexpr int kOwnCells = 8, kCrossCells = 4;
constexpr int kOwnWeights = 2 * kOwnCells, kCrossWeights = (kCrossCells + 2) * (kCrossCells + 1);

/// What one unit of each weight adds to psi_d, psi_q, Wb. `shape`: least and largest i_d, largest |i_q|, A.
void own_flux(const std::array<double, 4>& shape, double i_d_A, double i_q_A, double psi_d[], double psi_q[]);
void cross_flux(const std::array<double, 4>& shape, double i_d_A, double i_q_A, double psi_d[], double psi_q[]);

/// Their sums over the weights, psi_d and psi_q, Wb.
std::array<double, 2> own_flux_sum(const std::array<double, 4>& shape, const double weights[], double i_d_A,
                                   double i_q_A);
std::array<double, 2> cross_flux_sum(const std::array<double, 4>& shape, const double weights[], double i_d_A,
                                     double i_q_A);

/// The sums' slopes by the currents, dd, dq, qq, H.
std::array<double, 3> own_inductance(const std::array<double, 4>& shape, const double weights[], double i_d_A,
                                     double i_q_A);
std::array<double, 3> cross_inductance(const std::array<double, 4>& shape, const double weights[], double i_d_A,
                                       double i_q_A);

}  // namespace dqw
#endif
