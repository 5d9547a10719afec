// States that no column shows, a heat's or a link capacitor's: which one a log tells, and what hangs on that.
#ifndef DQW_REF_TRACE_STATE_HPP
#define DQW_REF_TRACE_STATE_HPP

#include "ref/trace/setup.hpp"

namespace dqw {

/// The point with the time constant of each state that does best on the rows held out, by steps from its own.
Refined settle_state(const Model& model, Refined found);

/// (E126), (E118). The machine's parameters under other time constants, and of a heating state that stands in for a
/// thermometer heated by the currents or by one power all the time; 0 where there is none.
Eigen::VectorXd spread_over_states(const TraceSetup& setup, const Refined& best);

}  // namespace dqw
#endif
