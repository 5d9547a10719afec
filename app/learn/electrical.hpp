// The estimator of lib/ over electrical logs.
#ifndef DQW_APP_LEARN_ELECTRICAL_HPP
#define DQW_APP_LEARN_ELECTRICAL_HPP

#include <vector>

#include "app/learn/learn.hpp"
#include "dqw_modulation_name.h"

namespace dqw {

/// Which legs switch, as a run over these logs has it: said, or found.
dqw_modulation modulation_of_run(const std::vector<Log>& logs, const LearnOptions& options,
                                 const std::vector<TraceInput>& inputs, double pole_pairs);

Learned learn_electrical(const std::vector<Log>& logs, const LearnOptions& options);

}  // namespace dqw
#endif
