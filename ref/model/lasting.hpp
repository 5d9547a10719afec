// By how much J and B of a mechanical log may be off for what lasts in the torque that is left.
#ifndef DQW_REF_MODEL_LASTING_HPP
#define DQW_REF_MODEL_LASTING_HPP

#include <Eigen/Core>
#include <vector>

#include "ref/model/model.hpp"

namespace dqw {

/// Means over a stretch of a log; `follows`: right after the one before it.
struct Moved {
    double left_Nm = 0.0, slope_rad_s2 = 0.0, w_rad_s = 0.0;
    bool follows = false;
};

/// Of J and B: what of the torque that is left lasts over two stretches, or turns its sign with each, beyond what noise
/// does by chance, over the torque that a unit of each takes, RMS. (E192)
Eigen::Vector2d lasting_deviations(const std::vector<Moved>& stretches);
/// Of blocks of MechanicalModel::report(), in order.
Eigen::Vector2d lasting_deviations(const std::vector<ReportBlock>& blocks);

}  // namespace dqw
#endif
