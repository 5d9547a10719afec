// Starting values from a log itself: linear least squares on averages over blocks of rows.
#ifndef DQW_REF_MODEL_BLOCKS_HPP
#define DQW_REF_MODEL_BLOCKS_HPP

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "ref/log/piece.hpp"

namespace dqw {

/// Means of rows k .. k + n, ends halved (the voltage: rows k .. k + n - 1), and slopes from end to end.
struct Block {
    double v_d = 0, v_q = 0, i_d = 0, i_q = 0, wi_d = 0, wi_q = 0, w = 0, di_d = 0, di_q = 0, time_s = 0;
};
Block block_at(const Piece& piece, std::size_t k, std::size_t n);

struct MotionBlock {
    double torque = 0, w = 0, dw = 0;
};
MotionBlock motion_block_at(const Piece& piece, const std::vector<double>& torque, std::size_t k, std::size_t n);

struct ElectricalStart {
    double R_ohm, Ld_H, Lq_H, psi_Wb, pole_pairs;
};

/// Block regressions (v averaged, L di from the blocks' end currents) with blocks of 10 to 500 rows: noise on the
/// currents pulls L down in short ones, long ones are few. One start for each length that fits; never empty.
/// Without `pole_pairs`, the whole number from 1 to 64 that leaves the least. All values but psi positive.
std::vector<ElectricalStart> electrical_starts(const std::vector<Piece>& pieces, std::optional<double> pole_pairs);

struct MechanicalStart {
    double J_kgm2, B_Nms_rad;
};

/// The same for J dw/dt + B w = T, blocks of 20 to 1000 rows. `torque(piece)` gives the torque of a piece's log.
std::vector<MechanicalStart> mechanical_starts(const std::vector<Piece>& pieces,
                                               const std::vector<const std::vector<double>*>& torque);

}  // namespace dqw
#endif
