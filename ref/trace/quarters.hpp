// Deviations that see what changes slowly along a log.
#ifndef DQW_REF_TRACE_QUARTERS_HPP
#define DQW_REF_TRACE_QUARTERS_HPP

#include <Eigen/Dense>

#include "ref/search/solve.hpp"

namespace dqw {

/// `sd`, or where the fits without each quarter of the rows seen scatter clearly more, that: friction that falls while
/// its grease warms is the same in neighbouring blocks. (E191)
Eigen::VectorXd beside_quarters(const Model& model, const Refined& refined, Eigen::VectorXd sd);

}  // namespace dqw
#endif
