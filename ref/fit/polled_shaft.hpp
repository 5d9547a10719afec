// Inertia and friction of a polled log whose machine drives no load: torque by the log's own psi.
#ifndef DQW_REF_FIT_POLLED_SHAFT_HPP
#define DQW_REF_FIT_POLLED_SHAFT_HPP

#include "ref/fit/polled_logs.hpp"
#include "ref/fit/task.hpp"
#include "ref/log/result.hpp"

namespace dqw {

/// J and B where they are asked for, Coulomb friction in a note. A load would be in them: who asks says there is none.
///
/// Source   (E159) in docs/EQUATIONS.md
void publish_shaft(const Task& task, const PolledLogs& p, Result& result);

}  // namespace dqw
#endif
