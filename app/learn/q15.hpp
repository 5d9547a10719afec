// The fixed-point estimator of port_q15/ over electrical logs, as a core without floating point would run it.
#ifndef DQW_APP_LEARN_Q15_HPP
#define DQW_APP_LEARN_Q15_HPP

#include <vector>

#include "app/learn/learn.hpp"
#include "dqw_estimator_q15.h"

namespace dqw {

Learned learn_q15(const std::vector<Log>& logs, const LearnOptions& options);

/// What the fixed-point estimator is configured with: full scales from the logs' largest signals, nominal values.
/// Throws std::invalid_argument.
dqw_estimator_q15_config q15_config_of(const std::vector<Log>& logs, const LearnOptions& options, double pole_pairs);

}  // namespace dqw
#endif
