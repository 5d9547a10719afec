// The shaft learners of lib/ and of port_q15/ over mechanical logs.
#ifndef DQW_APP_LEARN_MECHANICAL_HPP
#define DQW_APP_LEARN_MECHANICAL_HPP

#include <vector>

#include "app/learn/learn.hpp"

namespace dqw {

Learned learn_mechanical(const std::vector<Log>& logs, const LearnOptions& options);

}  // namespace dqw
#endif
