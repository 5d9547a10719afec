// R, L_d and L_q of a machine whose terminals are shorted, from the size of its current by speed.
#ifndef DQW_REF_FIT_SHORT_CIRCUIT_HPP
#define DQW_REF_FIT_SHORT_CIRCUIT_HPP

#include "ref/fit/task.hpp"
#include "ref/log/result.hpp"

namespace dqw {

/// The size of the current alone tells psi/R and psi/L; beside an open circuit, which tells psi, R and L_d. L_q is told
/// where the machine is salient enough, else L_d holds what it may differ by.
///
/// Source   (E163) in docs/EQUATIONS.md
/// Shape    logs of short circuits (ref/model/open_circuit.hpp), and none or more of open ones
/// Throws   std::invalid_argument, one line: other logs beside them, too few speeds
Result fit_short_circuit(const Task& task);

}  // namespace dqw
#endif
