// The fixed-point shaft of port_q15/ over logs, as a core without floating point would run it.
#ifndef DQW_APP_LEARN_MECHANICAL_Q15_HPP
#define DQW_APP_LEARN_MECHANICAL_Q15_HPP

#include <vector>

#include "app/learn/learn.hpp"

namespace dqw {

Learned learn_mechanical_q15(const std::vector<Log>& logs, const LearnOptions& options);

}  // namespace dqw
#endif
