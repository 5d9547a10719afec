// Runs the float learners of lib/ over logs, as firmware would, sample by sample. No Ceres.
#ifndef DQW_APP_LEARN_HPP
#define DQW_APP_LEARN_HPP

#include <functional>
#include <string>
#include <vector>

#include "log.hpp"
#include "result.hpp"

namespace dqw {

struct LearnOptions {
    std::vector<std::string> parameters;        ///< asked for; empty: the regime's default
    std::function<void(double)> progress = {};  ///< called with 0..1 now and then
};

/// One pass of the learners over all logs, one after the other, as if each followed a gap.
/// Bases come from the logs' largest signals; nominal values only start the weights.
/// Throws std::invalid_argument (one line) for logs of different regimes or periods, too few rows, or an unknown parameter.
Result learn(const std::vector<Log>& logs, const LearnOptions& options = {});

}  // namespace dqw
#endif
