// By how much J and B of a mechanical log may be off for what lasts in the torque that is left.
#ifndef DQW_REF_MODEL_LASTING_HPP
#define DQW_REF_MODEL_LASTING_HPP

#include <Eigen/Core>
#include <vector>

#include "ref/model/model.hpp"

namespace dqw {

/// Of J and B: what of the blocks' residual torque lasts over two blocks, beyond what noise does by chance, over the
/// torque that a unit of each takes, RMS. `blocks`: of MechanicalModel::report(), in order. (E192)
Eigen::Vector2d lasting_deviations(const std::vector<ReportBlock>& blocks);

}  // namespace dqw
#endif
