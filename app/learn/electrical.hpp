// The estimator of lib/ over electrical logs.
#ifndef DQW_APP_LEARN_ELECTRICAL_HPP
#define DQW_APP_LEARN_ELECTRICAL_HPP

#include <vector>

#include "app/learn/learn.hpp"

namespace dqw {

Learned learn_electrical(const std::vector<Log>& logs, const LearnOptions& options);

}  // namespace dqw
#endif
