// Watches a slow log, polled or of settled points, look by look over minutes and hours.
#ifndef DQW_APP_MONITOR_LOOKS_HPP
#define DQW_APP_MONITOR_LOOKS_HPP

#include "app/monitor/run.hpp"
#include "ref/log/log.hpp"

namespace dqw {

/// R, L_d, L_q and flux of each look against those of the first looks. R may go with the winding's heat and the flux
/// with the magnet's; with a temperature column they must. Names need what a mean can show: ripples are not in it.
///
/// Source   (E156), (E157) in docs/EQUATIONS.md
/// Throws   std::invalid_argument where the log is too short for a healthy value
MonitorRun watch_looks(const Log& log, const MonitorWatch& watch);

}  // namespace dqw
#endif
