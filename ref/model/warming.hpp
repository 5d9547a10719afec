// What a friction that falls along a log, or rises, makes of a shaft's parameters.
#ifndef DQW_REF_MODEL_WARMING_HPP
#define DQW_REF_MODEL_WARMING_HPP

#include <Eigen/Core>
#include <vector>

#include "ref/log/log.hpp"

namespace dqw {

/// The sums of [J e] over a stretch of a log, e last, and when it was: from -1/2 at the log's begin to 1/2 at its end.
struct TimedSum {
    double when = 0.0;
    Eigen::MatrixXd gram;
};

/// Where a row of a log is in its time, as TimedSum has it.
double when_in(const Log& log, std::size_t row);

/// By how much each column may be off beside what white noise makes of it, where the whole friction may go along the log
/// as grease does that warms. `friction`: each column's value where it is a friction's, B or a weight, else 0.
/// `noise2`: mean square of e that is noise.
///
/// Source   (E191) in docs/EQUATIONS.md
Eigen::VectorXd warming_deviations(const std::vector<TimedSum>& sums, const Eigen::VectorXd& friction, double noise2);

}  // namespace dqw
#endif
